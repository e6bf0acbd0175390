//! What the controllers keep of their performance on a spring that is known only to within errors.
//!
//! - *nominal*: on the model's own spring.
//! - *worst at 95 %*: not exceeded on 95 % of the springs that the intervals allow. Each parameter is drawn from a normal distribution
//!   whose 95 % interval is the error, independently of the others.
//! - *guaranteed*: the largest on the nominal spring and on those at all ends and middles of the intervals.
//!
//! t97, the time after which a step stays above 97 %, and the overshoot are each the largest of the ideal stair's steps. There is no sensor, so
//! that the voltages are those of the nominal run.

use anyhow::Result;
use model::{Compensation, Margin};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use crate::control_loop::{Controller, gains};
use crate::has_reference::remark_on_fall_back;
use crate::robust_bound::{Allowed, Needed, RobustBound};
use crate::spring_error::{DifferingSpring, SpringError};
use crate::tune::Specification;
use crate::tune::trade::with_errors;
use crate::tune::worst::Worst;

/// Springs that are drawn.
const DRAWN: usize = 200;
/// Part of them on which *worst at 95 %* is not exceeded.
const PART: f64 = 0.95;
/// Half the width of a 95 % interval, in standard deviations.
const DEVIATIONS: f64 = 1.96;

/// What is known of the spring, and what is required.
#[derive(Clone, Copy, Debug)]
pub struct Knowledge {
    /// Largest relative errors of the parameters, both ways, 0 or more: half the widths of 95 % intervals.
    pub spring_error: SpringError,
    /// Time in which all steps have to be done, in s.
    pub within_s: f64,
    /// Part of a step by which the robust controller may let all springs fall back for a while.
    pub fall_back: f64,
}

/// Performance of the controllers within the errors, and what a time requires.
#[derive(Clone, Debug, Serialize)]
pub struct Uncertainty {
    /// Relative errors to within which the spring is known.
    pub spring_error: SpringError,
    /// The report's controller, the tuned time-optimal one, and the robust one for these errors.
    pub controllers: Vec<Within>,
    /// Time in which all steps have to be done, in s.
    pub within_s: f64,
    /// Largest overshoot allowed, in percent of the step.
    pub overshoot_percent: f64,
    /// How well each parameter alone has to be known for it, whatever the controller; `None` for a spring that is not linear.
    pub needed: Option<Needed>,
    /// What the user should know about the robust controller, one line each.
    #[serde(skip)]
    pub remarks: Vec<String>,
}

/// A controller on a spring that is known to within errors.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Within {
    /// Name of the controller: `paper`, `fast` or `robust`.
    pub controller: &'static str,
    /// On the model's own spring.
    pub nominal: Worst,
    /// Not exceeded on 95 % of the springs.
    pub worst_95: Worst,
    /// Not exceeded at any end or middle of the intervals.
    pub guaranteed: Worst,
}

/// Evaluates the controllers; `fast` is the tuned time-optimal one.
///
/// # Errors
/// [`crate::BadInput`] for errors of time constant and gain beyond those that the robust controller accepts, and for springs that cannot be.
pub(super) fn evaluate(
    specification: &Specification<'_>,
    fast: Compensation,
    knowledge: &Knowledge,
) -> Result<Uncertainty> {
    let Specification { file, amplifier, overshoot_percent, .. } = *specification;
    let Knowledge { spring_error, within_s, fall_back } = *knowledge;
    let SpringError { time_constant, gain, .. } = spring_error;
    let overshoot = overshoot_percent / 100.0;
    let (share, mut remarks) = share_margin(file.relaxation.share, &spring_error);
    let ends = spring_error.ends(&[-1.0, 0.0, 1.0]);
    ends.iter().try_for_each(|error| DifferingSpring::new(file, error).check())?;
    let drawn = drawn(&spring_error);
    let margin = Margin { time_constant, share, gain, overshoot, fall_back };
    remarks.extend(remark_on_fall_back(file.extended(), &margin));
    let gains = gains([None; 2], Controller::Paper, file, specification.rate_hz)?;
    let compensations = [
        ("paper", Compensation::ProportionalIntegral(gains)),
        ("fast", fast),
        ("robust", Compensation::Robust(margin)),
    ];
    let controllers = compensations.into_iter().map(|(controller, compensation)| {
        let run = specification.run(compensation)?;
        let on = |errors: &[SpringError]| errors.iter().map(|error| with_errors(specification, error, &run)).collect();
        let (at_ends, at_drawn): (Vec<Worst>, Vec<Worst>) = (on(&ends), on(&drawn));
        Ok(Within {
            controller,
            nominal: with_errors(specification, &SpringError::default(), &run),
            worst_95: quantile(&at_drawn),
            guaranteed: Worst::of(at_ends.into_iter()),
        })
    });
    let controllers = controllers.collect::<Result<_>>()?;
    let bound = RobustBound::new(file, Allowed { amplifier, overshoot }).ok();
    let needed = bound.map(|bound| Needed::of(&bound, within_s, file.stair_step_v(amplifier)));
    Ok(Uncertainty { spring_error, controllers, within_s, overshoot_percent, needed, remarks })
}

/// The robust controller's margin for the share, and a remark if it is less than the error. The controller takes it relative to the share,
/// which says little of a small one.
fn share_margin(share: f64, spring_error: &SpringError) -> (f64, Vec<String>) {
    let of_response = spring_error.share * share + spring_error.share_of_response;
    let relative = spring_error.share_of_response / share;
    let known = if relative.is_nan() { spring_error.share } else { spring_error.share + relative };
    let margin = known.min(Margin::LARGEST_ERROR);
    let remark = (known > margin).then(|| {
        let [margin, share, of_response] = [100.0 * margin, 100.0 * share, 100.0 * of_response];
        format!(
            "the robust controller's margin is {margin:.0} % of a share of {share:.3} %; its error is {of_response:.3} % of the response"
        )
    });
    (margin, remark.into_iter().collect())
}

/// Errors of springs that are drawn from the intervals, the same in each call.
fn drawn(error: &SpringError) -> Vec<SpringError> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let SpringError { share, time_constant, gain, share_of_response } = *error;
    let mut draw = || {
        let [of_share, of_time_constant, of_gain] =
            std::array::from_fn(|_| -> f64 { StandardNormal.sample(&mut random) });
        let part = |size: f64, deviations: f64| size / DEVIATIONS * deviations;
        SpringError {
            share: part(share, of_share),
            time_constant: part(time_constant, of_time_constant),
            gain: part(gain, of_gain),
            share_of_response: part(share_of_response, of_share),
        }
    };
    (0..DRAWN).map(|_| draw()).collect()
}

/// What a part of the responses does not exceed; a t97 that is not reached is the largest of all.
fn quantile(each: &[Worst]) -> Worst {
    let at = (PART * each.len() as f64).ceil() as usize - 1;
    let of = |value: fn(&Worst) -> f64| {
        let mut values: Vec<f64> = each.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[at]
    };
    let time = |value: fn(&Worst) -> f64| Some(of(value)).filter(|time_s| time_s.is_finite());
    Worst {
        t97_s: time(|worst| worst.t97_s.unwrap_or(f64::INFINITY)),
        kept97_s: time(|worst| worst.kept97_s.unwrap_or(f64::INFINITY)),
        overshoot_percent: of(|worst| worst.overshoot_percent),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant_file::PlantFile;
    use crate::spring_error::Parameter;
    use model::{Amplifier, Approach, Plant};

    #[test]
    fn the_quantile_leaves_a_twentieth_above_it() {
        let worst = |t97_s: f64| Worst {
            t97_s: (t97_s < 97.5).then_some(t97_s),
            kept97_s: (t97_s < 90.0).then_some(2.0 * t97_s),
            overshoot_percent: 100.0 - t97_s,
        };
        let each: Vec<Worst> = (1..=100).map(|of| worst(f64::from(of))).collect();
        assert_eq!(quantile(&each), Worst { t97_s: Some(95.0), kept97_s: None, overshoot_percent: 94.0 });
        assert_eq!(quantile(&[worst(98.0); 20]).t97_s, None);
    }

    /// A share that is off by 10 %: the fast controller overshoots, the robust one does not, and pays with its time.
    #[test]
    fn the_robust_controller_keeps_its_overshoot_within_the_errors() {
        let file = PlantFile::from(Plant::PAPER);
        let specification = Specification {
            file: &file,
            amplifier: Amplifier::up_to(1000.0),
            rate_hz: 1000.0,
            overshoot_percent: 2.0,
            knowledge: None,
        };
        let spring_error = SpringError::default().with(Parameter::Share, 0.1);
        let fast = Compensation::TimeOptimal(Approach::DEAD_BEAT);
        let found = evaluate(&specification, fast, &Knowledge { spring_error, within_s: 0.6, fall_back: 0.0 }).unwrap();
        let [_, fast, robust] = found.controllers[..] else { panic!("three controllers") };
        assert!(fast.guaranteed.overshoot_percent > 5.0, "{fast:?}");
        assert!(robust.guaranteed.overshoot_percent < 2.1, "{robust:?}");
        for within in found.controllers {
            let Within { nominal, worst_95, guaranteed, .. } = within;
            assert!(nominal.overshoot_percent <= guaranteed.overshoot_percent, "{within:?}");
            assert!(nominal.t97_s <= guaranteed.t97_s && worst_95.t97_s <= guaranteed.t97_s, "{within:?}");
        }
        let share = found.needed.and_then(|needed| needed.share).unwrap();
        assert!((0.05..0.08).contains(&share), "{share}");
    }

    /// The margin is relative to the share, and the error of a share near 0 is not.
    #[test]
    fn a_small_share_gets_the_largest_margin_and_a_remark() {
        let of_response = |share_of_response| SpringError { share_of_response, ..SpringError::default() };
        assert_eq!(share_margin(0.1, &SpringError { share: 0.2, ..SpringError::default() }), (0.2, Vec::new()));
        let (margin, remarks) = share_margin(0.1, &of_response(0.01));
        assert!((margin - 0.1).abs() < 1e-12 && remarks.is_empty(), "{margin} {remarks:?}");
        for share in [0.0, 0.001] {
            let (margin, remarks) = share_margin(share, &of_response(0.05));
            assert!(margin == Margin::LARGEST_ERROR && remarks[0].ends_with("5.000 % of the response"), "{remarks:?}");
        }
    }
}
