//! Rate-independent operators with memory: play, lag over the travelled distance, gain by direction.

use crate::record::signal::{Piece, Signal};

/// Replaces a part of a signal by a play operator: `(1 - part) x + part play(x)`, with half the width `radius` in V.
pub(super) fn play(signal: &mut Signal, radius: f64, part: f64) {
    let mut output = 0.0;
    signal.map(|value| {
        output = f64::clamp(output, value - radius, value + radius);
        value + part * (output - value)
    });
}

/// Replaces a part of a signal by its lag over the travelled distance, the Duhem model of Dahl and of Bouc and Wen with exponent 1:
/// `distance dz = (x - z) |dx|`.
pub(super) fn travel(signal: &mut Signal, distance: f64, part: f64) {
    let (mut last, mut state) = (signal.before, signal.before);
    signal.map(|value| {
        let change = value - last;
        if change != 0.0 {
            let (along, kept) = (distance * change.signum(), (-change.abs() / distance).exp());
            state = value - along + (state - last + along) * kept;
            last = value;
        }
        value + part * (state - value)
    });
}

/// Multiplies a signal by `1 + a` after it has risen and by `1 - a` after it has fallen.
pub(super) fn direction(signal: &mut Signal, a: f64) {
    let (mut last, mut sign) = (signal.before, 0.0);
    let mut law = |value: f64| {
        if value != last {
            (sign, last) = ((value - last).signum(), value);
        }
        value * (1.0 + a * sign)
    };
    signal.pass(|Piece { from, to, .. }| (law(from), law(to)));
}
