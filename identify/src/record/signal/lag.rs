//! A first-order low-pass filter, solved exactly for straight pieces of its input.

use crate::record::signal::piecewise::Piece;

/// Added to states so that they do not decay to subnormal numbers, with which processors are slow; far below the resolution of
/// any other value.
pub(super) const NO_SUBNORMAL: f64 = 1e-290;

/// A first-order low-pass filter of unit gain, `tau dx/dt = u - x`, exact for straight pieces of the input `u`.
#[derive(Clone, Copy, Debug)]
pub struct Lag {
    tau_s: f64,
    value: f64,
    /// Duration of a piece for which the following three factors hold, in s.
    duration_s: f64,
    /// Weight of the state: `exp(-duration / tau)`.
    kept: f64,
    /// Weight of the input at the end of the piece: `1 - tau / duration (1 - kept)`.
    ramp: f64,
    /// Weight of the input at the start of the piece.
    held: f64,
}

impl Lag {
    /// Returns a filter whose output has settled at `value`.
    pub fn at(tau_s: f64, value: f64) -> Self {
        Self { tau_s, value, duration_s: 0.0, kept: 1.0, ramp: 0.0, held: 0.0 }
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
    pub fn pass(&mut self, Piece { duration_s, from, to }: Piece) -> (f64, f64) {
        let start = self.value;
        // Durations of a uniformly sampled record differ by rounding only.
        if (duration_s - self.duration_s).abs() > 1e-9 * duration_s {
            let x = duration_s / self.tau_s;
            self.duration_s = duration_s;
            self.kept = (-x).exp();
            self.ramp = if x > 1e-4 { 1.0 - (1.0 - self.kept) / x } else { x / 2.0 };
            self.held = 1.0 - self.kept - self.ramp;
        }
        if duration_s > 0.0 {
            // Only the first product depends on the previous piece, so the others can be computed ahead.
            self.value = self.kept * start + (self.held * from + self.ramp * to + NO_SUBNORMAL);
        }
        (start, self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
