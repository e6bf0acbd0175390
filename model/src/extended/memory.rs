//! Rate-independent memory: a bank of play operators.
//!
//! ```text
//! p = direct v + sum_j weight_j z_j,    z_j' = max(v - r_j, min(v + r_j, z_j)),    z_j = 0 at rest
//! ```
//!
//! A play follows the voltage from a distance `r` and stays where it is while the voltage turns. A weighted sum of plays
//! is the Prandtl-Ishlinskii model of hysteresis (M. Brokate, J. Sprekels: Hysteresis and Phase Transitions, 1996,
//! chapter 2; K. Kuhnen: Modeling, identification and compensation of complex hysteretic nonlinearities, European
//! Journal of Control 9, 2003). With a [law](super::law) behind it, it is Kuhnen's modified model.
//!
//! Exact but for the rounding of thresholds (2^-21 V) and weights (2^-28).

use crate::coefficient::{Steep, Weight, saturated};
use crate::error::OutOfRange;
use crate::units::{Signal, signal};

/// The most plays of a bank.
pub const MOST_PLAYS: usize = 8;

/// The least slope with all plays in motion that can be gone back.
const LEAST_SLOPE: f64 = 0.01;
/// What is not steeper than this is level.
const LEVEL: f64 = 1e-3;

/// A bank of plays. The magnitudes of `direct` and `weights` add up to at most 10.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory<'a> {
    /// Weight of the voltage itself.
    pub direct: f64,
    /// Half the width of each play, in V, 0 to 1000; up to 8.
    pub thresholds_v: &'a [f64],
    /// Weight of each play.
    pub weights: &'a [f64],
}

impl Memory<'_> {
    /// # Errors
    /// [`OutOfRange`] names `memory.direct`, `memory.thresholds_v` or `memory.weights`.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        let count = self.thresholds_v.len();
        OutOfRange::check_count("memory.thresholds_v", count, 0..=MOST_PLAYS, "plays")?;
        OutOfRange::check_count("memory.weights", self.weights.len(), count..=count, "weights, one a threshold")?;
        let mut left = Weight::budget("memory.direct", self.direct, Weight::MOST)?;
        for (&threshold, &weight) in self.thresholds_v.iter().zip(self.weights) {
            OutOfRange::check("memory.thresholds_v", threshold, 0.0..=1000.0, "V")?;
            left = Weight::budget("memory.weights", weight, left)?;
        }
        Ok(())
    }

    /// Whether the bank rises once all plays move.
    ///
    /// # Errors
    /// [`OutOfRange`] names `memory.direct`.
    pub(super) fn check_inverse(&self) -> Result<(), OutOfRange> {
        let unit = "with all weights, to be led by its inverse";
        OutOfRange::check("memory.direct", self.all_moving(), LEAST_SLOPE..=Weight::MOST, unit)
    }

    /// How steep the bank is while all plays move.
    fn all_moving(&self) -> f64 {
        self.direct + self.weights.iter().sum::<f64>()
    }

    /// How steep the bank is when the voltage turns, and all plays stay at first; but a quarter of what it is later, so
    /// that a bank which does not answer at all at first is not thought never to answer.
    pub(super) fn turning(&self) -> f64 {
        self.direct.max(0.25 * self.all_moving())
    }

    /// The steepest that the bank can be: all plays move.
    pub(crate) fn steepest(&self) -> f64 {
        self.direct.max(0.0) + self.weights.iter().map(|weight| weight.max(0.0)).sum::<f64>()
    }
}

/// The bank, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    direct: Weight,
    plays: [Play; MOST_PLAYS],
    count: u8,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Play {
    threshold: Signal,
    weight: Weight,
}

/// Where each play is.
pub(crate) type State = [Signal; MOST_PLAYS];

impl Config {
    /// Of a memory that [`Memory::check`] accepts.
    pub(crate) fn new(memory: &Memory<'_>) -> Self {
        let mut plays = [Play::default(); MOST_PLAYS];
        let mut count = 0;
        for (&threshold, &weight) in memory.thresholds_v.iter().zip(memory.weights).take(MOST_PLAYS) {
            let mut new = Play { threshold: signal(threshold), weight: Weight::new(weight) };
            // Smaller thresholds first: the sum is exact, so its order is the inverse's choice.
            for play in plays.iter_mut().take(count) {
                if new.threshold < play.threshold {
                    core::mem::swap(play, &mut new);
                }
            }
            if let Some(end) = plays.get_mut(count) {
                (*end, count) = (new, count + 1);
            }
        }
        Self { direct: Weight::new(memory.direct), plays, count: count as u8 }
    }

    /// The bank's output with `voltage` just applied.
    #[inline(always)]
    pub(crate) fn run(&self, state: &mut State, voltage: Signal) -> Signal {
        let mut sum = self.direct.of(voltage);
        for (play, place) in self.plays.iter().zip(state).take(usize::from(self.count)) {
            let (low, high) = (voltage.saturating_sub(play.threshold), voltage.saturating_add(play.threshold));
            *place = (*place).max(low).min(high);
            sum += play.weight.of(*place);
        }
        saturated(sum)
    }
}

/// The bank's way back. Upwards a play begins to move at `z + r`. Of two plays that saw the same voltages, the one with
/// the smaller threshold begins first: `z' + r = max(v, min(v + 2 r, z + r))` keeps that order. So the bank is straight
/// in pieces, each with one play more in motion, and downwards it is the same with all signs turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inverse {
    /// With as many plays in motion.
    pieces: [Piece; MOST_PLAYS + 1],
    /// What is not worth crossing a level piece for: one code of the converter where the bank is steepest.
    toll: Signal,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Piece {
    slope: Weight,
    /// `None`: level or falling; it is crossed at once or not at all.
    per_slope: Option<Steep>,
}

impl Inverse {
    /// Of a memory that [`Memory::check_inverse`] accepts, for steps of `resolution_v` of the voltage.
    pub(crate) fn new(bank: &Config, resolution_v: f64) -> Self {
        let (mut slope, mut steepest) = (bank.direct.to_f64(), 0.0f64);
        let mut inverse = Self::default();
        let plays = bank.plays.iter().take(usize::from(bank.count));
        for (piece, weight) in inverse.pieces.iter_mut().zip(plays.map(|play| play.weight.to_f64()).chain([0.0])) {
            *piece = Piece { slope: Weight::new(slope), per_slope: (slope > LEVEL).then(|| Steep::new(1.0 / slope)) };
            (slope, steepest) = (slope + weight, steepest.max(slope));
        }
        inverse.toll = signal(steepest * resolution_v);
        inverse
    }

    /// The voltage that makes the bank's output `more` than at `voltage`, which is the last one.
    #[inline(always)]
    pub(crate) fn voltage(&self, bank: &Config, state: &State, voltage: Signal, more: Signal) -> Signal {
        let down = more < Signal::ZERO;
        let turned = |signal: Signal| if down { signal.saturating_neg() } else { signal };
        let (mut at, mut left) = (turned(voltage), turned(more));
        let ends = bank.plays.iter().zip(state).take(usize::from(bank.count));
        let ends = ends.map(|(play, &place)| turned(place).saturating_add(play.threshold));
        for (piece, end) in self.pieces.iter().zip(ends.chain([Signal::MAX])) {
            let way = match piece.per_slope {
                Some(per_slope) => per_slope.times(left),
                None if left > self.toll => Signal::MAX,
                None => Signal::ZERO,
            };
            if end > at {
                let width = end.saturating_sub(at);
                if way <= width {
                    return turned(at.saturating_add(way));
                }
                left = left.saturating_sub(saturated(piece.slope.of(width)));
                at = end;
            }
        }
        turned(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BANK: Memory<'_> = Memory { direct: 0.5, thresholds_v: &[10.0, 40.0], weights: &[0.3, 0.2] };

    fn walk(memory: &Memory<'_>, voltages: &[f64]) -> f64 {
        let (config, mut state) = (Config::new(memory), State::default());
        let outputs = voltages.iter().map(|&voltage| config.run(&mut state, Signal::from_num(voltage)).to_num());
        outputs.last().unwrap_or(0.0)
    }

    #[test]
    fn up_and_back_by_hand() {
        for (voltages, expected) in [
            (&[100.0][..], 50.0 + 0.3 * 90.0 + 0.2 * 60.0),
            // Within twice the threshold a play stays.
            (&[100.0, 85.0], 42.5 + 0.3 * 90.0 + 0.2 * 60.0),
            (&[100.0, 50.0], 25.0 + 0.3 * 60.0 + 0.2 * 60.0),
            (&[100.0, 0.0], 0.3 * 10.0 + 0.2 * 40.0),
        ] {
            let got = walk(&BANK, voltages);
            assert!((got - expected).abs() < 1e-5, "{voltages:?}: {got} {expected}");
        }
    }

    proptest! {
        /// A minor loop that is passed again leaves no trace, and speed does not matter: only the turns are remembered.
        #[test]
        fn closed_loops_are_forgotten(peak in 200.0..900.0f64, low in 0.0..150.0f64, inner in 150.0..200.0f64) {
            let straight = walk(&BANK, &[peak, low, peak]);
            let detour = walk(&BANK, &[peak / 3.0, peak, low, inner, low, 0.5 * (low + inner), peak]);
            prop_assert!((straight - detour).abs() < 1e-5, "{straight} {detour}");
        }
    }

    #[test]
    fn a_wrong_bank_is_named() {
        let named = |direct, thresholds_v: &[f64], weights: &[f64]| {
            Memory { direct, thresholds_v, weights }.check().unwrap_err().field
        };
        assert_eq!(named(f64::NAN, &[], &[]), "memory.direct");
        assert_eq!(named(1.0, &[-1.0], &[0.1]), "memory.thresholds_v");
        assert_eq!(named(1.0, &[1.0; 9], &[0.1; 9]), "memory.thresholds_v");
        assert_eq!(named(1.0, &[1.0], &[]), "memory.weights");
        // Each is allowed, but not all of them.
        assert_eq!(named(4.0, &[1.0, 2.0], &[4.0, -4.0]), "memory.weights");
    }
}
