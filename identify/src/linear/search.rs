//! The best model of each order: starts on a grid and from the best models of lower order, refined on part of the rows, then on all.

use std::f64::consts::PI;

use crate::linear::problem::{Fit, Poles, Problem, SAME_PLACE};
use crate::linear::section::Section;
use crate::linear::series::Series;
use crate::stats::periodogram::powers;

/// Largest order of a model.
pub const LARGEST_ORDER: usize = 4;
/// Readings for each parameter without which a model is not tried.
const READINGS_PER_PARAMETER: usize = 3;
/// Most readings of the part of a record that is searched.
const ROWS_TO_SEARCH: usize = 2_000;
/// Most pieces of the voltage in the part of a record that is searched.
const PIECES_TO_SEARCH: usize = 20_000;
/// Ratio of neighbouring time constants on the grid.
const TAU_RATIO: f64 = 2.2;
/// Ratio of neighbouring frequencies on the grid.
const FREQUENCY_RATIO: f64 = 1.2;
/// Damping ratios on the grid.
const DAMPINGS: [f64; 2] = [0.05, 0.3];
/// Starts that are refined, and starts of these that are refined until they stand.
const STARTS: (usize, usize) = (5, 2);
/// Steps of the quick and of the complete refinement.
const STEPS: (usize, usize) = (5, 25);
/// Most jumps of the delay by up to two rows after a refinement.
const MOST_DELAY_JUMPS: usize = 10;
/// Shortest step of a delay in uneven rows, in spacings of the rows.
const LEAST_DELAY_STEP: f64 = 0.01;
/// Most steps towards the place of a delay in all rows from that in a part of them.
const MOST_STEPS_TO_PLACE: usize = 40;
/// Places of the delay on both sides that are tried next in uneven rows.
const PLACES_NEAR: usize = 3;
/// Most steps on all rows of a record of which only a part was searched, and the relative reduction of the cost below which they
/// end.
const STEPS_ON_ALL: (usize, f64) = (4, 1e-5);
/// Most places of readings in the spectrum of a residual.
const MOST_PLACES: f64 = 100_000.0;
/// Spectral lines of the residual at which a pair of poles is tried.
const PEAKS: usize = 4;
/// Relative reduction of the cost below which a refinement ends: of a quick one, of one on part of the rows, and of the last one.
const LEAST: (f64, f64, f64) = (1e-3, 1e-5, 1e-13);

/// The best models of order 0 to [`LARGEST_ORDER`], as far as the readings allow.
pub fn best_of_each_order(problem: &Problem) -> impl Iterator<Item = Fit> {
    best_up_to(problem, LARGEST_ORDER)
}

/// The number of readings without which a model of an order is not tried.
pub fn fewest_readings(problem: &Problem, order: usize) -> usize {
    READINGS_PER_PARAMETER * (problem.linear_columns(order) + order + 1)
}

/// The best models of order 0 to `largest`, as far as the readings allow. Each is fitted to all rows when it is asked for, as a fit of
/// many rows is large.
pub fn best_up_to(problem: &Problem, largest: usize) -> impl Iterator<Item = Fit> {
    let part = (problem.rows() > ROWS_TO_SEARCH).then(|| problem.part(ROWS_TO_SEARCH, PIECES_TO_SEARCH));
    let searched = part.as_ref().unwrap_or(problem);
    let mut found: Vec<Vec<Poles>> = Vec::new();
    for order in 0..=largest {
        if order > 0 && problem.rows() < fewest_readings(problem, order) {
            break;
        }
        found.push(best(searched, starts(searched, order, &found)));
    }
    let (steps, least) = if part.is_some() { STEPS_ON_ALL } else { (STEPS.1, LEAST.2) };
    found.into_iter().map(move |models| {
        let mut first = models.into_iter().next().expect("a best model");
        if let Some(part) = &part {
            first = settled(problem, part, first);
        }
        problem.refined(problem.within(first), steps, least)
    })
}

/// Refines the most promising starts; returns the best models, the best first.
fn best(problem: &Problem, mut tried: Vec<(f64, Poles)>) -> Vec<Poles> {
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    tried.truncate(STARTS.0);
    let refine = |tried: Vec<(f64, Poles)>, steps: usize, least: f64| {
        let fits = tried.into_iter().map(|(_, poles)| problem.refined(poles, steps, least));
        let mut fits: Vec<(f64, Poles)> = fits.map(|fit| (fit.cost, fit.poles)).collect();
        fits.sort_by(|a, b| a.0.total_cmp(&b.0));
        fits
    };
    let mut tried = refine(tried, STEPS.0, LEAST.0);
    tried.truncate(STARTS.1);
    let mut tried = refine(tried, STEPS.1, LEAST.1);
    // A delay crosses whole rows only in jumps.
    for _ in 0..MOST_DELAY_JUMPS {
        let best = tried[0].clone();
        let near = delays_near(problem, best.1.delay).into_iter();
        let near = near.map(|delay| Poles { delay: problem.delay_within(delay), ..best.1.clone() });
        let near = near.filter(|poles| tried.iter().all(|(_, other)| other.delay != poles.delay)).collect();
        let mut near = costs(problem, near);
        near.truncate(STARTS.1);
        tried.extend(refine(near, STEPS.0, LEAST.1));
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        if tried[0].1.delay == best.1.delay {
            break;
        }
    }
    without_needless_delay(problem, tried)
}

/// The models, with one without delay first if the best one's delay improves the fit by less than Schwarz's criterion asks of one
/// parameter.
fn without_needless_delay(problem: &Problem, mut tried: Vec<(f64, Poles)>) -> Vec<Poles> {
    let (cost, best) = tried[0].clone();
    if best.delay > 0.0 {
        let none = problem.refined(Poles { delay: 0.0, ..best }, STEPS.1, LEAST.1);
        let none = match tried.iter().find(|(_, poles)| poles.delay == 0.0) {
            Some((cost, poles)) if *cost < none.cost => (*cost, poles.clone()),
            _ => (none.cost, Poles { delay: 0.0, ..none.poles }),
        };
        let rows = problem.rows() as f64;
        if rows * (none.0 / cost).ln() < rows.ln() {
            tried.insert(0, none);
        }
    }
    tried.into_iter().map(|(_, poles)| poles).collect()
}

/// The starts with their costs, the best first.
fn costs(problem: &Problem, mut starts: Vec<Poles>) -> Vec<(f64, Poles)> {
    starts.sort_by(|a, b| a.delay.total_cmp(&b.delay));
    let mut costs: Vec<(f64, Poles)> = Vec::new();
    for of_delay in starts.chunk_by(|a, b| a.delay == b.delay) {
        let paths = problem.paths(of_delay[0].delay);
        let within = of_delay.iter().map(|poles| problem.within(poles.clone()));
        costs.extend(within.map(|poles| (problem.fit_on(&paths, poles.clone()).cost, poles)));
    }
    costs.sort_by(|a, b| a.0.total_cmp(&b.0));
    costs
}

/// The starts of an order with their costs; `found` holds the best models of all lower orders.
fn starts(problem: &Problem, order: usize, found: &[Vec<Poles>]) -> Vec<(f64, Poles)> {
    let none = |delay| Poles { sections: Vec::new(), undriven: Vec::new(), delay };
    let taus = geometric(0.5 * problem.spacing, problem.bounds.tau.1, TAU_RATIO).map(|tau| Section::First { tau });
    let lags: Vec<Section> = taus.collect();
    let mut starts = Vec::new();
    match order {
        0 => return costs(problem, delays(problem).map(none).collect()),
        1 => delays(problem).for_each(|delay| starts.extend(with_each(problem, none(delay), |_| lags.clone()))),
        _ => {
            for base in with_less_delay(problem, &found[order - 1]) {
                starts.extend(with_each(problem, base, |_| lags.clone()));
            }
            for base in with_less_delay(problem, &found[order - 2]) {
                starts.extend(with_each(problem, base, |fit| pairs(problem, fit)));
            }
        }
    }
    starts
}

/// A model with each of several further sections, and their costs.
fn with_each(problem: &Problem, base: Poles, sections: impl Fn(&Fit) -> Vec<Section>) -> Vec<(f64, Poles)> {
    let paths = problem.paths(base.delay);
    let fit = problem.fit_on(&paths, base);
    let sections: Vec<Section> = sections(&fit).into_iter().map(|section| problem.section_within(section)).collect();
    let costs = problem.costs_with(&paths, &fit, &sections);
    costs.into_iter().zip(sections).map(|(cost, section)| (cost, with(&fit.poles, section))).collect()
}

/// Pairs of poles on a grid, and at the highest peaks of a fit's residual.
fn pairs(problem: &Problem, fit: &Fit) -> Vec<Section> {
    let frequencies = geometric(1.0 / problem.bounds.decay, problem.bounds.frequency.1, FREQUENCY_RATIO);
    let on_grid = frequencies.flat_map(|frequency| DAMPINGS.map(|damping| Section::Second { frequency, damping }));
    let at_peaks = peaks(problem, &fit.residual).into_iter().flat_map(|(frequency, width)| {
        [0.5, 2.0].map(|of| Section::Second { frequency, damping: (of * width / frequency).min(0.7) })
    });
    on_grid.chain(at_peaks).collect()
}

/// The best model, and the same with less delay where it has one: a further pole takes the place of a part of the delay.
fn with_less_delay(problem: &Problem, models: &[Poles]) -> Vec<Poles> {
    let Some(best) = models.first() else { return Vec::new() };
    let parts: &[f64] = if best.delay > 0.0 { &[1.0, 0.5, 0.0] } else { &[1.0] };
    parts.iter().map(|part| Poles { delay: problem.delay_within(part * best.delay), ..best.clone() }).collect()
}

/// A model with a further section; two lags become one section of second order.
fn with(base: &Poles, section: Section) -> Poles {
    let mut poles = base.clone();
    match (poles.sections.last().copied(), section) {
        (Some(Section::First { tau: other }), Section::First { tau }) => {
            poles.sections.pop();
            poles.sections.insert(0, Section::of_lags(tau, other));
        }
        (_, Section::First { .. }) => poles.sections.push(section),
        _ => poles.sections.insert(0, section),
    }
    poles
}

/// Delays near another one: whole and half rows, or, in uneven rows, the next places and others further and further away.
fn delays_near(problem: &Problem, delay: f64) -> Vec<f64> {
    if problem.bounds.held && !problem.bounds.whole_rows {
        let (above, up_to) = problem.place_of_delay(delay);
        let further = geometric(LEAST_DELAY_STEP, 2.0, 2.0).flat_map(|rows| {
            let by = rows * problem.spacing;
            [above - by, up_to + by]
        });
        further.chain(next_places(problem, delay)).collect()
    } else {
        let rows = (delay / problem.spacing).floor();
        [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0].map(|by| (rows + by) * problem.spacing).to_vec()
    }
}

/// Delays in the next places on both sides of that of a delay.
fn next_places(problem: &Problem, delay: f64) -> Vec<f64> {
    let beyond = SAME_PLACE * problem.spacing;
    let (above, up_to) = problem.place_of_delay(delay);
    let before = std::iter::successors(Some(above), |up_to| Some(problem.place_of_delay(*up_to).0));
    let after = std::iter::successors(Some(up_to + beyond), |delay| Some(problem.place_of_delay(*delay).1 + beyond));
    before.take(PLACES_NEAR).chain(after.take(PLACES_NEAR)).filter(|delay| delay.is_finite()).collect()
}

/// The model with the best delay near its own, its sections unchanged: in `part` of the rows the places of the delay are wider.
fn settled(problem: &Problem, part: &Problem, poles: Poles) -> Poles {
    if !problem.bounds.held || problem.bounds.whole_rows {
        return poles;
    }
    let width = |(above, up_to): (f64, f64)| (up_to - above).clamp(SAME_PLACE * problem.spacing, problem.spacing);
    let mut step = width(part.place_of_delay(poles.delay));
    let mut best = Poles { delay: problem.delay_within(poles.delay), ..poles };
    let mut cost = problem.fit(best.clone()).cost;
    let mut jump = |delays: &[f64], best: &mut Poles| {
        let delays = delays.iter().map(|delay| problem.delay_within(*delay)).filter(|delay| *delay != best.delay);
        let near = costs(problem, delays.map(|delay| Poles { delay, ..best.clone() }).collect());
        let better = near.into_iter().next().filter(|(there, _)| *there < cost);
        better.map(|(there, poles)| (cost, *best) = (there, poles)).is_some()
    };
    for _ in 0..MOST_STEPS_TO_PLACE {
        if step <= width(problem.place_of_delay(best.delay)) {
            break;
        }
        if !jump(&[best.delay - step, best.delay + step], &mut best) {
            step *= 0.5;
        }
    }
    for _ in 0..MOST_DELAY_JUMPS {
        if !jump(&next_places(problem, best.delay), &mut best) {
            break;
        }
    }
    best
}

/// Delays that are tried: whole and half rows at first, then further and further apart.
fn delays(problem: &Problem) -> impl Iterator<Item = f64> + '_ {
    let rows = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let further = geometric(12.5, f64::INFINITY, 1.25).map(f64::round);
    let possible = |rows: &f64| !problem.bounds.whole_rows || rows.fract() == 0.0;
    let delays = rows.into_iter().chain(further).filter(possible).map(|rows| rows * problem.spacing);
    let longest = problem.bounds.delay.1;
    delays.take_while(move |delay| *delay <= longest).map(|delay| problem.delay_within(delay))
}

fn geometric(from: f64, to: f64, ratio: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(from), move |last| Some(last * ratio)).take_while(move |value| *value <= to)
}

/// Angular frequencies of the highest peaks of the residual's spectrum and their widths, of the longest record with equal rows; where
/// a reading is missing, the residual is 0.
fn peaks(problem: &Problem, residual: &[f64]) -> Vec<(f64, f64)> {
    let records = problem.series.iter().zip(problem.starts());
    let Some((series, &first)) =
        records.filter(|(series, _)| series.even).max_by_key(|(series, _): &(&Series, _)| series.rows())
    else {
        return Vec::new();
    };
    // Of a part of the rows the distances vary.
    let step = series.spacing.max(series.duration() / MOST_PLACES);
    let place = |time: f64| ((time - series.time[0]) / step).round() as usize;
    let mut placed = vec![0.0; place(series.time[series.rows() - 1]) + 1];
    series.time.iter().zip(&residual[first..]).for_each(|(&time, error)| placed[place(time)] = *error);
    let power = powers(&placed);
    let of_bin = PI / ((power.len() - 1) as f64 * step);
    let mut peaks: Vec<usize> =
        (2..power.len() - 1).filter(|&at| power[at] > power[at - 1] && power[at] >= power[at + 1]).collect();
    peaks.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    let mut kept: Vec<usize> = Vec::new();
    for peak in peaks {
        if kept.iter().all(|other| other.abs_diff(peak) > power.len() / 200) {
            kept.push(peak);
        }
        if kept.len() == PEAKS {
            break;
        }
    }
    kept.into_iter().map(|at| (at as f64 * of_bin, 4.0 * of_bin)).collect()
}
