//! Spectral lines of a residual.

use std::f64::consts::TAU;

use crate::record::data::Data;
use crate::stats::periodogram;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{FEWEST_PERIODS, FEWEST_ROWS_FOR_LINES};

/// A sinusoid `cosine cos(2 pi f t) + sine sin(2 pi f t)`, with `t` counted from the first reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Frequency `f`, in Hz.
    pub frequency_hz: f64,
    /// Amplitude of the cosine, in V.
    pub cosine: f64,
    /// Amplitude of the sine, in V.
    pub sine: f64,
}

/// Number of rows after which the recursive oscillation is computed afresh.
const ROTATIONS: usize = 64;

/// Number of line widths on each side of a sine that are its own.
pub const OF_A_SINE: usize = 2;
/// Number of line widths on each side, beyond those that are a line's own, that count as its neighbours.
const NEIGHBOURS: usize = 14;

/// Returns the power of each frequency bin, and the width of a line in bins.
fn powers(residual: &[f64], data: &Data) -> (Vec<f64>, usize) {
    let mut power = periodogram::powers(&on_uniform_grid(residual, data));
    power.pop();
    let width = 2 * power.len() / residual.len();
    (power, width)
}

/// The spectral line with the largest power relative to its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Frequency, in Hz.
    pub frequency_hz: f64,
    /// Power relative to the mean of the neighbouring bins. For noise of any smooth spectrum it is exponentially
    /// distributed: a ratio of 20 in one bin has a probability of 2e-9.
    pub prominence: f64,
    /// Fraction of the residual's mean square, 0 to 1.
    pub share: f64,
}

/// Returns the most prominent line with at least [`FEWEST_PERIODS`] periods in the record, of which `own` line widths on each side are its
/// own; `None` for short records.
pub fn most_prominent_line(residual: &[f64], data: &Data, own: usize) -> Option<Line> {
    if residual.len() < FEWEST_ROWS_FOR_LINES.count() {
        return None;
    }
    let (power, width) = powers(residual, data);
    let mut before = vec![0.0];
    before.extend(power.iter().scan(0.0, |sum, power| {
        *sum += power;
        Some(*sum)
    }));
    let sum = |from: usize, to: usize| (before[to] - before[from], (to - from) as f64);
    let prominence = |bin: usize| {
        let reach = |widths: usize| (bin.saturating_sub(widths * width), (bin + widths * width).min(power.len()));
        let ((from, to), (own_from, own_to)) = (reach(own + NEIGHBOURS), reach(own));
        let (left, right) = (sum(from, own_from), sum(own_to, to));
        power[bin] * (left.1 + right.1) / (left.0 + right.0).max(f64::MIN_POSITIVE)
    };
    let (bin, prominence) = (FEWEST_PERIODS.count() * width..power.len())
        .map(|bin| (bin, prominence(bin)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let share = 2.0 * power[bin] / (residual.len() as f64 * dot(residual, residual)).max(f64::MIN_POSITIVE);
    Some(Line { frequency_hz: bin as f64 / (2.0 * power.len() as f64 * data.sample_s), prominence, share })
}

/// Returns the `count` strongest lines in descending order; bins around a line found are left out of the search for the
/// next.
pub fn peaks(residual: &[f64], data: &Data, count: usize) -> Vec<Peak> {
    if residual.len() < FEWEST_ROWS_FOR_LINES.count() {
        return Vec::new();
    }
    let (mut power, width) = powers(residual, data);
    let mut found = Vec::new();
    for _ in 0..count {
        let Some((bin, _)) = power.iter().enumerate().skip(width).max_by(|a, b| a.1.total_cmp(b.1)) else { break };
        let frequency_hz = bin as f64 / (2.0 * power.len() as f64 * data.sample_s);
        found.push(line(residual, data, frequency_hz));
        for near in bin.saturating_sub(2 * width)..(bin + 2 * width).min(power.len()) {
            power[near] = 0.0;
        }
    }
    found
}

/// Returns the residual on a uniform time grid, each value at the nearest grid time and 0 where there is none.
fn on_uniform_grid(residual: &[f64], data: &Data) -> Vec<f64> {
    let start = data.time_s.first().copied().unwrap_or(0.0);
    let mut grid = vec![0.0; residual.len()];
    for (value, time) in residual.iter().zip(&data.time_s) {
        let at = ((time - start) / data.sample_s).round() as usize;
        if let Some(cell) = grid.get_mut(at) {
            *cell = *value;
        }
    }
    grid
}

/// Returns sine and cosine of a frequency at each row, with time counted from the first reading. Over equal time steps
/// they are rotated, which is faster than computing them; every 64 rows they are computed afresh to limit
/// rounding errors.
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
        now = if steady && row % ROTATIONS != 0 {
            (now.0 * turn.1 + now.1 * turn.0, now.1 * turn.1 - now.0 * turn.0)
        } else {
            (omega * (time - start)).sin_cos()
        };
        now
    })
}

/// Returns the sinusoid of one frequency that fits best in least squares, with sine and cosine taken as orthogonal.
pub fn line(residual: &[f64], data: &Data, frequency_hz: f64) -> Peak {
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
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    #[test]
    fn rotated_oscillation_equals_the_computed_one() {
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
