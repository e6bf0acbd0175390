//! The double-precision reference that the fixed-point run of a spring is compared with.
//!
//! The plain spring's is the exact solution in continuous time, [`crate::reference`]. The extended spring and the
//! time-optimal pre-compensator, which is defined in ticks, have the loop at the controller's rate, [`crate::sampled`].

use model::estimator::Model;
use model::robust::FallBack;
use model::{Compensation, ExtendedPlant, Margin, Plant, Settings};

use serde::Serialize;

use crate::bound::{shortest_time, shortest_times_from_state};
use crate::reference::{Loop, Moment};
use crate::run::{Run, Sample};
use crate::sampled::{Controller, Robust, SampledLoop, Spring};
use crate::schedule::{Change, Schedule};

/// Initial state of the spring for the lower bound on a step's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartsFrom {
    /// The spring is settled at the old target.
    Settled,
    /// The spring is in the state to which the loop has brought it.
    Reached,
}

/// A spring whose fixed-point run can be compared with a reference.
pub trait HasReference: Model {
    /// Highest target, in V, that the reference handles like the tick does.
    fn highest_target(settings: &Settings<Self>) -> f64;

    /// Stiffness of the reference at every tick, in V, for one target per tick.
    fn reference_at_ticks(settings: &Settings<Self>, schedule: &Schedule, targets: &[f64]) -> Vec<f64>;

    /// Stiffness of the reference at increasing times in s, in V; `samples` are those of the compared loop.
    fn reference_at(
        settings: &Settings<Self>,
        schedule: &Schedule,
        run: &Run,
        samples: &[Sample],
        times_s: &[f64],
    ) -> Vec<f64>;

    /// Shortest time, in s, in which any controller completes 97 % of each change; `None` if out of reach.
    fn bounds(settings: &Settings<Self>, run: &Run, samples: &[Sample], changes: &[Change]) -> Vec<Option<f64>>;

    /// Initial state of the spring for [`HasReference::bounds`].
    fn bounds_from(settings: &Settings<Self>) -> StartsFrom;
}

impl HasReference for Plant {
    fn highest_target(settings: &Settings) -> f64 {
        settings.amplifier.max_v
    }

    fn reference_at_ticks(settings: &Settings, schedule: &Schedule, targets: &[f64]) -> Vec<f64> {
        match settings.compensation {
            Compensation::TimeOptimal(_) | Compensation::Robust(_) => sampled_at_ticks(settings, targets),
            _ => exact_at_ticks(continuous(settings), schedule, settings.rate_hz, targets),
        }
    }

    fn reference_at(
        settings: &Settings,
        schedule: &Schedule,
        run: &Run,
        samples: &[Sample],
        times_s: &[f64],
    ) -> Vec<f64> {
        match settings.compensation {
            Compensation::TimeOptimal(_) | Compensation::Robust(_) => at_last_ticks(run, samples, times_s),
            _ => reference_at(continuous(settings), schedule, times_s.iter().copied()),
        }
    }

    fn bounds(settings: &Settings, _: &Run, _: &[Sample], changes: &[Change]) -> Vec<Option<f64>> {
        let system = continuous(settings);
        changes.iter().map(|change| shortest_time(&system, change.from_v, change.to_v, 0.97)).collect()
    }

    fn bounds_from(_: &Settings) -> StartsFrom {
        StartsFrom::Settled
    }
}

/// The reference advances in ticks; between two ticks the earlier one counts.
impl HasReference for ExtendedPlant<'_> {
    /// Where the amplifier ends below its full scale, tick and reference both clamp a higher target to that end.
    fn highest_target(settings: &Settings<Self>) -> f64 {
        settings.amplifier.full_scale_v
    }

    fn reference_at_ticks(settings: &Settings<Self>, _: &Schedule, targets: &[f64]) -> Vec<f64> {
        sampled_at_ticks(settings, targets)
    }

    fn reference_at(_: &Settings<Self>, _: &Schedule, run: &Run, samples: &[Sample], times_s: &[f64]) -> Vec<f64> {
        at_last_ticks(run, samples, times_s)
    }

    fn bounds(settings: &Settings<Self>, run: &Run, samples: &[Sample], changes: &[Change]) -> Vec<Option<f64>> {
        match settings.plant.plain() {
            Some(plant) => Plant::bounds(&with_plant(settings, plant), run, samples, changes),
            None => shortest_times_from_state(&SampledLoop::from(settings), run, samples, changes, 0.97),
        }
    }

    fn bounds_from(settings: &Settings<Self>) -> StartsFrom {
        if settings.plant.plain().is_some() { StartsFrom::Settled } else { StartsFrom::Reached }
    }
}

/// The settings with another spring.
pub fn with_plant<P, Q>(settings: &Settings<P>, plant: Q) -> Settings<Q> {
    let Settings { rate_hz, compensation, amplifier, feedback, .. } = *settings;
    Settings { rate_hz, plant, compensation, amplifier, feedback }
}

/// The settings as a loop in continuous time. Without gains the target is the voltage.
pub fn continuous(settings: &Settings) -> Loop {
    Loop {
        share: settings.plant.share,
        time_constant_s: settings.plant.time_constant_s,
        gains: match settings.compensation {
            Compensation::ProportionalIntegral(gains) => Some((gains.proportional, gains.integral_per_s)),
            _ => None,
        },
        range_v: (settings.amplifier.min_v, settings.amplifier.max_v),
        slew_v_per_s: slew(settings),
    }
}

/// Stiffness of the sampled loop, in V, for one target per tick.
fn sampled_at_ticks<P: Copy + Into<Spring>>(settings: &Settings<P>, targets: &[f64]) -> Vec<f64> {
    let sampled = SampledLoop::from(settings);
    let mut state = sampled.at_rest();
    let at = |&target: &f64| {
        let voltage = sampled.drive(&mut state, target);
        sampled.apply(&mut state, voltage)
    };
    targets.iter().map(at).collect()
}

/// Reference of the last tick at or before each time.
fn at_last_ticks(run: &Run, samples: &[Sample], times_s: &[f64]) -> Vec<f64> {
    times_s.iter().map(|&time| samples[run.tick_at(time)].reference).collect()
}

/// The amplifier's slew, in V/s; infinite if it covers the full scale within a tick.
fn slew<P>(settings: &Settings<P>) -> f64 {
    let amplifier = &settings.amplifier;
    let acts = |slew: &f64| slew / settings.rate_hz < amplifier.full_scale_v;
    amplifier.slew_v_per_s.filter(acts).unwrap_or(f64::INFINITY)
}

/// The robust controller of a spring.
fn robust(spring: &Spring, margin: &Margin) -> Robust {
    let Margin { time_constant, share, gain, overshoot, .. } = *margin;
    let quick = spring.clone().times(1.0 - time_constant, 1.0 + share);
    let fall_back = FallBack::design(margin, quick.steepest_slope());
    Robust { quick, gain, overshoot, fall_back }
}

/// What the user should know about a fall back that is allowed and brings no spring within the errors of `margin` into the band earlier.
pub fn remark_on_fall_back(plant: ExtendedPlant, margin: &Margin) -> Option<String> {
    remark_if(margin, || robust(&plant.into(), margin).fall_back.is_none())
}

/// The same of a model that is not known: a remark only where the fall back has no effect with any. Of a model nothing but its largest
/// feedthrough matters.
pub fn remark_on_any_fall_back(margin: &Margin) -> Option<String> {
    let mut feedthroughs = std::iter::successors(Some(1e-3), |last| Some(1.02 * last)).take_while(|it| *it < 1.0);
    remark_if(margin, || feedthroughs.all(|feedthrough| FallBack::design(margin, feedthrough).is_none()))
}

fn remark_if(margin: &Margin, has_no_effect: impl FnOnce() -> bool) -> Option<String> {
    (margin.fall_back > 0.0 && has_no_effect()).then(|| {
        format!(
            "a fall back by {} % has no effect within these errors: it helps where the time constant is known less well than share and gain",
            (1e4 * margin.fall_back).round() / 100.0
        )
    })
}

impl<P: Copy + Into<Spring>> From<&Settings<P>> for SampledLoop {
    fn from(settings: &Settings<P>) -> Self {
        let spring: Spring = settings.plant.into();
        Self {
            sample_s: 1.0 / settings.rate_hz,
            controller: match settings.compensation {
                Compensation::None => Controller::None,
                Compensation::ProportionalIntegral(gains) => {
                    Controller::ProportionalIntegral(gains.proportional, gains.integral_per_s)
                }
                Compensation::TimeOptimal(approach) => Controller::TimeOptimal(approach.time_constant_s),
                Compensation::Robust(margin) => Controller::Robust(robust(&spring, &margin)),
            },
            spring,
            range_v: (settings.amplifier.min_v, settings.amplifier.max_v),
            slew_v_per_s: slew(settings),
        }
    }
}

/// Stiffness of the exact solution at every tick, in V.
fn exact_at_ticks(system: Loop, schedule: &Schedule, rate_hz: f64, targets: &[f64]) -> Vec<f64> {
    let mut stiffness = vec![0.0; targets.len()];
    let mut solution = system.at_rest(1.0 / rate_hz);
    let time = |tick: usize| schedule.start_s() + tick as f64 / rate_hz;
    // A run of ticks whose targets are linear, without a jump at the next tick, is one call of the solution.
    let mut reader = schedule.reader();
    let mut straight = |tick: usize| {
        reader.at(time(tick));
        let mut stretches = reader.clone().stretches(time(tick), time(tick + 1));
        let first = stretches.next();
        stretches.next().is_none() && first.is_some_and(|first| (first.to_v() - targets[tick + 1]).abs() < 1e-9)
    };
    let mut moments = vec![Moment::default(); targets.len()];
    // This reader advances with the loop; searching from the start each time would take quadratic time.
    let mut behind = schedule.reader();
    let mut tick = 0;
    while tick < targets.len() {
        solution.jump(targets[tick]);
        stiffness[tick] = solution.moment().stiffness;
        let end = (tick..targets.len() - 1).find(|&tick| !straight(tick)).unwrap_or(targets.len() - 1);
        solution.run(&targets[tick..=end], &mut moments[tick..end]);
        for at in tick..end {
            stiffness[at + 1] = moments[at].stiffness;
        }
        behind.at(time(end));
        for stretch in behind.clone().stretches(time(end), time(end + 1)) {
            solution.advance(stretch.from_v, stretch.slope, stretch.duration_s);
        }
        tick = end + 1;
    }
    stiffness
}

/// Stiffness of the exact solution at increasing times (s) of a schedule, in V.
pub fn reference_at(system: Loop, schedule: &Schedule, times_s: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut solution = system.at_rest(1e-3);
    let mut now = schedule.start_s();
    let mut reader = schedule.reader();
    let at = |time: f64| {
        let next = time.clamp(now, schedule.end_s());
        for stretch in reader.clone().stretches(now, next) {
            solution.advance(stretch.from_v, stretch.slope, stretch.duration_s);
        }
        now = next;
        solution.jump(reader.at(next));
        solution.moment().stiffness
    };
    times_s.into_iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant_file::PlantFile;

    /// What has no effect with any model has none with each, and what has none with each of many has none with any.
    #[test]
    fn a_remark_on_any_model_is_one_on_each() {
        let (mut on_any, mut on_none) = (0, 0);
        for (tau, share, gain) in (0..6).flat_map(|a| (0..6).flat_map(move |b| (0..3).map(move |c| (a, b, c)))) {
            let [time_constant, share, gain] =
                [(tau, 0.02), (share, 0.02), (gain, 0.01)].map(|(n, by)| by * f64::from(n));
            let margin = Margin { time_constant, share, gain, overshoot: 0.02, fall_back: 0.25 };
            let of = |percent: i32| Plant { share: f64::from(percent) / 100.0, time_constant_s: 5.5 };
            let each = (1..70).all(|it| remark_on_fall_back(PlantFile::from(of(it)).extended(), &margin).is_some());
            assert_eq!(remark_on_any_fall_back(&margin).is_some(), each, "{margin:?}");
            assert_eq!(remark_on_any_fall_back(&Margin { fall_back: 0.0, ..margin }), None);
            *if each { &mut on_any } else { &mut on_none } += 1;
        }
        assert!(on_any > 30 && on_none > 30, "{on_any} {on_none}");
    }
}
