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

const _: () = assert!(largest_of_interest() <= 1.0, "the whitened signature of the smallest size fits 32 bits");

const fn largest_of_interest() -> f64 {
    let (mut largest, mut index) = (0.0, 0);
    while index < SMALLEST.len() {
        if SMALLEST[index].1 > largest {
            largest = SMALLEST[index].1;
        }
        index += 1;
    }
    largest
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
