//! The sequential tests, which raise the alarm: a CUSUM for each sign of each tested vector, and one for the energy.
//!
//! With the whitened signature `s` of the smallest size of interest and the innovation `e`, both in standard deviations, a block
//! adds the log-likelihood ratio `s e - s^2/2` to the statistic of a positive size, and `-s e - s^2/2` to that of a negative one; a
//! statistic is never negative (Page 1954). Without a fault its mean time to the threshold `h` is at least `exp(h)` blocks
//! (Lorden 1971). The energy is tested against four times the variance: `3/8 e^2 - ln 2`.

use super::bank::{SMALLEST, VECTORS};
use super::{Config, SLOTS, thresholds};
use crate::units::saturated_to_32;

/// Number of ticks that the tests of a block take.
pub(super) const STEPS: u32 = SMALLEST.len() as u32;

const ONE: f64 = 1_048_576.0;
/// Least that one block adds, in nats with 20 fraction bits.
const LEAST: i64 = -20 << 20;
/// Most that one block adds, in nats with 20 fraction bits.
const MOST: i64 = (thresholds::MOST_NATS * ONE) as i64;
const LN_2: i64 = (core::f64::consts::LN_2 * ONE) as i64;

/// Statistics of the tests, in nats with 20 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tests {
    upward: [i32; SMALLEST.len()],
    downward: [i32; SMALLEST.len()],
    energy: i32,
    /// Largest statistic of the present block.
    pub(super) highest: i32,
}

/// Adds a bounded increment to a statistic.
#[inline(always)]
fn added(statistic: i32, nats: i64) -> i32 {
    statistic.saturating_add(nats.clamp(LEAST, MOST) as i32).max(0)
}

impl Tests {
    /// Before the first block.
    pub(super) const NEW: Self =
        Self { upward: [0; SMALLEST.len()], downward: [0; SMALLEST.len()], energy: 0, highest: 0 };

    /// Advances one test; the whitened values have 10 fraction bits.
    #[inline(never)]
    pub(super) fn step(&mut self, config: &Config, step: u32, whitened: &[i32; SLOTS]) {
        let innovation = i64::from(whitened[VECTORS]);
        if step == 0 {
            self.energy = added(self.energy, ((3 * innovation * innovation) >> 3) - LN_2);
            self.highest = self.energy;
        }
        let tests = self.upward.iter_mut().zip(&mut self.downward).zip(SMALLEST.iter().zip(&config.smallest));
        for ((upward, downward), ((vector, _), smallest)) in tests.skip(step as usize).take(1) {
            // 16 fraction bits.
            let product = i64::from(whitened[vector & (SLOTS - 1)]) * i64::from(*smallest);
            let shift = i64::from(saturated_to_32(product >> 22));
            let (along, half) = ((shift * innovation) >> 6, (shift * shift) >> 13);
            *upward = added(*upward, along - half);
            *downward = added(*downward, -along - half);
            self.highest = self.highest.max(*upward).max(*downward);
        }
    }
}
