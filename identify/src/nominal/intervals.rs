//! Intervals of 95 % for the quantities of a model: the delta method on the fit's covariance, and which delays fit.

use crate::linear::{Fit, Poles, Problem, SAME_PLACE};
use crate::nominal::canonical::Canonical;
use crate::nominal::covariance::Spectrum;
use crate::nominal::models::{REFIT, steps};
use crate::nominal::report::Quantity;
use crate::stats::sums::dot;
use crate::stats::thresholds::probability::Z;

/// Step of a parameter for a difference quotient, in standard deviations of the parameter.
const DIFFERENCE: f64 = 1e-2;
/// Ratio to the value from which a bound says nothing.
const UNKNOWN: f64 = 1e6;
/// Most whole rows of delay that are tried on both sides.
const MOST_ROWS: u32 = 4;
/// Shortest step from a place of the delay to others that fit, in spacings of the rows, and most of these steps.
const SHORTEST_REACH: f64 = 1e-3;
const MOST_REACHES: usize = 30;
/// Records with more readings lose a negligible part of the errors to the fit.
const LONG: usize = 20_000;

/// The directions in which a fit has taken errors away; none for a long record, which has lost a small part of them.
pub(super) fn directions(problem: &Problem, fit: &Fit) -> Vec<Vec<f64>> {
    if problem.rows() > LONG { Vec::new() } else { fit.directions() }
}

/// Standard deviations of the quantities, in the order of [`Canonical::values`].
pub(super) fn deviations(problem: &Problem, fit: &Fit, canonical: &Canonical, spectrum: &Spectrum) -> Vec<f64> {
    let parameters = fit.parameters(problem);
    let here = canonical.values(canonical).expect("the same numbers of lags and oscillations");
    let mut derivatives = vec![vec![0.0; parameters.len()]; here.len()];
    for at in 0..parameters.len() {
        let mut unit = vec![0.0; parameters.len()];
        unit[at] = 1.0;
        let influence = fit.influence(&unit);
        let step = DIFFERENCE * (spectrum.innovations * dot(&influence, &influence)).sqrt();
        if step == 0.0 || !step.is_finite() {
            continue;
        }
        let moved = |by: f64| {
            let mut moved = parameters.clone();
            moved[at] += by;
            Canonical::of(problem, &fit.with_parameters(problem, &moved)).values(canonical)
        };
        // Near a double pole only one side may have two time constants.
        let (from, to, width) = match (moved(-step), moved(step)) {
            (Some(from), Some(to)) => (from, to, 2.0 * step),
            (None, Some(to)) => (here.clone(), to, step),
            (Some(from), None) => (from, here.clone(), step),
            (None, None) => continue,
        };
        for (quantity, (from, to)) in from.iter().zip(&to).enumerate() {
            derivatives[quantity][at] = (to - from) / width;
        }
    }
    derivatives.iter().map(|derivatives| spectrum.deviation(&fit.influence(derivatives))).collect()
}

/// The interval of a positive quantity, symmetric in its logarithm; open if it spans more than [`UNKNOWN`] either way.
pub(super) fn positive(quantity: Quantity) -> Quantity {
    let factor = ((quantity.high - quantity.value) / quantity.value).exp();
    let (low, high) =
        if factor < UNKNOWN { (quantity.value / factor, quantity.value * factor) } else { (0.0, f64::INFINITY) };
    Quantity { low, high, ..quantity }
}

pub(super) fn not_negative(quantity: Quantity) -> Quantity {
    Quantity { low: quantity.low.max(0.0), ..quantity }
}

/// The delay under a voltage that is held: all places of it whose fit is not significantly worse, from end to end.
pub(super) fn places(problem: &Problem, fit: &Fit) -> Quantity {
    let neighbours = Spectrum::neighbours(&fit.residual).clamp(0.0, 0.95);
    let degrees = problem.rows().saturating_sub(fit.degrees()).max(1) as f64;
    let tolerated = fit.cost + Z * Z * fit.cost / degrees * (1.0 + neighbours) / (1.0 - neighbours);
    let (least, most) = problem.bounds.delay;
    let own = problem.place_of_delay(fit.poles.delay);
    let at = |delay: f64| Poles { delay, ..fit.poles.clone() };
    let (low, high) = if problem.bounds.whole_rows {
        let fits = |rows: f64| {
            let delay = fit.poles.delay + rows * problem.spacing;
            let inside = (least..=most).contains(&(delay + SAME_PLACE * problem.spacing));
            inside && problem.refined(at(delay), steps(problem), REFIT.1).cost <= tolerated
        };
        let reach = |sign: f64| (1..=MOST_ROWS).map(|by| sign * f64::from(by)).take_while(|rows| fits(*rows)).last();
        let [low, high] = [-1.0, 1.0].map(|sign| reach(sign).unwrap_or(0.0) * problem.spacing);
        (own.0 + low, own.1 + high)
    } else {
        let fits = |delay: f64| (least..=most).contains(&delay) && problem.fit(at(delay)).cost <= tolerated;
        (reach(problem, own.0, -1.0, fits), reach(problem, own.1, 1.0, fits))
    };
    Quantity { value: fit.poles.delay, low: low.clamp(least, most), high: high.clamp(least, most), unit: "s".into() }
}

/// The farthest delay from `edge` on that fits, by steps that double until one does not and are halved then.
fn reach(problem: &Problem, edge: f64, sign: f64, fits: impl Fn(f64) -> bool) -> f64 {
    if !edge.is_finite() {
        return edge;
    }
    let (mut far, mut step) = (edge, SHORTEST_REACH * problem.spacing);
    let mut grows = true;
    for _ in 0..MOST_REACHES {
        if fits(far + sign * step) {
            far += sign * step;
        } else {
            grows = false;
        }
        step *= if grows { 2.0 } else { 0.5 };
        if step < SHORTEST_REACH * problem.spacing {
            break;
        }
    }
    far
}

/// The least and the largest of each quantity, in the order of [`Canonical::values`], over the delays that fit if there is a
/// delay.
pub(super) fn over_places(
    problem: &Problem,
    fit: &Fit,
    canonical: &Canonical,
    delay: Option<&Quantity>,
) -> Vec<(f64, f64)> {
    let mut reach: Vec<(f64, f64)> =
        canonical.values(canonical).into_iter().flatten().map(|value| (value, value)).collect();
    let Some(Quantity { low, high, .. }) = delay.filter(|delay| delay.value > 0.0) else { return reach };
    for delay in [low + SAME_PLACE * problem.spacing, *high] {
        let there = problem.fit(Poles { delay, ..fit.poles.clone() });
        for (of, value) in reach.iter_mut().zip(Canonical::of(problem, &there).values(canonical).into_iter().flatten())
        {
            *of = (of.0.min(value), of.1.max(value));
        }
    }
    reach
}
