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
    const MOST: usize = 4;
    let neighbours = Spectrum::neighbours(&fit.residual).clamp(0.0, 0.95);
    let degrees = problem.rows().saturating_sub(fit.degrees()).max(1) as f64;
    let tolerated = Z * Z * fit.cost / degrees * (1.0 + neighbours) / (1.0 - neighbours);
    let (least, most) = problem.bounds.delay;
    let fits = |(above, up_to): (f64, f64)| {
        let poles = Poles {
            delay: if problem.bounds.whole_rows { up_to } else { 0.5 * (above.max(least) + up_to) },
            ..fit.poles.clone()
        };
        up_to >= least && up_to <= most && problem.refined(poles, steps(problem), REFIT.1).cost <= fit.cost + tolerated
    };
    let beyond = SAME_PLACE * problem.spacing;
    let own = problem.place_of_delay(fit.poles.delay);
    let reach = |next: &dyn Fn((f64, f64)) -> f64| {
        let further = std::iter::successors(Some(own), |place| Some(problem.place_of_delay(next(*place)))).skip(1);
        further.take(MOST).take_while(|place| fits(*place)).last().unwrap_or(own)
    };
    let (above, _) = reach(&|(above, _)| above);
    let (_, up_to) = reach(&|(_, up_to)| up_to + beyond);
    Quantity { value: fit.poles.delay, low: above.clamp(least, most), high: up_to.clamp(least, most), unit: "s".into() }
}

/// The least and the largest of each quantity, in the order of [`Canonical::values`], with the delays of the fit's place, which all
/// fit alike.
pub(super) fn within_place_of_delay(problem: &Problem, fit: &Fit, canonical: &Canonical) -> Vec<(f64, f64)> {
    let mut reach: Vec<(f64, f64)> =
        canonical.values(canonical).into_iter().flatten().map(|value| (value, value)).collect();
    if !problem.bounds.held {
        return reach;
    }
    let (above, up_to) = problem.place_of_delay(fit.poles.delay);
    let (least, most) = problem.bounds.delay;
    let ends = [above + SAME_PLACE * problem.spacing, up_to].map(|delay| delay.clamp(least, most));
    for delay in ends {
        let there = problem.fit(Poles { delay, ..fit.poles.clone() });
        for (of, value) in reach.iter_mut().zip(Canonical::of(problem, &there).values(canonical).into_iter().flatten())
        {
            *of = (of.0.min(value), of.1.max(value));
        }
    }
    reach
}
