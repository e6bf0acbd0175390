//! Rate-independent memory (hysteresis): a bank of play operators.
//!
//! Important terms:
//!
//! - *play operator*: an output `z` that follows the voltage at a distance `r` and stays where it is while the voltage
//!   turns.
//! - *threshold*, `r`: half the width of a play, in V.
//! - *bank*: a weighted sum of plays and of the voltage itself, the Prandtl-Ishlinskii model of hysteresis.
//!
//! ```text
//! p = direct v + sum_j weight_j z_j,    z_j' = max(v - r_j, min(v + r_j, z_j)),    z_j = 0 at rest
//! ```
//!
//! Sources: M. Brokate, J. Sprekels: Hysteresis and Phase Transitions, 1996, chapter 2; K. Kuhnen: Modeling,
//! identification and compensation of complex hysteretic nonlinearities, European Journal of Control 9, 2003. With a
//! [law](super::law) behind it, the bank is Kuhnen's modified model.
//!
//! Exact but for the rounding of thresholds (2^-21 V) and weights (2^-28).

use crate::coefficient::{Weight, WideGain, saturated};
use crate::error::OutOfRange;
use crate::units::{SampleTime, Signal, signal};
use crate::validated::{Validate, Validated};

/// Largest number of plays in a bank.
pub const MAX_PLAYS: usize = 8;

/// Smallest slope, with all plays in motion, that can be inverted.
const MIN_SLOPE: f64 = 0.01;
/// Slope up to which a piece of the bank counts as level.
const LEVEL: f64 = 1e-3;

/// A bank of play operators. The magnitudes of `direct` and `weights` add up to at most 10.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory<'a> {
    /// Weight of the voltage itself.
    pub direct: f64,
    /// Threshold of each play (half its width), 0 to 1000 V; up to 8 plays.
    pub thresholds_v: &'a [f64],
    /// Weight of each play.
    pub weights: &'a [f64],
}

impl Validate for Memory<'_> {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        let count = self.thresholds_v.len();
        OutOfRange::check_count("memory.thresholds_v", count, 0..=MAX_PLAYS, "plays")?;
        OutOfRange::check_count("memory.weights", self.weights.len(), count..=count, "weights, one per threshold")?;
        let mut budget = Weight::spend("memory.direct", self.direct, Weight::MAX)?;
        for (&threshold, &weight) in self.thresholds_v.iter().zip(self.weights) {
            OutOfRange::check("memory.thresholds_v", threshold, 0.0..=1000.0, "V")?;
            budget = Weight::spend("memory.weights", weight, budget)?;
        }
        Ok(())
    }
}

impl Memory<'_> {
    /// Checks that the bank rises once all plays move.
    ///
    /// # Errors
    /// [`OutOfRange`] names `memory.direct`.
    pub(super) fn check_inverse(&self) -> Result<(), OutOfRange> {
        let unit = "in total, weights included, for the spring to be invertible";
        OutOfRange::check("memory.direct", self.slope_in_motion(), MIN_SLOPE..=Weight::MAX, unit)
    }

    /// Returns the slope of the bank while all plays move.
    fn slope_in_motion(&self) -> f64 {
        self.direct + self.weights.iter().sum::<f64>()
    }

    /// Returns the slope of the bank when the voltage turns and all plays stay at first, but at least a quarter of the
    /// slope with all plays in motion: a bank that does not respond at first will respond later.
    pub(super) fn slope_at_turn(&self) -> f64 {
        self.direct.max(0.25 * self.slope_in_motion())
    }

    /// Returns an upper bound of the bank's slope: the sum of all positive weights.
    pub(super) fn largest_slope(&self) -> f64 {
        self.direct.max(0.0) + self.weights.iter().map(|weight| weight.max(0.0)).sum::<f64>()
    }
}

/// The bank, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    direct: Weight,
    plays: [Play; MAX_PLAYS],
    count: u8,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Play {
    threshold: Signal,
    weight: Weight,
}

/// The output `z` of each play, in V.
pub(crate) type State = [Signal; MAX_PLAYS];

impl Validated<'_, Memory<'_>> {
    /// Quantizes the bank for the tick, its plays sorted by threshold.
    pub(crate) fn quantize(self) -> Config {
        let memory = self.settings();
        let mut plays = [Play::default(); MAX_PLAYS];
        let mut count = 0;
        for (&threshold, &weight) in memory.thresholds_v.iter().zip(memory.weights).take(MAX_PLAYS) {
            let mut new = Play { threshold: signal(threshold), weight: Weight::new(weight) };
            // The inverse needs this order; the sum is exact in any order.
            for play in plays.iter_mut().take(count) {
                if new.threshold < play.threshold {
                    core::mem::swap(play, &mut new);
                }
            }
            if let Some(end) = plays.get_mut(count) {
                (*end, count) = (new, count + 1);
            }
        }
        Config { direct: Weight::new(memory.direct), plays, count: count as u8 }
    }
}

impl Config {
    /// Returns the bank's output just after `voltage` was applied, and updates the plays.
    #[inline(always)]
    pub(crate) fn run(&self, state: &mut State, voltage: Signal) -> Signal {
        let mut sum = self.direct.times(voltage);
        for (play, output) in self.plays.iter().zip(state).take(usize::from(self.count)) {
            let (low, high) = (voltage.saturating_sub(play.threshold), voltage.saturating_add(play.threshold));
            *output = (*output).max(low).min(high);
            sum += play.weight.times(*output);
        }
        saturated(sum)
    }
}

/// Inverse of the bank.
///
/// Upwards a play begins to move at `z + r`. Of two plays that saw the same voltages, the one with the smaller
/// threshold begins first: `z' + r = max(v, min(v + 2 r, z + r))` keeps that order. So the bank is piecewise linear,
/// each piece with one more play in motion, and downwards it is the same with all signs changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inverse {
    /// Piece `i` has `i` plays in motion.
    pieces: [Piece; MAX_PLAYS + 1],
    /// Smallest change of the output, in V, for which a level piece is crossed: one DAC code where the bank is
    /// steepest.
    threshold: Signal,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Piece {
    slope: Weight,
    /// Reciprocal slope; `None` if the piece is level or falls: it is crossed in one jump or not at all.
    per_slope: Option<WideGain>,
}

impl Inverse {
    /// Quantizes the inverse of a memory that [`Memory::check_inverse`] accepts; `resolution_v` is the voltage of one
    /// DAC code.
    pub(crate) fn new(bank: &Config, resolution_v: f64) -> Self {
        let (mut slope, mut steepest) = (bank.direct.to_f64(), 0.0f64);
        let mut inverse = Self::default();
        let plays = bank.plays.iter().take(usize::from(bank.count));
        for (piece, weight) in inverse.pieces.iter_mut().zip(plays.map(|play| play.weight.to_f64()).chain([0.0])) {
            let per_slope = (slope > LEVEL).then(|| WideGain::new(1.0 / slope));
            *piece = Piece { slope: Weight::new(slope), per_slope };
            (slope, steepest) = (slope + weight, steepest.max(slope));
        }
        inverse.threshold = signal(steepest * resolution_v);
        inverse
    }

    /// Returns the voltage that changes the bank's output by `change` from what it is at `voltage`, the last voltage.
    #[inline(always)]
    pub(crate) fn voltage(&self, bank: &Config, state: &State, voltage: Signal, change: Signal) -> Signal {
        let down = change < Signal::ZERO;
        let mirrored = |signal: Signal| if down { signal.saturating_neg() } else { signal };
        let (mut at, mut left) = (mirrored(voltage), mirrored(change));
        let ends = bank.plays.iter().zip(state).take(usize::from(bank.count));
        let ends = ends.map(|(play, &output)| mirrored(output).saturating_add(play.threshold));
        for (piece, end) in self.pieces.iter().zip(ends.chain([Signal::MAX])) {
            let distance = match piece.per_slope {
                Some(per_slope) => per_slope.times(left),
                None if left > self.threshold => Signal::MAX,
                None => Signal::ZERO,
            };
            if end > at {
                let width = end.saturating_sub(at);
                if distance <= width {
                    return mirrored(at.saturating_add(distance));
                }
                left = left.saturating_sub(saturated(piece.slope.times(width)));
                at = end;
            }
        }
        mirrored(at)
    }
}

#[cfg(test)]
mod tests;
