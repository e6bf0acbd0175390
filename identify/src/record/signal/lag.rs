//! A first-order low-pass filter, solved exactly for straight pieces of its input.

use crate::record::signal::piecewise::Piece;

/// A first-order low-pass of unit gain, `tau dx/dt = u - x`, exact for straight pieces.
#[derive(Clone, Copy, Debug)]
pub struct Lag {
    tau_s: f64,
    value: f64,
    /// Duration that the next two are for.
    duration_s: f64,
    /// exp(-duration / tau)
    kept: f64,
    /// 1 - tau / duration (1 - kept): what is followed of a ramp, which is the weight of its end.
    ramp: f64,
    /// Weight of its start.
    held: f64,
}

impl Lag {
    /// At rest at `value`.
    pub fn at(tau_s: f64, value: f64) -> Self {
        Self { tau_s, value, duration_s: 0.0, kept: 1.0, ramp: 0.0, held: 0.0 }
    }

    /// Where it is.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Its time constant, in s.
    pub fn tau_s(&self) -> f64 {
        self.tau_s
    }

    /// From here on with another time constant.
    pub fn with_tau(self, tau_s: f64) -> Self {
        Self { value: self.value, ..Self::at(tau_s, 0.0) }
    }

    /// Start and end of the lag over a piece of its input.
    pub fn pass(&mut self, Piece { duration_s, from, to }: Piece) -> (f64, f64) {
        let start = self.value;
        // Durations of a regular record differ by rounding alone.
        if (duration_s - self.duration_s).abs() > 1e-9 * duration_s {
            let x = duration_s / self.tau_s;
            self.duration_s = duration_s;
            self.kept = (-x).exp();
            self.ramp = if x > 1e-4 { 1.0 - (1.0 - self.kept) / x } else { x / 2.0 };
            self.held = 1.0 - self.kept - self.ramp;
        }
        if duration_s > 0.0 {
            // Only the first product waits for the piece before.
            self.value = self.kept * start + (self.held * from + self.ramp * to);
        }
        (start, self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_is_exact_for_steps_and_ramps() {
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
