//! Where in frequency a residual is strong.

use std::f64::consts::TAU;

use crate::record::data::Data;
use crate::stats::periodogram;
use crate::stats::sums::dot;

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

/// What comes back less often in a record may be the schedule's, through another law of the spring.
pub const FEWEST_PERIODS: usize = 10;
/// Rows between which an oscillation is turned.
const TURNS: usize = 64;

/// Shorter records have no lines.
const ROWS: usize = 16;
/// Neighbours of a line to each side, in widths of a line.
const NEIGHBOURS: usize = 16;

/// Power in bins, and how many of them a line is wide.
fn powers(residual: &[f64], data: &Data) -> (Vec<f64>, usize) {
    let mut power = periodogram::powers(&on_a_grid(residual, data));
    power.pop();
    let width = 2 * power.len() / residual.len();
    (power, width)
}

/// A line beside its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// In Hz.
    pub frequency_hz: f64,
    /// How many times as strong as its neighbours it is. In noise, however coloured, that is exponential: 20 times is one
    /// chance in 1e8.
    pub alone: f64,
    /// Its part of the square.
    pub share: f64,
}

/// The line that stands most alone, of those that come back often enough in the record.
pub fn loneliest(residual: &[f64], data: &Data) -> Option<Line> {
    if residual.len() < ROWS {
        return None;
    }
    let (power, width) = powers(residual, data);
    let mut before = vec![0.0];
    before.extend(power.iter().scan(0.0, |sum, power| {
        *sum += power;
        Some(*sum)
    }));
    let sum = |from: usize, to: usize| (before[to] - before[from], (to - from) as f64);
    let alone = |bin: usize| {
        let reach = |widths: usize| (bin.saturating_sub(widths * width), (bin + widths * width).min(power.len()));
        let ((from, to), (own_from, own_to)) = (reach(NEIGHBOURS), reach(2));
        let (left, right) = (sum(from, own_from), sum(own_to, to));
        power[bin] * (left.1 + right.1) / (left.0 + right.0).max(f64::MIN_POSITIVE)
    };
    let (bin, alone) =
        (FEWEST_PERIODS * width..power.len()).map(|bin| (bin, alone(bin))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let share = 2.0 * power[bin] / (residual.len() as f64 * dot(residual, residual)).max(f64::MIN_POSITIVE);
    Some(Line { frequency_hz: bin as f64 / (2.0 * power.len() as f64 * data.sample_s), alone, share })
}

/// The strongest lines, one at a time: each is taken off before the next is looked for.
pub fn peaks(residual: &[f64], data: &Data, count: usize) -> Vec<Peak> {
    if residual.len() < ROWS {
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

/// Readings by index where rows are regular, else each at the grid's nearest moment.
fn on_a_grid(residual: &[f64], data: &Data) -> Vec<f64> {
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
    use crate::record::data::Input;
    use simulation::record::{Record, Row};

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
