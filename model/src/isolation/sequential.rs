//! The sequential tests, which raise the alarm: a CUSUM for each sign of each tested vector, and one for the energy.
//!
//! With the whitened signature `s` of the smallest size of interest and the innovation `e`, both in standard deviations, a block
//! adds the log-likelihood ratio `s e - s^2/2` to the statistic of a positive size, and `-s e - s^2/2` to that of a negative one; a
//! statistic is never negative (Page 1954). Without a fault its mean time to the threshold `h` is at least `exp(h)` blocks
//! (Lorden 1971). The energy is tested against four times the variance: `3/8 e^2 - ln 2`.
//!
//! An error of the model within its tolerance moves the mean of `e` by at most `m`, the sum of the magnitudes of its whitened
//! signatures. Each block therefore adds `|s| m` less, and the energy's test sees `|e| - m`: the bound of the mean time holds for every
//! spring within the tolerance.

use super::bank::{DOUBTFUL, SMALLEST, VECTORS};
use super::products::{GROUP, Whitened};
use super::{Config, LARGEST, SLOTS, thresholds};
use crate::units::saturated_to_32;

/// Number of ticks that the tests of a block take.
pub(super) const STEPS: u32 = SMALLEST.len().div_ceil(EACH) as u32;
/// Number of tests that one tick advances.
const EACH: usize = 3;

const ONE: f64 = 1_048_576.0;
/// Least that one block adds, in nats with 20 fraction bits.
const LEAST: i32 = -20 << 20;
/// Most that one block adds, in nats with 20 fraction bits.
const MOST: i32 = (thresholds::MOST_NATS * ONE) as i32;
const LN_2: i64 = (core::f64::consts::LN_2 * ONE) as i64;

/// The tested vectors.
static TESTED: [u8; SMALLEST.len()] = tested();

const fn tested() -> [u8; SMALLEST.len()] {
    let (mut vectors, mut index) = ([0; SMALLEST.len()], 0);
    while index < SMALLEST.len() {
        assert!(SMALLEST[index].1 <= 1.0, "the whitened signature of the smallest size fits 32 bits");
        vectors[index] = SMALLEST[index].0 as u8;
        index += 1;
    }
    vectors
}

/// Statistics of the tests, in nats with 20 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tests {
    upward: [i32; SMALLEST.len()],
    downward: [i32; SMALLEST.len()],
    energy: i32,
    /// Largest mean of the present block's innovation within the tolerance of the model, in standard deviations with 10 fraction bits.
    pub(super) doubt: i32,
    /// Largest statistic of the present block.
    pub(super) highest: i32,
}

/// Adds a bounded increment to a statistic.
#[inline(always)]
fn added(statistic: i32, nats: i64) -> i32 {
    if statistic == 0 && nats <= 0 {
        return 0;
    }
    statistic.saturating_add(saturated_to_32(nats).clamp(LEAST, MOST)).max(0)
}

/// Sum of the magnitudes of the doubtful vectors times their sizes, in standard deviations with 10 fraction bits.
fn doubt(sizes: &[i32; DOUBTFUL.len()], whitened: &Whitened, block: usize) -> i32 {
    let magnitude = |(vector, size): (&usize, &i32)| {
        (i64::from(whitened[vector & (SLOTS - 1)][block]).abs() * i64::from(*size)) >> 28
    };
    DOUBTFUL.iter().zip(sizes).map(magnitude).sum::<i64>().min(LARGEST.into()) as i32
}

impl Tests {
    /// Before the first block.
    pub(super) const NEW: Self =
        Self { upward: [0; SMALLEST.len()], downward: [0; SMALLEST.len()], energy: 0, doubt: 0, highest: 0 };

    /// Advances the energy's test.
    #[inline(never)]
    fn begin(&mut self, config: &Config, whitened: &Whitened, block: usize) {
        self.doubt = config.doubt.map_or(0, |sizes| doubt(&sizes, whitened, block));
        let beyond = i64::from(whitened[VECTORS][block].saturating_abs().saturating_sub(self.doubt).max(0));
        self.energy = added(self.energy, ((3 * beyond * beyond) >> 3) - LN_2);
        self.highest = self.energy;
    }

    /// Advances some of the tests by a block of the group; the whitened values have 10 fraction bits.
    #[inline(never)]
    pub(super) fn step(&mut self, config: &Config, step: u32, whitened: &Whitened, block: usize) {
        let block = block & (GROUP - 1);
        if step == 0 {
            self.begin(config, whitened, block);
        }
        let (innovation, doubt, mut highest) = (whitened[VECTORS][block], self.doubt as u32, self.highest);
        let first = step as usize * EACH;
        for test in first..(first + EACH).min(TESTED.len()) {
            let (upward, downward) = (&mut self.upward[test], &mut self.downward[test]);
            let value = whitened[usize::from(TESTED[test]) & (SLOTS - 1)][block];
            // 16 fraction bits.
            let shift = ((i64::from(value) * i64::from(config.smallest[test])) >> 22) as i32;
            let wide = |other: i32| i64::from(shift) * i64::from(other);
            let along = wide(innovation) >> 6;
            let less = (wide(shift) >> 13) + ((i64::from(shift.unsigned_abs()) * i64::from(doubt)) >> 6);
            *upward = added(*upward, along - less);
            *downward = added(*downward, -along - less);
            highest = highest.max(*upward).max(*downward);
        }
        self.highest = highest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isolation::bank::GAIN;
    use crate::isolation::{Settings, Tolerance};
    use crate::units::SampleTime;
    use crate::validated::Validate;

    /// Returns the largest statistic in nats after blocks with these innovations, where the gain's vector is `signature`: both in standard
    /// deviations. The model's gain is known to within `gain`.
    fn highest(gain: f64, signature: i32, innovations: &[i32]) -> f64 {
        let settings = Settings { tolerance: Tolerance { gain, ..Tolerance::NONE }, ..Settings::PAPER };
        let config = settings.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize();
        let (mut tests, mut whitened) = (Tests::NEW, [[0; GROUP]; SLOTS]);
        for innovation in innovations {
            whitened[GAIN][0] = signature << 10;
            whitened[VECTORS][0] = innovation << 10;
            (0..STEPS).for_each(|step| tests.step(&config, step, &whitened, 0));
        }
        f64::from(tests.highest) / ONE
    }

    /// A statistic goes up and down by the log-likelihood ratios of the documentation, by at most 5 nats up, and never below 0. What an
    /// error of the model within its tolerance can add counts for no test.
    #[test]
    fn a_block_adds_its_log_likelihood_ratio() {
        let ln_2 = core::f64::consts::LN_2;
        for (gain, signature, innovations, nats) in [
            (0.0, 0, &[2, 2, -2][..], 3.0 * (1.5 - ln_2)),
            (0.0, 0, &[2, 2, -2, 1], 3.0 * (1.5 - ln_2) + 0.375 - ln_2),
            (0.0, 0, &[100], 5.0),
            (0.0, 0, &[1, 1], 0.0),
            // 400 deviations of 0.5 %, the smallest size of interest: s = 2.
            (0.0, 400, &[3], 2.0 * 3.0 - 2.0),
            (0.0, 400, &[-3], 2.0 * 3.0 - 2.0),
            // 400 deviations of 0.2 %: m = 0.8.
            (0.002, 400, &[3], 2.0 * 3.0 - 2.0 - 2.0 * 0.8),
            (0.002, 400, &[-3], 2.0 * 3.0 - 2.0 - 2.0 * 0.8),
            (0.25, 400, &[100, -100], 0.0),
        ] {
            let found = highest(gain, signature, innovations);
            assert!((found - nats).abs() < 0.01, "{gain} {signature} {innovations:?}: {found}, expected {nats}");
        }
    }
}
