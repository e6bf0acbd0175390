//! Dynamic operators: lags whose time constant varies, a second order of any damping, and creep as a power of the time.

use crate::equation::scale::Scale;
use crate::record::signal::{Lag, Oscillator, Piece, Signal};

/// What the time constant of a lag depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// The direction: `tau exp(a sign(input - state))`.
    Direction,
    /// The state: `tau exp(a state / full scale)`.
    State,
    /// The input: `tau (1 + a input / full scale)`, at least a twentieth of `tau`.
    Input,
    /// The distance that is left, as in Eyring's law of flow: `tau z / sinh(z)` with `z = a (input - state) / full scale`, and the
    /// reciprocal of that factor for a negative `a`.
    Distance,
}

/// Smallest factor on the time constant of a lag that depends on its input.
const LEAST_FACTOR: f64 = 0.05;
/// Largest exponent of a factor on the time constant.
const MOST_EXPONENT: f64 = 5.0;
/// Ratio of neighbouring time constants of a creep: their sum departs from a power by less than a percent.
const CREEP_RATIO: f64 = 3.0;

/// Passes a signal through a lag of unit gain, from rest at the signal's first value.
pub(super) fn lag(signal: &mut Signal, tau_s: f64) {
    let mut lag = Lag::at(tau_s, signal.before);
    signal.pass(|piece| lag.pass(piece));
}

/// Passes a signal through a lag of unit gain whose time constant varies, from rest at the signal's first value; the time constant
/// is taken as constant within a piece.
pub(super) fn varying(signal: &mut Signal, tau_s: f64, by: By, a: f64, scale: &Scale) {
    let mut state = signal.before;
    let part = |value: f64| value / scale.full_v;
    signal.pass(|Piece { duration_s, from, to }| {
        let before = state;
        if duration_s > 0.0 {
            let input = 0.5 * (from + to);
            let exponent = match by {
                By::Direction => a * (input - state).signum(),
                By::State => a * part(state),
                By::Distance => -a.signum() * ln_sinh_ratio(a * part(input - state)),
                By::Input => (1.0 + a * part(input)).max(LEAST_FACTOR).ln(),
            };
            let tau_s = tau_s * exponent.clamp(-MOST_EXPONENT, MOST_EXPONENT).exp();
            let kept = (-duration_s / tau_s).exp();
            let slope = (to - from) / duration_s;
            state = to - tau_s * slope + (state - from + tau_s * slope) * kept;
        }
        (before, state)
    });
}

/// Returns `ln(sinh(z) / z)`.
fn ln_sinh_ratio(z: f64) -> f64 {
    let size = z.abs();
    match size {
        ..1e-3 => size * size / 6.0,
        ..20.0 => (size.sinh() / size).ln(),
        _ => size - (2.0 * size).ln(),
    }
}

/// Passes a signal through a second order of unit gain with an undamped frequency in Hz and any damping ratio.
pub(super) fn second(signal: &mut Signal, freq_hz: f64, zeta: f64) {
    let omega = std::f64::consts::TAU * freq_hz;
    if zeta < 1.0 {
        let mut oscillator = Oscillator::at(omega, zeta, signal.before, 0.0);
        signal.pass(|piece| oscillator.pass(piece));
        return;
    }
    let slow = (zeta + (zeta * zeta - 1.0).sqrt()) / omega;
    lag(signal, slow);
    lag(signal, 1.0 / (omega * omega * slow));
}

/// Passes a signal through a creep that grows as a power of the time: lags from the spacing of the rows to the length of the
/// record, in geometric order, with weights `tau^power` that sum to 1; a power of 0 is logarithmic creep.
pub(super) fn creep(signal: &mut Signal, power: f64, scale: &Scale) {
    let taus = scale.creep_taus(CREEP_RATIO);
    let weights: Vec<f64> = taus.iter().map(|tau_s| (tau_s / scale.duration_s).powf(power)).collect();
    let sum: f64 = weights.iter().sum();
    let mut lags: Vec<(f64, Lag)> =
        taus.iter().zip(&weights).map(|(&tau_s, weight)| (weight / sum, Lag::at(tau_s, signal.before))).collect();
    signal.pass(|piece| {
        let each = lags.iter_mut().map(|(weight, lag)| {
            let (from, to) = lag.pass(piece);
            (*weight * from, *weight * to)
        });
        each.fold((0.0, 0.0), |sum, each| (sum.0 + each.0, sum.1 + each.1))
    });
}
