//! Periodic sweeps, in which a static nonlinearity may be confused with a resonance.

use std::f64::consts::{PI, TAU};

use super::{SAMPLE_S, causes, diagnosed, noise, seen_through};

/// An S-shaped law that is exact at both ends and in the middle, so that a single bend does not reduce the error.
#[test]
fn an_s_shaped_nonlinearity_is_not_mistaken_for_a_resonance() {
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
