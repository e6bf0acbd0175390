//! A first-order low-pass filter, solved exactly for straight pieces of its input.

use crate::record::signal::piecewise::{Piece, SAME_DURATION, Signal};

/// Added to states so that they do not decay to subnormal numbers, with which processors are slow; far below the resolution of
/// any other value.
pub(super) const NO_SUBNORMAL: f64 = 1e-290;

/// A first-order low-pass filter of unit gain, `tau dx/dt = u - x`, exact for straight pieces of the input `u`.
#[derive(Clone, Copy, Debug)]
pub struct Lag {
    tau_s: f64,
    value: f64,
    /// Factors of the last duration, and of another one before: a delay divides every row into the same two pieces.
    factors: [Factors; 2],
}

/// Weights of state and input over a piece.
#[derive(Clone, Copy, Debug)]
struct Factors {
    /// Duration of the piece, in s.
    duration_s: f64,
    /// Weight of the state: `exp(-duration / tau)`.
    kept: f64,
    /// Weight of the input at the end of the piece: `1 - tau / duration (1 - kept)`.
    ramp: f64,
    /// Weight of the input at the start of the piece.
    held: f64,
}

impl Factors {
    /// Factors of a piece without duration.
    const NONE: Self = Self { duration_s: 0.0, kept: 1.0, ramp: 0.0, held: 0.0 };

    fn of(duration_s: f64, tau_s: f64) -> Self {
        let x = duration_s / tau_s;
        let kept = (-x).exp();
        let ramp = if x > 1e-4 { 1.0 - (1.0 - kept) / x } else { x / 2.0 };
        Self { duration_s, kept, ramp, held: 1.0 - kept - ramp }
    }

    fn differ_from(&self, duration_s: f64) -> bool {
        differ(duration_s, self.duration_s)
    }
}

/// True if pieces of two durations, in s, need different factors.
fn differ(duration_s: f64, known_s: f64) -> bool {
    (duration_s - known_s).abs() > SAME_DURATION * duration_s
}

impl Lag {
    /// Returns a filter whose output has settled at `value`.
    pub fn at(tau_s: f64, value: f64) -> Self {
        Self { tau_s, value, factors: [Factors::NONE; 2] }
    }

    /// Returns the present output.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Returns the time constant, in s.
    pub fn tau_s(&self) -> f64 {
        self.tau_s
    }

    /// Returns the same filter with another time constant, in s, and the same output.
    pub fn with_tau(self, tau_s: f64) -> Self {
        Self { value: self.value, ..Self::at(tau_s, 0.0) }
    }

    /// Advances over one piece of the input and returns the output at its start and end.
    #[inline]
    pub fn pass(&mut self, Piece { duration_s, from, to }: Piece) -> (f64, f64) {
        let start = self.value;
        let Factors { kept, ramp, held, .. } = self.factors_of(duration_s);
        if duration_s > 0.0 {
            // Only the first product depends on the previous piece, so the others can be computed ahead.
            self.value = kept * start + (held * from + ramp * to + NO_SUBNORMAL);
        }
        (start, self.value)
    }

    /// Advances over a duration, in s, in which the input is 0.
    #[inline]
    pub fn pass_free(&mut self, duration_s: f64) {
        if duration_s > 0.0 {
            self.value *= self.factors_of(duration_s).kept;
        }
    }

    #[inline]
    fn factors_of(&mut self, duration_s: f64) -> Factors {
        if self.factors[0].differ_from(duration_s) {
            self.factors.swap(0, 1);
            if self.factors[0].differ_from(duration_s) {
                self.factors[0] = Factors::of(duration_s, self.tau_s);
            }
        }
        self.factors[0]
    }

    /// Moves the output to where it would be if the last piece's input had ended `more` higher.
    pub fn raise_end(&mut self, more: f64) {
        self.value += self.factors[0].ramp * more;
    }
}

/// The factors of each filter of a bank, as in [`Factors`].
#[derive(Clone, Copy)]
struct BankFactors<const N: usize> {
    kept: [f64; N],
    ramp: [f64; N],
    held: [f64; N],
}

/// Free responses to 1 V count as decayed below this, in V.
pub const DECAYED: f64 = 1e-12;
/// Number of pieces after which a free response is checked for its end.
const PIECES_TO_CHECK: usize = 32;

impl<const N: usize> BankFactors<N> {
    const NONE: Self = Self { kept: [1.0; N], ramp: [0.0; N], held: [0.0; N] };

    #[inline(never)]
    fn of(duration_s: f64, lags: &[(f64, Lag)]) -> Self {
        let factors: [Factors; N] = std::array::from_fn(|of| Factors::of(duration_s, lags[of].1.tau_s));
        Self { kept: factors.map(|it| it.kept), ramp: factors.map(|it| it.ramp), held: factors.map(|it| it.held) }
    }
}

/// Replaces the pieces of a signal by `share` of it and the responses of `N` lags, each with its weight; together they are as fast
/// as one, since none waits for another. The rest of a signal that is 0 (`free`) is left as it is once the responses have decayed.
fn pass_bank<const N: usize>(pieces: &mut [Piece], share: f64, lags: &[(f64, Lag)], free: bool) {
    let weight: [f64; N] = std::array::from_fn(|of| lags[of].0);
    let mut value: [f64; N] = std::array::from_fn(|of| lags[of].1.value);
    let sum = |value: &[f64; N]| (0..N).map(|of| value[of] * weight[of]).sum::<f64>();
    // Factors of two durations, as in a [`Lag`].
    let mut known = [(0.0f64, BankFactors::<N>::NONE); 2];
    let (mut last, mut start) = (0, sum(&value));
    for pieces in pieces.chunks_mut(PIECES_TO_CHECK) {
        for piece in pieces {
            let Piece { duration_s, from, to } = *piece;
            if differ(duration_s, known[last].0) {
                last ^= 1;
                if differ(duration_s, known[last].0) {
                    known[last] = (duration_s, BankFactors::of(duration_s, lags));
                }
            }
            if duration_s > 0.0 {
                let BankFactors { kept, ramp, held } = &known[last].1;
                for of in 0..N {
                    value[of] = kept[of] * value[of] + (held[of] * from + ramp[of] * to + NO_SUBNORMAL);
                }
            }
            let end = sum(&value);
            (piece.from, piece.to) = (share * from + start, share * to + end);
            start = end;
        }
        if free && value.iter().all(|value| value.abs() < DECAYED) {
            return;
        }
    }
}

/// Replaces a signal by `share` of it and its responses of up to four lags, each with its weight.
///
/// # Panics
/// More than four lags.
pub fn pass_lags(signal: &mut Signal, share: f64, lags: &[(f64, Lag)], free: bool) {
    let pieces = &mut signal.pieces;
    match lags.len() {
        0 => pieces.iter_mut().for_each(|piece| (piece.from, piece.to) = (share * piece.from, share * piece.to)),
        1 => pass_bank::<1>(pieces, share, lags, free),
        2 => pass_bank::<2>(pieces, share, lags, free),
        3 => pass_bank::<3>(pieces, share, lags, free),
        4 => pass_bank::<4>(pieces, share, lags, free),
        more => panic!("{more} lags; expected at most four"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bank is the weighted sum of its filters and the input's share, also over pieces of changing length.
    #[test]
    fn bank_is_the_weighted_sum_of_its_filters() {
        let lags = [5.5, 0.3, 40.0, 1.0].map(|tau_s| (0.1 * tau_s, Lag::at(tau_s, tau_s - 2.0)));
        let durations = [0.1, 0.2, 0.1, 0.2, 0.7, 0.0, 0.1].into_iter().zip(0..);
        let piece = |(duration_s, index)| Piece { duration_s, from: f64::from(index), to: 3.0 };
        let signal = Signal { pieces: durations.map(piece).collect(), ..Signal::default() };
        for count in 0..=lags.len() {
            let (mut bank, mut one_by_one) = (signal.clone(), signal.clone());
            pass_lags(&mut bank, 0.4, &lags[..count], false);
            let mut lags = lags;
            one_by_one.pass(|piece| {
                let outputs = lags[..count].iter_mut().map(|(weight, lag)| (*weight, lag.pass(piece)));
                let share = (0.4 * piece.from, 0.4 * piece.to);
                outputs.fold(share, |sum, (weight, of)| (sum.0 + weight * of.0, sum.1 + weight * of.1))
            });
            for (one, other) in bank.pieces.iter().zip(&one_by_one.pieces) {
                assert!((one.from - other.from).abs() < 1e-12 && (one.to - other.to).abs() < 1e-12, "{count} lags");
            }
        }
    }

    /// A free response ends where it has decayed.
    #[test]
    fn free_response_is_zero_once_decayed() {
        let piece = Piece { duration_s: 1.0, from: 0.0, to: 0.0 };
        let mut signal = Signal { pieces: vec![piece; 1000], ..Signal::default() };
        pass_lags(&mut signal, 0.5, &[(2.0, Lag::at(3.0, 1.0))], true);
        assert!((signal.pieces[10].from - 2.0 * f64::exp(-10.0 / 3.0)).abs() < 1e-12);
        assert_eq!((signal.pieces[999].from, signal.pieces[999].to), (0.0, 0.0));
    }

    #[test]
    fn lag_is_exact_for_steps_and_ramps() {
        let mut lag = Lag::at(5.5, 0.0);
        assert!(
            (lag.pass(Piece { duration_s: 2.0, from: 3.0, to: 3.0 }).1 - 3.0 * (1.0 - (-2.0f64 / 5.5).exp())).abs()
                < 1e-12
        );
        let mut lag = Lag::at(2.0, 0.0);
        let exact = 3.0 - 2.0 * (1.0 - (-1.5f64).exp());
        assert!((lag.pass(Piece { duration_s: 3.0, from: 0.0, to: 3.0 }).1 - exact).abs() < 1e-12);
    }
}
