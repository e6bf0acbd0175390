//! Operators that follow the clock: a gain that swings, grows or steps with time, and terms that are added to the readings.

use std::f64::consts::TAU;

use crate::equation::scale::Scale;
use crate::record::signal::{Piece, Signal};

/// Multiplies a signal by a function of the time since the first row, in s.
pub(super) fn modulate(signal: &mut Signal, gain: impl Fn(f64) -> f64) {
    let mut time_s = 0.0;
    signal.pass(|Piece { duration_s, from, to }| {
        let start = gain(time_s);
        time_s += duration_s;
        (start * from, gain(time_s) * to)
    });
}

/// Returns `1 + cosine cos(2 pi f t) + sine sin(2 pi f t)`.
pub(super) fn swing(time_s: f64, freq_hz: f64, cosine: f64, sine: f64) -> f64 {
    let angle = TAU * freq_hz * time_s;
    1.0 + cosine * angle.cos() + sine * angle.sin()
}

/// A term that is added to the readings, whatever the voltage; its amplitudes are linear coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Term {
    /// `a cos(2 pi f t) + b sin(2 pi f t)`; holds the logarithm of `f` in Hz.
    Sine(f64),
    /// `a t / T` with the record's length `T`.
    Ramp,
    /// `a` from a time on, in s since the first row.
    Step(f64),
}

impl Term {
    /// Returns the columns of the term, one for each amplitude, at times since the first row.
    pub(super) fn columns(&self, time_s: &[f64], scale: &Scale) -> Vec<Vec<f64>> {
        let column = |of: &dyn Fn(f64) -> f64| time_s.iter().map(|&time_s| of(time_s)).collect();
        match *self {
            Self::Sine(log) => {
                let turn = TAU * log.exp();
                vec![column(&|time_s| (turn * time_s).cos()), column(&|time_s| (turn * time_s).sin())]
            }
            Self::Ramp => vec![column(&|time_s| time_s / scale.duration_s)],
            Self::Step(from_s) => vec![column(&|time_s| f64::from(u8::from(time_s >= from_s)))],
        }
    }

    /// Returns the number of amplitudes.
    pub fn amplitudes(&self) -> usize {
        if matches!(self, Self::Sine(_)) { 2 } else { 1 }
    }
}
