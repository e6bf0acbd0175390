//! The voltage goes up and down without end: what swings with it may pass for a resonance.

use std::f64::consts::{PI, TAU};

use super::{SAMPLE_S, causes, diagnosed, noise, seen_through};

/// A law whose ends and middle are where they should be: no bend of any size lessens what it leaves.
#[test]
fn a_law_like_an_s_is_no_resonance() {
    let sine = |turns: f64| 0.5 - 0.5 * (TAU * turns).cos();
    let triangle = |turns: f64| 1.0 - (2.0 * turns.fract() - 1.0).abs();
    let forms: [fn(f64) -> f64; 2] = [sine, triangle];
    for (seed, period_s, form) in [(1, 21.0, forms[0]), (2, 37.0, forms[0]), (3, 19.0, forms[1]), (4, 31.0, forms[1])] {
        let volts = (0..2000).map(|row| 500.0 * form(f64::from(row) * SAMPLE_S / period_s));
        let exact = seen_through(volts, 1.0 / 11.0, |volts| volts - 40.0 * (PI * volts / 250.0).sin());
        let noise = noise(seed, exact.len());
        let rows: Vec<_> = exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect();
        let report = diagnosed(&rows);
        assert_eq!(causes(&report), ["static-nonlinearity"], "{period_s}: {report}");
    }
}
