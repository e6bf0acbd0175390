//! Where in frequency a residual is strong.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::data::Data;

/// A line in the spectrum: `cosine cos(2 pi f t) + sine sin(2 pi f t)`, t from the first reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// In Hz.
    pub frequency_hz: f64,
    /// In V.
    pub cosine: f64,
    /// In V.
    pub sine: f64,
}

/// Rows between which an oscillation is turned.
const TURNS: usize = 64;

/// The strongest lines, one at a time: each is taken off before the next is looked for.
pub fn peaks(residual: &[f64], data: &Data, count: usize) -> Vec<Peak> {
    let rows = residual.len();
    if rows < 16 {
        return Vec::new();
    }
    // Finer than the record's own resolution, so that a line between two bins is not missed.
    let length = (2 * rows).next_power_of_two();
    let mut buffer: Vec<Complex<f64>> = on_a_grid(residual, data);
    buffer.resize(length, Complex::default());
    FftPlanner::new().plan_fft_forward(length).process(&mut buffer);
    let mut power: Vec<f64> = buffer[..length / 2].iter().map(Complex::norm_sqr).collect();
    let width = length / rows;
    let mut found = Vec::new();
    for _ in 0..count {
        let Some((bin, _)) = power.iter().enumerate().skip(width).max_by(|a, b| a.1.total_cmp(b.1)) else { break };
        let frequency_hz = bin as f64 / (length as f64 * data.sample_s);
        found.push(line(residual, data, frequency_hz));
        for near in bin.saturating_sub(2 * width)..(bin + 2 * width).min(power.len()) {
            power[near] = 0.0;
        }
    }
    found
}

/// Readings by index where rows are regular, else each at the grid's nearest moment.
fn on_a_grid(residual: &[f64], data: &Data) -> Vec<Complex<f64>> {
    let start = data.time_s.first().copied().unwrap_or(0.0);
    let mut grid = vec![Complex::default(); residual.len()];
    for (value, time) in residual.iter().zip(&data.time_s) {
        let at = ((time - start) / data.sample_s).round() as usize;
        if let Some(cell) = grid.get_mut(at) {
            cell.re = *value;
        }
    }
    grid
}

/// Sine and cosine of a frequency at each row, from the first reading. Between equal steps of time they are turned, which is
/// cheaper than computing them; now and then they are computed anew, before rounding shows.
pub fn oscillation(frequency_hz: f64, data: &Data) -> impl Iterator<Item = (f64, f64)> {
    let start = data.time_s.first().copied().unwrap_or(0.0);
    let omega = TAU * frequency_hz;
    let (mut before, mut step, mut turn, mut now) = (start, f64::NAN, (0.0, 1.0), (0.0, 1.0));
    data.time_s.iter().enumerate().map(move |(row, &time)| {
        let since = time - before;
        before = time;
        let steady = (since - step).abs() < 1e-9 * step;
        if !steady {
            step = since;
            turn = (omega * step).sin_cos();
        }
        now = if steady && row % TURNS != 0 {
            (now.0 * turn.1 + now.1 * turn.0, now.1 * turn.1 - now.0 * turn.0)
        } else {
            (omega * (time - start)).sin_cos()
        };
        now
    })
}

/// Cosine and sine at one frequency by least squares, taken as orthogonal.
fn line(residual: &[f64], data: &Data, frequency_hz: f64) -> Peak {
    let (mut cosine, mut sine) = (0.0, 0.0);
    for (value, (s, c)) in residual.iter().zip(oscillation(frequency_hz, data)) {
        cosine += value * c;
        sine += value * s;
    }
    let half = residual.len() as f64 / 2.0;
    Peak { frequency_hz, cosine: cosine / half, sine: sine / half }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::data::Input;
    use crate::record::{Record, Row};

    #[test]
    fn a_turned_oscillation_is_the_computed_one() {
        for jitter in [0.0, 0.3] {
            let time = |row: usize| 5.0 + 0.01 * (row as f64 + jitter * ((row * row % 7) as f64 / 7.0));
            let row = |row: usize| Row { line: row, time_s: time(row), voltage_v: 0.0, measured: Some(0.0) };
            let record = Record { name: String::new(), rows: (0..20_000).map(row).collect() };
            let data = Data::new(&record, Input::Hold);
            for (row, (sin, cos)) in oscillation(7.3, &data).enumerate() {
                let exact = (TAU * 7.3 * (time(row) - time(0))).sin_cos();
                assert!((sin - exact.0).hypot(cos - exact.1) < 1e-8, "{row}: {sin} {cos} {exact:?}");
            }
        }
    }
}
