//! Shifts of a sensor's zero: all readings from one on, or those of a stretch, deviate by a constant, abruptly and not when the voltage
//! changes.
//!
//! A linear model follows such a step with a slow time constant of its own, which hides the step and spoils all other parameters. So the
//! places of steps are taken from the errors of the best model, and their sizes are fitted together with it.

use crate::linear::{Fit, Problem};
use crate::nominal::covariance::Spectrum;
use crate::nominal::far_readings::after_changes;
use crate::nominal::identified::Course;
use crate::nominal::intervals::directions;
use crate::nominal::models::{Models, effective_rows};
use crate::nominal::report::Oscillation;
use crate::stats::median::{median, robust_deviation};
use crate::stats::scale::{root_mean_square, second_differences};
use crate::stats::shifted_run::shifted_runs;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::PRICE_OF_RUN;
use crate::stats::thresholds::probability::{RIVAL_ODDS, Z_RARE};

/// Most searches for a model with further shifts.
pub(super) const MOST_SEARCHES: usize = 3;
/// A shift is no chance, at the best of all places, if it is as many of its standard deviations.
const SIGNIFICANT: f64 = 6.0;

/// Readings on each side of an edge whose medians are compared.
const NEXT_TO: usize = 5;
/// Smallest such difference at an edge, in scales of the noise from row to row.
const ABRUPT: f64 = 2.0;
/// The lower edge of a stretch is one if it is so large relative to the higher one.
const OTHER_EDGE: f64 = 0.5;
/// Largest damping ratio of an oscillation that the errors of a spring that is not linear follow.
const RINGING: f64 = 0.3;
/// Periods of such an oscillation that a stretch lasts at least: a shorter one may be one of its half waves.
const SHORTEST_STRETCH: f64 = 3.0;

/// The shortest time that a stretch of shifted readings lasts, in s, beside a spring's oscillations.
pub(super) fn shortest_stretch(oscillations: &[Oscillation]) -> f64 {
    let ringing = oscillations.iter().filter(|oscillation| oscillation.zeta.value < RINGING);
    ringing.map(|oscillation| SHORTEST_STRETCH / oscillation.freq_hz.value).fold(0.0, f64::max)
}

/// Returns the times between readings at which the errors of a record step, in s; none if they do not, or as the voltage changes, or for
/// a shorter stretch than the shortest.
pub(super) fn steps(course: &Course, delay: f64, shortest: f64) -> Vec<f64> {
    let usual = robust_deviation(course.residual.iter().copied()).unwrap_or(0.0);
    let [by_level, by_edges] = shifted_runs(&course.residual, usual);
    let Some(run) = by_edges.or(by_level) else { return Vec::new() };
    let rows = course.residual.len();
    let mut edges: Vec<(usize, f64)> = [run.from, run.to]
        .into_iter()
        .filter(|&edge| edge > 0 && edge < rows)
        .map(|edge| (edge, jump(&course.residual, edge)))
        .collect();
    // A zero that stays shifted has one edge; the other end of the run is then where the errors happen to be small.
    let highest = edges.iter().map(|(_, jump)| jump.abs()).fold(0.0, f64::max);
    let noise = robust_deviation(second_differences(&course.residual)).unwrap_or(0.0);
    edges.retain(|(_, jump)| jump.abs() > (OTHER_EDGE * highest).max(ABRUPT * noise));
    let edges: Vec<usize> = edges.into_iter().map(|(edge, _)| edge).collect();
    let after = after_changes(course, delay);
    if edges.iter().any(|&edge| after[edge]) {
        return Vec::new();
    }
    let times: Vec<f64> = edges.into_iter().map(|edge| 0.5 * (course.time_s[edge - 1] + course.time_s[edge])).collect();
    match times[..] {
        [from, to] if to - from < shortest => Vec::new(),
        _ => times,
    }
}

/// Difference of the median errors next to an edge.
fn jump(errors: &[f64], edge: usize) -> f64 {
    let [before, after] = [edge.saturating_sub(NEXT_TO)..edge, edge..(edge + NEXT_TO).min(errors.len())]
        .map(|rows| median(&mut errors[rows].to_vec()).unwrap_or(0.0));
    after - before
}

/// True if models with further shifts are better than those without by more than the search for their places may gain, each of their
/// shifts is larger than its error, and the gain does not change with the zero.
pub(super) fn are_shown(with: &Models, without: &Models) -> bool {
    let [held_out, before] = [with, without].map(|models| &models.fits[models.chosen].held_out);
    let fit = with.best_fit();
    let shifts = with.problem.shift_parameters(fit.poles.order());
    let further = shifts.len() - without.problem.shift_parameters(without.best_fit().poles.order()).len();
    let price = RIVAL_ODDS + PRICE_OF_RUN.get() * further as f64 * (held_out.len() as f64).ln();
    let ratio = root_mean_square(held_out) / root_mean_square(before);
    if -effective_rows(&with.problem, held_out) * ratio.ln() <= price {
        return false;
    }
    let fit = with.problem.linearised(fit.poles.clone());
    let spectrum = Spectrum::of(&fit.residual, with.problem.starts(), &directions(&with.problem, &fit));
    let parameters = fit.parameters(&with.problem);
    let mut significant = shifts.into_iter().map(|at| {
        let mut unit = vec![0.0; parameters.len()];
        unit[at] = 1.0;
        parameters[at].abs() > SIGNIFICANT * spectrum.deviation(&fit.influence(&unit))
    });
    significant.all(|significant| significant) && !changes_gain(&with.problem, &fit, &spectrum)
}

/// True if the errors of a linearised fit follow the response itself from a shift of the zero on: then the gain has changed.
fn changes_gain(problem: &Problem, fit: &Fit, spectrum: &Spectrum) -> bool {
    let (directions, response) = (fit.directions(), problem.response(fit));
    problem.shift_rows().any(|rows| {
        let mut column = vec![0.0; response.len()];
        column[rows.clone()].copy_from_slice(&response[rows]);
        for direction in &directions {
            let part = dot(direction, &column);
            column.iter_mut().zip(direction).for_each(|(value, along)| *value -= part * along);
        }
        let power = dot(&column, &column);
        let influence: Vec<f64> = column.iter().map(|value| value / power).collect();
        power > 0.0 && dot(&influence, &fit.residual).abs() > Z_RARE * spectrum.deviation(&influence)
    })
}
