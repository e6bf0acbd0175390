//! Underdamped oscillation after a change, with the natural frequency `w = 2 pi freq`:
//!
//! ```text
//! x'' + 2 zeta w x' + w^2 x = w^2 y        y' = y + part (x - y)
//! ```
//!
//! In one form the whole response swings (`part = 1`), in the other a part of it.

use std::f64::consts::TAU;

use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};
use crate::diagnose::signal::{Piece, Signal};

pub(super) struct Resonance;

const IN_PART: usize = 1;

/// Frequencies, in Hz, from a period of the whole record to what two samples show.
fn range(data: &Data) -> (f64, f64) {
    (1.0 / data.duration_s().max(1e-6), 0.5 / data.sample_s)
}

impl Effect for Resonance {
    fn cause(&self) -> &'static str {
        "resonance"
    }

    fn stage(&self) -> Stage {
        Stage::Relaxation
    }

    fn meaning(&self) -> &'static str {
        "it swings after a change"
    }

    fn experiment(&self) -> &'static str {
        "single steps, read at ten times the frequency in question"
    }

    fn forms(&self) -> usize {
        2
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let (lowest, highest) = range(data);
        let mut coordinates = vec![Coordinate::log(lowest, highest.max(2.0 * lowest)), Coordinate::log(1e-3, 0.95)];
        if form == IN_PART {
            coordinates.push(Coordinate::new(0.0, 1.5));
        }
        coordinates
    }

    fn starts(&self, form: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        let (lowest, highest) = range(data);
        let (from, to) = ((8.0 * lowest).ln(), (0.95 * highest).ln());
        let frequencies = (0..24).map(|part| from + (to - from) * f64::from(part) / 23.0);
        let starts = frequencies.flat_map(|freq| [0.05f64, 0.3].map(|zeta| vec![freq, zeta.ln()]));
        let in_part = |mut point: Vec<f64>| {
            point.extend((form == IN_PART).then_some(0.2));
            point
        };
        starts.map(in_part).collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("freq_hz", "Hz", point[0].exp()), Quantity::new("zeta", "", point[1].exp())]
    }

    fn places(&self, _: &Data) -> f64 {
        10f64.ln()
    }

    fn respond(&self, _: usize, point: &[f64], _: &Data, signal: &mut Signal) {
        let (omega, zeta) = (TAU * point[0].exp(), point[1].exp());
        let part = point.get(2).copied().unwrap_or(1.0);
        let (mut x, mut v) = (signal.before, 0.0);
        let mut last = f64::NAN;
        let mut step = [[1.0, 0.0], [0.0, 1.0]];
        signal.pass(|Piece { duration_s, from, to }| {
            let start = x;
            if duration_s > 0.0 {
                if (duration_s - last).abs() > 1e-9 * duration_s || last.is_nan() {
                    last = duration_s;
                    step = transition(omega, zeta, duration_s);
                }
                // Around the straight line that the oscillator would follow in the end.
                let slope = (to - from) / duration_s;
                let lag = 2.0 * zeta / omega * slope;
                let (dx, dv) = (x - (from - lag), v - slope);
                x = to - lag + step[0][0] * dx + step[0][1] * dv;
                v = slope + step[1][0] * dx + step[1][1] * dv;
            }
            (from + part * (start - from), to + part * (x - to))
        });
    }
}

/// What a free oscillation makes of displacement and speed in a time.
fn transition(omega: f64, zeta: f64, time_s: f64) -> [[f64; 2]; 2] {
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let decay = (-zeta * omega * time_s).exp();
    let (sin, cos) = (damped * time_s).sin_cos();
    let s = sin / damped;
    [[decay * (cos + zeta * omega * s), decay * s], [-decay * omega * omega * s, decay * (cos - zeta * omega * s)]]
}
