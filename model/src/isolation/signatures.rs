//! The signature vectors of a block, a few in each tick.

use super::bank::*;
use super::sums::{Means, times};
use super::{Config, SLOTS};
use crate::coefficient::{Rate, saturated, sum, upper};
use crate::units::{Accumulator, Signal, saturated_to_32};

/// Number of ticks that the vectors of a block take.
pub(super) const STEPS: u32 = 11;

/// One, with 20 fraction bits.
const ONE: i32 = 1 << 20;

/// States of the filters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
    /// The relaxed part of the model in the present block.
    relaxed: i32,
}

/// First-order low-pass; returns the mean of its values at both ends of the block.
#[inline(always)]
fn low_pass(state: &mut Accumulator, rate: Rate, input: i32) -> i32 {
    let before = upper(*state);
    *state = state.saturating_add(rate.step(Signal::from_bits(input).saturating_sub(before)));
    (before.to_bits() >> 1) + (upper(*state).to_bits() >> 1)
}

/// Returns `a * b` of numbers with 20 fraction bits, saturated.
#[inline(always)]
fn product(a: i32, b: i32) -> i32 {
    saturated_to_32((i64::from(a) * i64::from(b)) >> 20)
}

impl Filters {
    /// Sets the nuisances to 256 V.
    pub(super) fn restart(&mut self) {
        self.nuisances = [Accumulator::from_num(256); 3];
    }

    /// Computes the vectors of one step. `age` is the number of blocks since the restart.
    #[inline(never)]
    pub(super) fn step(&mut self, config: &Config, means: &Means, age: u32, step: u32, vectors: &mut [i32; SLOTS]) {
        let (u, y) = (means.voltage, means.model);
        match step {
            0 => {
                for (index, (nuisance, rate)) in self.nuisances.iter_mut().zip(config.decays).enumerate() {
                    if let Some(vector) = vectors.get_mut(INITIAL + index) {
                        *vector = upper(*nuisance).to_bits();
                    }
                    *nuisance -= rate.step(upper(*nuisance));
                }
                let behind = Signal::from_bits(y).saturating_sub(Signal::from_bits(u));
                let relaxed = sum(Signal::from_bits(y)) + config.share_over_rest.times(behind);
                self.relaxed = saturated(relaxed).to_bits();
                vectors[GAIN] = y;
                vectors[SHARE] = u.saturating_sub(self.relaxed);
            }
            1 => {
                vectors[OFFSET] = ONE;
                let blocks = i64::from(age.min(MOST_BLOCKS));
                vectors[DRIFT] = ((i64::from(y) * blocks) / i64::from(MOST_BLOCKS)) as i32;
                let behind = self.relaxed.saturating_sub(u);
                let z = low_pass(&mut self.time_constant[0], config.rate, behind);
                vectors[TAU] = config.relaxing(z);
                vectors[TAU_CURVED] = config.relaxing(low_pass(&mut self.time_constant[1], config.rate, z));
            }
            2 => {
                let behind = product(config.part(u), self.relaxed.saturating_sub(u));
                vectors[TAU_VOLTAGE] = config.relaxing(low_pass(&mut self.time_constant[2], config.rate, behind));
                let first = low_pass(&mut self.creep[0], config.slow[0], u);
                vectors[CREEP] = first.saturating_sub(self.relaxed);
                vectors[CREEP_SLOWER] = low_pass(&mut self.creep[1], config.slow[1], u).saturating_sub(first);
            }
            3 => {
                let first = low_pass(&mut self.leakage[0], config.slow[0], y);
                vectors[LEAKAGE] = first.saturating_neg();
                vectors[LEAKAGE_SLOWER] = first.saturating_sub(low_pass(&mut self.leakage[1], config.slow[1], y));
                vectors[PLAY] = self.play(config, u, 0);
            }
            4 => {
                vectors[PLAY_SECOND] = self.play(config, u, 1);
                vectors[PLAY_WIDER] = vectors[PLAY_SECOND].saturating_sub(vectors[PLAY]);
                vectors[PLAY_WIDEST] = self.play(config, u, 2).saturating_sub(vectors[PLAY_SECOND]);
            }
            5 => {
                let part = config.part(u);
                let bow = product(part, ONE.saturating_sub(part));
                let law = product(bow.saturating_mul(4), config.range);
                vectors[LAW] = config.respond(&mut self.springs[3], law);
                let cubic = product(product(bow.saturating_mul(8), part.saturating_sub(ONE / 2)), config.range);
                vectors[LAW_CUBIC] = config.respond(&mut self.springs[4], cubic);
            }
            6 => {
                vectors[LIMIT] = self.limit(config, u, 0);
                vectors[LIMIT_MIDDLE] = self.limit(config, u, 1).saturating_sub(vectors[LIMIT]);
            }
            7 => {
                vectors[LIMIT_TOP] = self.limit(config, u, 2).saturating_sub(vectors[LIMIT]);
                let pulse = times(config.jump, means.jumps).saturating_neg();
                vectors[SLEW] = config.respond(&mut self.springs[8], pulse);
            }
            8 => {
                vectors[SLEW_FIRST] = self.slew(config, means, 0);
                vectors[SLEW_SECOND] = self.slew(config, means, 1);
                vectors[SLEW_FASTER] = vectors[SLEW_FIRST].saturating_sub(vectors[SLEW]);
                vectors[SLEW_MIDDLE] = vectors[SLEW_SECOND].saturating_sub(vectors[SLEW_FIRST]);
            }
            9 => {
                vectors[SLEW_SLOWER] = self.slew(config, means, 2).saturating_sub(vectors[SLEW_SECOND]);
                self.delays(means, vectors);
            }
            _ => {
                let [first, second, third] = [0, 1, 2].map(|index: usize| {
                    let (rate, gain) = (config.series[index], config.per_lag[index]);
                    times(gain, low_pass(&mut self.series[index], rate, y).saturating_sub(y))
                });
                vectors[LAG] = first;
                vectors[LAG_SECOND] = second;
                vectors[LAG_SHORTER] = first.saturating_sub(vectors[DELAY]);
                vectors[LAG_MIDDLE] = second.saturating_sub(first);
                vectors[LAG_LONGER] = third.saturating_sub(second);
                vectors[PINNED] = if means.pinned { means.residual } else { 0 };
                vectors[PINNED_BELOW] = vectors[PINNED].min(0);
            }
        }
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
    fn delays(&mut self, means: &Means, vectors: &mut [i32; SLOTS]) {
        let y = means.model;
        let [quarter, half] = [0, 1].map(|index: usize| self.tails[index].saturating_sub(means.tails[index]));
        let whole = [0, 1, 3, 7].map(|blocks: usize| self.past[blocks].saturating_sub(y));
        let late = [
            self.end.saturating_sub(means.end),
            quarter.saturating_mul(4),
            half.saturating_mul(2),
            whole[0],
            whole[1] >> 1,
            whole[2] >> 2,
            whole[3] >> 3,
        ];
        (self.end, self.tails) = (means.end, means.tails);
        self.past.rotate_right(1);
        self.past[0] = y;
        for index in 0..6 {
            vectors[DELAY + index] = late[index];
            vectors[DELAY_TO_QUARTER + index] = late[index + 1].saturating_sub(late[index]);
        }
    }
}

impl Config {
    /// Returns the voltage as a fraction of the range, with 20 fraction bits.
    #[inline(always)]
    fn part(&self, u: i32) -> i32 {
        times(self.per_range, u)
    }

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
