//! A record of a spring with an effect that the controller's model does not have, made by simulators that share no formula with
//! the diagnosis.

use anyhow::{Context, Result};
use ground_truth::physics::Tau;
use ground_truth::spring::Spring;
use ground_truth::truth::Truth;
use ground_truth::{Cause, Effect, LabelledRecord, Noise, Schedule};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};
use simulation::bad_input;
use simulation::bad_input::check;

use crate::control::{self, Control};
use crate::curve::Curve;

/// An effect, and the loop whose voltage drives the spring.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hidden {
    /// The loop. Its spring is the one that has the effect in addition.
    pub control: Control,
    /// Name of the effect, or `none`.
    pub effect: String,
    /// Size of the effect, 0 to 1; 1 is clearly visible.
    pub size: f64,
    /// Standard deviation of the noise on the readings, in percent of 500 V.
    pub noise_percent: f64,
    /// Number from which the effect's values and the noise are drawn.
    pub seed: u32,
    /// Number of rows of the record.
    pub rows: usize,
}

/// The record.
#[derive(Debug, Serialize)]
pub struct Made {
    /// The record as CSV, which `vsj diagnose` reads.
    csv: String,
    /// What is hidden, with the true values of its parameters.
    truth: Vec<Truth>,
    /// True stiffness at the sensor over the time in s, without noise, in V.
    stiffness: Curve,
}

/// Numbers of rows that a record may have.
const ROWS: [usize; 2] = [50, 20_000];
/// Most noise on readings, in percent of 500 V.
const MOST_NOISE: f64 = 10.0;

/// Names of the effects.
pub fn effects() -> Vec<&'static str> {
    Cause::ALL.iter().map(|cause| cause.name()).collect()
}

/// Makes the record: the voltages that the loop applies, each held for the time between two rows, on a spring with the effect.
///
/// # Errors
/// [`simulation::BadInput`] for values out of range, a spring with more than a share and a time constant, and the errors of
/// [`control::run`].
pub fn record(hidden: &Hidden) -> Result<Made> {
    let Hidden { control, effect, size, noise_percent, seed, rows } = hidden;
    check("size", *size, 0.0..=1.0, "")?;
    check("noise_percent", *noise_percent, 0.0..=MOST_NOISE, "%")?;
    if !(ROWS[0]..=ROWS[1]).contains(rows) {
        bad_input!("rows = {rows} is not allowed: expected {} to {}", ROWS[0], ROWS[1]);
    }
    let file = control::spring(&control.plant)?;
    let Some(plant) = file.extended().plain() else {
        bad_input!(
            "the spring has more than a share and a time constant; expected these alone, the effect is added to them"
        );
    };
    let schedule = sampled(control, *rows)?;
    let noise = Noise::white(*noise_percent);
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(*seed));
    let effects = match (effect.as_str(), Cause::named(effect)) {
        ("none", _) => Vec::new(),
        (_, Some(cause)) => vec![Effect::draw(&mut random, cause, 0, &schedule, noise.sigma_v).at(*size)],
        (other, None) => bad_input!("effect {other}: expected none, {}", self::effects().join(", ")),
    };
    let with = Spring::with(&effects);
    let usual = Spring::default();
    let tau = Tau::Linear { low_s: plant.time_constant_s, high_s: plant.time_constant_s };
    let spring = Spring {
        share: if with.share == usual.share { plant.share } else { with.share },
        tau: if with.tau == usual.tau { tau } else { with.tau },
        ..with
    };
    let made = LabelledRecord::of(&spring, schedule, effects, noise, u64::from(*seed));
    let (times, expected) = (&made.schedule.time_s, &made.readings.expected);
    Ok(Made {
        csv: made.csv(),
        truth: made.truths(),
        stiffness: Curve::new(times.len(), |row| times[row], |row| expected[row]),
    })
}

/// The voltages that a loop applies, at even times.
fn sampled(control: &Control, rows: usize) -> Result<Schedule> {
    let run = control::answer(control, &control::spring(&control.plant)?)?.run;
    let samples = control::chosen(control, &run);
    let stride = samples.len().div_ceil(rows).max(1);
    let ticks = (0..samples.len()).step_by(stride);
    let (time_s, voltage_v): (Vec<f64>, Vec<f64>) =
        ticks.map(|tick| (run.time_s(tick), samples[tick].applied.to_f64())).unzip();
    let (first, last) = time_s.first().zip(time_s.last()).context("a run has ticks")?;
    if last <= first {
        bad_input!("the target ends after one row; expected a longer one");
    }
    Ok(Schedule { time_s, voltage_v })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hidden(target: &str, effect: &str) -> Hidden {
        let control = Control {
            plant: "paper".to_owned(),
            target: target.to_owned(),
            linear: false,
            controller: "none".to_owned(),
            limit_v: 700.0,
            slew_v_per_s: None,
            kp: 4.0,
            ki: 1.35,
            approach_s: 0.0,
            known: None,
            rate_hz: 100.0,
        };
        Hidden { control, effect: effect.to_owned(), size: 1.0, noise_percent: 0.2, seed: 1, rows: 1000 }
    }

    #[test]
    fn every_effect_makes_a_record_of_any_target() {
        let flat = "time_s,voltage_v\n0,0\n9,0\n";
        let short = "time_s,voltage_v\n0,0\n0.01,700\n0.05,700\n";
        let long = "time_s,voltage_v\n5,0\n600,700\n1200,0\n";
        for target in ["stair", "step", flat, short, long] {
            for effect in effects().into_iter().chain(["none"]) {
                let made = record(&hidden(target, effect)).unwrap();
                let rows = made.csv.lines().count() - 1;
                assert!((2..=1000).contains(&rows) && !made.csv.contains("NaN"), "{effect}: {rows} rows");
                assert_eq!(
                    made.truth.first().map(|truth| truth.cause.name()),
                    Some(effect).filter(|&name| name != "none")
                );
            }
        }
    }

    #[test]
    fn values_that_make_no_record_are_refused() {
        let usual = hidden("stair", "drift");
        let spring = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5\n[leakage]\nshare = 0.1\ntau_s = 20\n";
        let leaking = Control { plant: spring.to_owned(), ..usual.control.clone() };
        for (wrong, what) in [
            (Hidden { size: f64::NAN, ..usual.clone() }, "size = NaN"),
            (Hidden { noise_percent: -1.0, ..usual.clone() }, "noise_percent = -1"),
            (Hidden { rows: 3, ..usual.clone() }, "rows = 3"),
            (Hidden { effect: "rust".to_owned(), ..usual.clone() }, "effect rust: expected none, gain-error"),
            (Hidden { control: leaking, ..usual.clone() }, "the spring has more than"),
        ] {
            let error = record(&wrong).unwrap_err().to_string();
            assert!(error.starts_with(what), "{error}");
        }
    }

    /// The spring's own time constant has effect.
    #[test]
    fn an_effect_is_added_to_the_spring_that_was_asked_for() {
        let usual = hidden("step", "none");
        let spring = "schema = 1\n[relaxation]\nshare = 0.3\ntau_s = 1\n";
        let faster = Hidden { control: Control { plant: spring.to_owned(), ..usual.control.clone() }, ..usual.clone() };
        let after_step = |hidden: &Hidden| {
            let curve = record(hidden).unwrap().stiffness;
            curve.y[curve.x.iter().position(|&time| time >= 21.0).unwrap()]
        };
        let (slow, fast) = (after_step(&usual), after_step(&faster));
        // A second after a step of 100 V.
        let expected = |share: f64, tau: f64| 100.0 * (1.0 - (1.0 - share) * f64::exp(-1.0 / tau));
        assert!((slow - expected(1.0 / 11.0, 5.5)).abs() < 2.0, "{slow}");
        assert!((fast - expected(0.3, 1.0)).abs() < 2.0, "{fast}");
    }
}
