//! A sensor that fails for five seconds and recovers: detection time, and the effect on voltage and stiffness.

use model::feedback::Fault;
use model::{OutOfRange, Reading, Sensor, Settings};
use rayon::prelude::*;

use super::scenario::{Sample, Scenario, fresh};
use crate::ground_truth::Cause;

/// Duration of a failure, in s.
pub const FAILS_S: f64 = 5.0;

/// Kinds of sensor failures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// There are no readings.
    Absent,
    /// The last reading is repeated with its true age.
    Stale,
    /// The last value is repeated as if it were new.
    Stuck,
    /// Readings are 30 V too high.
    Shifted,
    /// Readings are alternately 30 V too high and too low.
    Shaken,
    /// Readings are 1500 V.
    Beyond,
    /// Every tenth reading is 30 V too high.
    Outliers,
}

impl Failure {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Absent, Self::Stale, Self::Stuck, Self::Shifted, Self::Shaken, Self::Beyond, Self::Outliers];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absent => "no readings",
            Self::Stale => "last reading, ageing",
            Self::Stuck => "last value, as if new",
            Self::Shifted => "30 V too high",
            Self::Shaken => "alternately 30 V too high, too low",
            Self::Beyond => "1500 V",
            Self::Outliers => "every tenth is 30 V too high",
        }
    }

    /// Fault that has to be detected; `None` for outliers, which are tolerated.
    pub fn fault(self) -> Option<Fault> {
        match self {
            Self::Absent => Some(Fault::Absent),
            Self::Stale => Some(Fault::Stale),
            Self::Stuck => Some(Fault::Stuck),
            Self::Shifted | Self::Shaken => Some(Fault::Jumping),
            Self::Beyond => Some(Fault::OutOfRange),
            Self::Outliers => None,
        }
    }

    /// Input of the controller `since` ticks after the last good reading; `last` and `read` are in V.
    fn distort(self, since: u16, last: f64, read: f64) -> Option<Reading> {
        match self {
            Self::Absent => None,
            Self::Stale => fresh(last).map(|reading| Reading { age: since, ..reading }),
            Self::Stuck => fresh(last),
            Self::Shifted => fresh(read + 30.0),
            Self::Shaken => fresh(if since.is_multiple_of(2) { read + 30.0 } else { read - 30.0 }),
            Self::Beyond => fresh(1500.0),
            Self::Outliers => fresh(if since.is_multiple_of(10) { read + 30.0 } else { read }),
        }
    }
}

/// Response of the loop to one failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailureResponse {
    /// Kind of the failure.
    pub failure: Failure,
    /// Start of the failure, in s after the start of the run.
    pub at_s: f64,
    /// Time from the first bad reading to the detection of the fault, in s; `None` if it is not detected.
    pub detected_s: Option<f64>,
    /// Largest deviation of the stiffness until detection, in V, from a run with a good sensor.
    pub moved_v: f64,
    /// Largest change of voltage between two ticks, from the failure to 5 s after its end, in V.
    pub bump_v: f64,
    /// Largest change of voltage between two ticks in the same window with a good sensor, in V.
    pub healthy_bump_v: f64,
    /// Time from the first good reading until the sensor is trusted again, in s; `None` if the failure was not
    /// detected.
    pub trusted_again_s: Option<f64>,
}

/// Responses to every failure at each of the times `at_s`, in s, with a spring that has a gain error.
///
/// # Errors
/// The model rejects the settings.
pub fn all(settings: &Settings, seed: u64, at_s: &[f64]) -> Result<Vec<FailureResponse>, OutOfRange> {
    let scenario = Scenario::of(Cause::GainError, seed);
    let healthy = scenario.run(settings, |_, read| fresh(read))?;
    let each: Vec<_> = at_s.iter().flat_map(|&at| Failure::ALL.map(|failure| (failure, at))).collect();
    each.par_iter().map(|&(failure, at)| one(&scenario, settings, &healthy, failure, at)).collect()
}

fn one(
    scenario: &Scenario,
    settings: &Settings,
    healthy: &[Sample],
    failure: Failure,
    at_s: f64,
) -> Result<FailureResponse, OutOfRange> {
    let tick = |time_s: f64| (time_s * settings.rate_hz).round() as usize;
    let (from, to) = (tick(at_s), tick(at_s + FAILS_S));
    let mut last = 0.0;
    let run = scenario.run(settings, |k, read| {
        if (from..to).contains(&k) {
            return failure.distort(u16::try_from(k + 1 - from).unwrap_or(u16::MAX), last, read);
        }
        last = read;
        fresh(read)
    })?;
    let first = |range: std::ops::Range<usize>, sensor: Sensor| {
        let found = run[range.clone()].iter().position(|sample| sample.sensor == Some(sensor));
        found.map(|ticks| (ticks as f64 + 1.0) / settings.rate_hz)
    };
    let detected_s = failure.fault().and_then(|fault| first(from..to, Sensor::Failed(fault)));
    let until = detected_s.map_or(to, |detected_s| from + tick(detected_s));
    let deviation = |(one, other): (&Sample, &Sample)| (one.truth - other.truth).abs();
    let window = from - 1..tick(at_s + 2.0 * FAILS_S);
    let bump = |samples: &[Sample]| {
        let pairs = samples[window.clone()].windows(2);
        pairs.map(|pair| (pair[1].voltage - pair[0].voltage).abs()).fold(0.0, f64::max)
    };
    Ok(FailureResponse {
        failure,
        at_s,
        detected_s,
        moved_v: run[from..until].iter().zip(&healthy[from..until]).map(deviation).fold(0.0, f64::max),
        bump_v: bump(&run),
        healthy_bump_v: bump(healthy),
        trusted_again_s: if detected_s.is_some() { first(to..run.len(), Sensor::Trusted) } else { None },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::Feedback;
    use model::feedback::fault_detection;

    #[test]
    fn failures_at_rest_are_detected_within_the_stated_times_and_do_not_move_the_stiffness() {
        let feedback = Feedback::TYPICAL;
        let settings = Settings { feedback: Some(feedback), ..Settings::PAPER };
        for it in all(&settings, 21, &[140.0]).unwrap() {
            let within = match it.failure.fault() {
                None => continue,
                Some(Fault::Stuck) => f64::from(fault_detection::IDENTICAL_AT_REST) * feedback.interval_s,
                Some(Fault::Absent | Fault::Stale) => {
                    feedback.oldest_s + f64::from(fault_detection::MISSED_INTERVALS) * feedback.interval_s + 1e-3
                }
                Some(Fault::Jumping | Fault::OutOfRange) => f64::from(fault_detection::REJECTED) * feedback.interval_s,
            };
            assert!(
                it.detected_s.is_some_and(|detected_s| detected_s < within + 1e-9),
                "{it:?}, not within {within} s"
            );
            assert!(it.moved_v < 0.2 && it.bump_v < 1.0, "{it:?}");
            assert!(it.trusted_again_s.is_some_and(|trusted_again_s| trusted_again_s < 0.1), "{it:?}");
        }
    }
}
