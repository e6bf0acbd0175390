//! Time between false alarms: counted at low thresholds, computed by importance sampling at the bank's own.

use std::ops::Range;

use model::isolation::{Verdict, bank, thresholds};
use model::{OutOfRange, Volts};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::known;
use super::run::Known;
use super::watched::Watched;

/// Alarms of springs without a fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Alarms {
    /// Number of ticks.
    pub ticks: u64,
    /// Number of alarms; each is acknowledged immediately.
    pub alarms: u64,
}

/// A bank that watches springs without a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watch {
    /// Standard deviation of the noise, in percent of 500 V.
    pub percent: f64,
    /// Relative errors of time constant, share and gain that are tolerated. Those of each spring are within it, each value as likely.
    pub tolerated: f64,
    /// Threshold of the sequential tests.
    pub nats: f64,
}

impl Watch {
    /// Counts the alarms in runs of 500 s without a fault, one for each seed.
    ///
    /// # Errors
    /// The model rejects the settings.
    pub fn count(&self, seeds: Range<u64>) -> Result<Alarms, OutOfRange> {
        let sum = |a: Alarms, b: Alarms| Alarms { ticks: a.ticks + b.ticks, alarms: a.alarms + b.alarms };
        seeds.into_par_iter().map(|seed| self.one(seed)).try_reduce(Alarms::default, |a, b| Ok(sum(a, b)))
    }

    fn one(&self, seed: u64) -> Result<Alarms, OutOfRange> {
        const TICKS: u32 = 500_000;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let Known { errors, tolerance } = known::within(self.tolerated, seed);
        let mut watched = Watched::new(self.percent, self.nats, tolerance, seed, TICKS)?;
        watched.change(&errors);
        let (mut target, mut until, mut alarms) = (Volts::ZERO, 0, 0);
        for tick in 0..TICKS {
            if tick == until {
                target = Volts::new(100.0 * f64::from(random.random_range(0..=5u32)))?;
                until += random.random_range(3000..15_000);
            }
            watched.tick(target)?;
            if watched.verdict() != Verdict::Quiet {
                alarms += 1;
                watched.acknowledge();
            }
        }
        Ok(Alarms { ticks: u64::from(TICKS), alarms })
    }
}

/// False alarms per block at a threshold, by importance sampling: the largest rate of a test over constant signatures of 0.05 to 5
/// standard deviations, times the number of tests, plus the rate of the energy's test.
///
/// A cycle of a test begins at 0 and ends when the statistic returns to 0 or reaches the threshold. Its paths are drawn as if the
/// fault were there, and weighted by the likelihood ratio (Siegmund 1976).
pub fn predicted_per_block(nats: f64, paths: u32) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let shift = |size: f64| {
        let increment = move |e: f64| size * e - 0.5 * size * size;
        rate(nats, paths, &mut normal, move |unit| unit, move |unit| unit + size, increment)
    };
    let shifts = [0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0].map(shift);
    let energy = rate(nats, paths, &mut normal, |unit| unit, |unit| 2.0 * unit, |e| 0.375 * e * e - 2f64.ln());
    2.0 * bank::SMALLEST.len() as f64 * shifts.into_iter().fold(0.0, f64::max) + energy
}

/// Rate of alarms per block of one test. `quiet` and `tilted` turn a standard normal number into an innovation without and with the
/// fault; `increment` is the log-likelihood ratio.
fn rate(
    nats: f64,
    paths: u32,
    normal: &mut impl FnMut() -> f64,
    quiet: impl Fn(f64) -> f64,
    tilted: impl Fn(f64) -> f64,
    increment: impl Fn(f64) -> f64,
) -> f64 {
    let mut blocks = 0u64;
    let mut hits = 0.0;
    for _ in 0..paths {
        let mut statistic = 0.0;
        loop {
            blocks += 1;
            statistic += increment(quiet(normal())).min(thresholds::MOST_NATS);
            if statistic <= 0.0 || statistic >= nats {
                break;
            }
        }
        let (mut statistic, mut log_ratio) = (0.0, 0.0);
        loop {
            let nats_now = increment(tilted(normal()));
            log_ratio += nats_now;
            statistic += nats_now.min(thresholds::MOST_NATS);
            if statistic >= nats {
                hits += f64::exp(-log_ratio);
                break;
            }
            if statistic <= 0.0 {
                break;
            }
        }
    }
    hits / blocks as f64
}

#[cfg(test)]
mod tests {
    use model::isolation::Tolerance;

    use super::*;

    /// Lorden's bound: the mean time to an alarm is at least exp(h) blocks, for each test.
    #[test]
    fn importance_sampling_stays_below_lordens_bound_and_falls_with_the_threshold() {
        let tests = 2.0 * bank::SMALLEST.len() as f64 + 1.0;
        let [low, high] = [6.0, 12.0].map(|nats| predicted_per_block(nats, 2000));
        assert!(low < tests * f64::exp(-6.0) && low > 0.01 * f64::exp(-6.0), "{low}");
        assert!(high < tests * f64::exp(-12.0) && high > 0.01 * f64::exp(-12.0), "{high}");
    }

    /// Without an error a quiet run; an error is an alarm unless it is tolerated.
    #[test]
    fn a_spring_within_its_tolerance_raises_no_alarm() {
        let alarms = |tolerated| Watch { percent: 0.2, tolerated, nats: 20.0 }.count(1..2).unwrap().alarms;
        assert_eq!([0.0, 0.005].map(alarms), [0, 0]);
        let errors = known::within(0.005, 1).errors;
        let mut watched = Watched::new(0.2, 20.0, Tolerance::NONE, 1, 100_000).unwrap();
        watched.change(&errors);
        for tick in 0..100_000 {
            watched.tick(Volts::new(if tick / 10_000 % 2 == 0 { 300.0 } else { 0.0 }).unwrap()).unwrap();
        }
        assert_ne!(watched.verdict(), Verdict::Quiet, "{errors:?}");
    }
}
