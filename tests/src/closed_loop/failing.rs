//! A sensor that fails for five seconds and comes back: how soon it is seen, and what it does to voltage and stiffness.

use model::feedback::Fault;
use model::{OutOfRange, Reading, Sensor, Settings};
use rayon::prelude::*;

use super::run::{Sample, Scene, fresh};
use crate::hidden::Cause;

/// How long it fails, in s.
pub const FAILS_S: f64 = 5.0;

/// How a sensor fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// No readings.
    Absent,
    /// The last sample again and again, as old as it is.
    Stale,
    /// The last value again and again, as if it were new.
    Stuck,
    /// Readings 30 V too high.
    Shifted,
    /// Readings 30 V too high and too low in turn.
    Shaken,
    /// Readings of 1500 V.
    Beyond,
    /// One reading in ten 30 V too high.
    Outliers,
}

impl Failure {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Absent, Self::Stale, Self::Stuck, Self::Shifted, Self::Shaken, Self::Beyond, Self::Outliers];

    /// For tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absent => "no readings",
            Self::Stale => "the last sample, ageing",
            Self::Stuck => "the last value, as if new",
            Self::Shifted => "30 V too high",
            Self::Shaken => "30 V too high, too low in turn",
            Self::Beyond => "1500 V",
            Self::Outliers => "every tenth 30 V too high",
        }
    }

    /// What has to be seen; nothing of outliers.
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

    /// What the controller is told `since` ticks after the last good reading.
    fn tell(self, since: u16, last: f64, read: f64) -> Option<Reading> {
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

/// What a failure did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consequence {
    /// How it failed.
    pub failure: Failure,
    /// When, in s after the start.
    pub at_s: f64,
    /// From the first bad reading to the fault, in s.
    pub seen_s: Option<f64>,
    /// What it had moved the stiffness by then, in V.
    pub moved_v: f64,
    /// The largest change of voltage between two ticks, from the failure to 5 s after its end, in V.
    pub bump_v: f64,
    /// The same of a sensor that doesn't fail.
    pub healthy_bump_v: f64,
    /// From the first good reading to trust, in s.
    pub back_s: Option<f64>,
}

/// Of every failure at these times, beside a spring with a wrong gain.
///
/// # Errors
/// Settings that the model refuses.
pub fn all(settings: &Settings, seed: u64, at_s: &[f64]) -> Result<Vec<Consequence>, OutOfRange> {
    let scene = Scene::of(Cause::GainError, seed);
    let healthy = scene.run(settings, |_, read| fresh(read))?;
    let each: Vec<_> = at_s.iter().flat_map(|&at| Failure::ALL.map(|failure| (failure, at))).collect();
    each.par_iter().map(|&(failure, at)| one(&scene, settings, &healthy, failure, at)).collect()
}

fn one(
    scene: &Scene,
    settings: &Settings,
    healthy: &[Sample],
    failure: Failure,
    at_s: f64,
) -> Result<Consequence, OutOfRange> {
    let tick = |time_s: f64| (time_s * settings.rate_hz).round() as usize;
    let (from, to) = (tick(at_s), tick(at_s + FAILS_S));
    let mut last = 0.0;
    let run = scene.run(settings, |k, read| {
        if (from..to).contains(&k) {
            return failure.tell(u16::try_from(k + 1 - from).unwrap_or(u16::MAX), last, read);
        }
        last = read;
        fresh(read)
    })?;
    let first = |range: std::ops::Range<usize>, sensor: Sensor| {
        let found = run[range.clone()].iter().position(|sample| sample.sensor == Some(sensor));
        found.map(|ticks| (ticks as f64 + 1.0) / settings.rate_hz)
    };
    let seen_s = failure.fault().and_then(|fault| first(from..to, Sensor::Failed(fault)));
    let until = seen_s.map_or(to, |seen_s| from + tick(seen_s));
    let apart = |(one, other): (&Sample, &Sample)| (one.truth - other.truth).abs();
    let window = from - 1..tick(at_s + 2.0 * FAILS_S);
    let bump = |samples: &[Sample]| {
        let pairs = samples[window.clone()].windows(2);
        pairs.map(|pair| (pair[1].voltage - pair[0].voltage).abs()).fold(0.0, f64::max)
    };
    Ok(Consequence {
        failure,
        at_s,
        seen_s,
        moved_v: run[from..until].iter().zip(&healthy[from..until]).map(apart).fold(0.0, f64::max),
        bump_v: bump(&run),
        healthy_bump_v: bump(healthy),
        back_s: if seen_s.is_some() { first(to..run.len(), Sensor::Trusted) } else { None },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::Feedback;
    use model::feedback::fault_detection;

    /// At rest, noise and all: within the stated times, and without moving the stiffness.
    #[test]
    fn failures_at_rest_are_seen_in_time() {
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
            assert!(it.seen_s.is_some_and(|seen_s| seen_s < within + 1e-9), "{it:?}, not within {within} s");
            assert!(it.moved_v < 0.2 && it.bump_v < 1.0, "{it:?}");
            assert!(it.back_s.is_some_and(|back_s| back_s < 0.1), "{it:?}");
        }
    }
}
