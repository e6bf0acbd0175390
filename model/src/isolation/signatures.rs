//! The signature vectors of a block, a few in each tick.

use super::bank::*;
use super::sums::{Means, times};
use super::{Config, SLOTS, State};
use crate::coefficient::{Rate, saturated, sum, upper};
use crate::units::{Accumulator, Signal, saturated_to_32};

/// Number of ticks that the vectors of a block take.
pub(super) const STEPS: u32 = 6;

/// One, with 20 fraction bits.
const ONE: i32 = 1 << 20;

/// States of the filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Filters {
    nuisances: [Accumulator; 3],
    time_constant: [Accumulator; 3],
    creep: [Accumulator; 2],
    leakage: [Accumulator; 2],
    springs: [Accumulator; 12],
    series: [Accumulator; 3],
    plays: [i32; 3],
    past: [i32; 8],
    tails: [i32; 2],
    end: i32,
    newest: usize,
    longest: i32,
    /// Values of the present block that several steps use: the relaxed part of the model, and the voltage as a fraction of the range.
    relaxed: i32,
    part: i32,
}

/// First-order low-pass; returns the mean of its values at both ends of the block. It stays within the range of a signal, since a rate
/// is below one half: it covers no more than that of its distance to the input.
#[inline(always)]
fn low_pass(state: &mut Accumulator, rate: Rate, input: i32) -> i32 {
    let before = upper(*state);
    *state += rate.step(Signal::from_bits(input).saturating_sub(before));
    (before.to_bits() >> 1) + (upper(*state).to_bits() >> 1)
}

/// Returns `a * b` of numbers with 20 fraction bits, saturated.
#[inline(always)]
fn product(a: i32, b: i32) -> i32 {
    saturated_to_32((i64::from(a) * i64::from(b)) >> 20)
}

/// Computes the vectors of one step.
#[inline(never)]
pub(super) fn step(config: &Config, state: &mut State, step: u32) {
    state.filters.step(config, &state.means, state.age, step, &mut state.vectors);
}

impl Filters {
    /// At rest.
    pub(super) const NEW: Self = Self {
        nuisances: [Accumulator::ZERO; 3],
        time_constant: [Accumulator::ZERO; 3],
        creep: [Accumulator::ZERO; 2],
        leakage: [Accumulator::ZERO; 2],
        springs: [Accumulator::ZERO; 12],
        series: [Accumulator::ZERO; 3],
        plays: [0; 3],
        past: [0; 8],
        tails: [0; 2],
        end: 0,
        newest: 0,
        longest: 0,
        relaxed: 0,
        part: 0,
    };

    /// Sets the nuisances to 256 V.
    pub(super) fn restart(&mut self) {
        self.nuisances = [Accumulator::from_num(256); 3];
    }

    /// Computes the vectors of one step. `age` is the number of blocks since the restart.
    #[inline(always)]
    fn step(&mut self, config: &Config, means: &Means, age: u32, step: u32, vectors: &mut [i32; SLOTS]) {
        let (u, y) = (means.voltage, means.model);
        match step {
            0 => {
                for (index, (nuisance, rate)) in self.nuisances.iter_mut().zip(config.decays).enumerate() {
                    vectors[(INITIAL + index) & (SLOTS - 1)] = upper(*nuisance).to_bits();
                    *nuisance -= rate.step(upper(*nuisance));
                }
                let behind = Signal::from_bits(y).saturating_sub(Signal::from_bits(u));
                let relaxed = sum(Signal::from_bits(y)) + config.share_over_rest.times(behind);
                self.relaxed = saturated(relaxed).to_bits();
                vectors[GAIN] = y;
                vectors[SHARE] = u.saturating_sub(self.relaxed);
                vectors[OFFSET] = ONE;
                let blocks = i64::from(age.min(MOST_BLOCKS));
                vectors[DRIFT] = ((i64::from(y) * blocks) >> MOST_BLOCKS.trailing_zeros()) as i32;
                let z = low_pass(&mut self.time_constant[0], config.rate, vectors[SHARE].saturating_neg());
                vectors[TAU] = config.relaxing(z);
                let twice = low_pass(&mut self.time_constant[1], config.rate, z).saturating_mul(2);
                vectors[TAU_CURVED] = config.relaxing(twice.saturating_sub(z));
                self.part = times(config.per_range, u);
                let behind = product(self.part, vectors[SHARE].saturating_neg());
                vectors[TAU_VOLTAGE] = config.relaxing(low_pass(&mut self.time_constant[2], config.rate, behind));
            }
            1 => {
                let first = low_pass(&mut self.creep[0], config.slow[0], u);
                vectors[CREEP] = first.saturating_sub(self.relaxed);
                vectors[CREEP_SLOWER] = low_pass(&mut self.creep[1], config.slow[1], u).saturating_sub(first);
                let first = low_pass(&mut self.leakage[0], config.slow[0], y);
                vectors[LEAKAGE] = first.saturating_neg();
                vectors[LEAKAGE_SLOWER] = first.saturating_sub(low_pass(&mut self.leakage[1], config.slow[1], y));
                let bow = product(self.part, ONE.saturating_sub(self.part));
                let law = product(bow.saturating_mul(4), config.range);
                vectors[LAW] = config.respond(&mut self.springs[3], law);
                let cubic = product(bow.saturating_mul(8), self.part.saturating_sub(ONE / 2));
                vectors[LAW_CUBIC] = config.respond(&mut self.springs[4], product(cubic, config.range));
            }
            2 => {
                vectors[PLAY] = self.play(config, u, 0);
                vectors[PLAY_SECOND] = self.play(config, u, 1);
                vectors[PLAY_WIDER] = vectors[PLAY_SECOND].saturating_sub(vectors[PLAY]);
                vectors[PLAY_WIDEST] = self.play(config, u, 2).saturating_sub(vectors[PLAY_SECOND]);
                self.short_delays(means, vectors);
                self.long_delays(y, vectors);
                for index in 0..6 {
                    vectors[DELAY_TO_QUARTER + index] = if index < 5 {
                        vectors[DELAY + index + 1].saturating_sub(vectors[DELAY + index])
                    } else {
                        self.longest.saturating_sub(vectors[DELAY_FOUR])
                    };
                }
            }
            3 => {
                vectors[LAG] = self.lag(config, y, 0);
                vectors[LAG_SHORTER] = vectors[LAG].saturating_sub(vectors[DELAY]);
                vectors[LAG_SECOND] = self.lag(config, y, 1);
                vectors[LAG_MIDDLE] = vectors[LAG_SECOND].saturating_sub(vectors[LAG]);
                vectors[LAG_LONGER] = self.lag(config, y, 2).saturating_sub(vectors[LAG_SECOND]);
                vectors[PINNED] = if means.pinned { means.residual } else { 0 };
                vectors[PINNED_BELOW] = vectors[PINNED].min(0);
            }
            4 => {
                vectors[LIMIT] = self.limit(config, u, 0);
                vectors[LIMIT_MIDDLE] = self.limit(config, u, 1).saturating_sub(vectors[LIMIT]);
                vectors[LIMIT_TOP] = self.limit(config, u, 2).saturating_sub(vectors[LIMIT]);
                let pulse = times(config.jump, means.jumps).saturating_neg();
                vectors[SLEW] = config.respond(&mut self.springs[8], pulse);
                vectors[SLEW_FIRST] = self.slew(config, means, 0);
                vectors[SLEW_FASTER] = vectors[SLEW_FIRST].saturating_sub(vectors[SLEW]);
            }
            _ => {
                vectors[SLEW_SECOND] = self.slew(config, means, 1);
                vectors[SLEW_MIDDLE] = vectors[SLEW_SECOND].saturating_sub(vectors[SLEW_FIRST]);
                vectors[SLEW_SLOWER] = self.slew(config, means, 2).saturating_sub(vectors[SLEW_SECOND]);
            }
        }
    }

    #[inline(always)]
    fn lag(&mut self, config: &Config, y: i32, index: usize) -> i32 {
        let behind = low_pass(&mut self.series[index], config.series[index], y).saturating_sub(y);
        times(config.per_lag[index], behind)
    }

    #[inline(always)]
    fn play(&mut self, config: &Config, u: i32, index: usize) -> i32 {
        let half = config.half_widths[index];
        let play = self.plays[index].max(u.saturating_sub(half)).min(u.saturating_add(half));
        self.plays[index] = play;
        config.respond(&mut self.springs[index], times(config.per_width[index], play.saturating_sub(u)))
    }

    #[inline(always)]
    fn limit(&mut self, config: &Config, u: i32, index: usize) -> i32 {
        let above = u.saturating_sub(config.starts[index]).max(0);
        let missing = times(config.per_rest[index], above).saturating_neg();
        config.respond(&mut self.springs[5 + index], missing)
    }

    #[inline(always)]
    fn slew(&mut self, config: &Config, means: &Means, index: usize) -> i32 {
        times(config.per_slew[index], config.respond(&mut self.springs[9 + index], means.lags[index]))
    }

    #[inline(always)]
    fn short_delays(&mut self, means: &Means, vectors: &mut [i32; SLOTS]) {
        vectors[DELAY] = self.end.saturating_sub(means.end);
        vectors[DELAY_QUARTER] = self.tails[0].saturating_sub(means.tails[0]).saturating_mul(4);
        vectors[DELAY_HALF] = self.tails[1].saturating_sub(means.tails[1]).saturating_mul(2);
        (self.end, self.tails) = (means.end, means.tails);
    }

    #[inline(always)]
    fn long_delays(&mut self, y: i32, vectors: &mut [i32; SLOTS]) {
        let newest = self.newest;
        let late = |blocks: usize| self.past[newest.wrapping_sub(blocks) & 7].saturating_sub(y);
        vectors[DELAY_ONE] = late(0);
        vectors[DELAY_TWO] = late(1) >> 1;
        vectors[DELAY_FOUR] = late(3) >> 2;
        self.longest = late(7) >> 3;
        self.newest = newest.wrapping_add(1);
        self.past[self.newest & 7] = y;
    }
}

impl Config {
    /// Returns `(1 - share) input`.
    #[inline(always)]
    fn relaxing(&self, input: i32) -> i32 {
        self.rest.times(Signal::from_bits(input)).to_bits()
    }

    /// Returns the spring's response to an input in place of its voltage.
    #[inline(always)]
    fn respond(&self, state: &mut Accumulator, input: i32) -> i32 {
        let instantaneous = self.share.times(Signal::from_bits(input)).to_bits();
        instantaneous.saturating_add(self.relaxing(low_pass(state, self.rate, input)))
    }
}
