//! Amplitudes of a periodic disturbance that change over the record.
//!
//! | envelope | amplitudes of cosine and sine |
//! | --- | --- |
//! | varying | straight between [`KNOTS`] equally spaced times: amplitude and phase change slowly |
//! | by the response | a polynomial of the response with [`POWERS`] terms |
//! | stretch | constant in one stretch of rows, 0 in all others: what causes it is switched |

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::record::data::Data;
use crate::record::spectrum;
use crate::stats::sums::dot;

/// Number of times at which a varying envelope has amplitudes of its own.
pub(super) const KNOTS: usize = 9;
/// Number of terms of an amplitude that depends on the response: constant, straight, square.
pub(super) const POWERS: usize = 3;
/// Fewest periods in a stretch.
const FEWEST_PERIODS: f64 = 5.0;
/// Number of equal parts of the record at whose boundaries a stretch is looked for first.
const PARTS: usize = 64;
/// Number of times that both ends are then moved to their best row.
const ROUNDS: usize = 2;

/// Weights of consecutive amplitudes in one row, and the number of the first of these.
pub(super) type Weights<const W: usize> = (usize, [f64; W]);

/// Returns the weights of the knots in each row.
pub(super) fn over_time(data: &Data) -> impl Iterator<Item = Weights<2>> {
    let (start, per_s) = (data.time_s[0], (KNOTS - 1) as f64 / data.duration_s().max(f64::MIN_POSITIVE));
    data.time_s.iter().map(move |time| {
        let at = (time - start) * per_s;
        let before = (at as usize).min(KNOTS - 2);
        let part = at - before as f64;
        (before, [1.0 - part, part])
    })
}

/// Returns the weights of constant, straight and square amplitude at a response, in V, relative to the full scale.
pub(super) fn at_response(response_v: f64, data: &Data) -> Weights<POWERS> {
    let relative = response_v / data.full_scale_v;
    (0, [1.0, relative, relative * relative])
}

/// Returns these weights at the reading of each row.
pub(super) fn over_response(data: &Data) -> impl Iterator<Item = Weights<POWERS>> {
    data.reading.iter().map(|reading| at_response(*reading, data))
}

/// Returns cosine and sine amplitude of a row, in V, from those of all weights in turn.
pub(super) fn at<const W: usize>(amplitudes: &[f64], (first, weights): Weights<W>) -> [f64; 2] {
    let of = amplitudes[2 * first..].chunks_exact(2).zip(weights);
    of.fold([0.0; 2], |[cosine, sine], (of, weight)| [cosine + weight * of[0], sine + weight * of[1]])
}

/// Returns the amplitudes of `count` weights, in V, which reduce the squared residual most, after the reduction, in V^2; `None` if the
/// rows do not determine them.
pub(super) fn fitted<const W: usize>(
    residual: &[f64],
    data: &Data,
    frequency_hz: f64,
    count: usize,
    rows: impl Iterator<Item = Weights<W>>,
) -> Option<(f64, Vec<f64>)> {
    let mut normal = DMatrix::zeros(2 * count, 2 * count);
    let mut product = DVector::zeros(2 * count);
    for ((left, (sin, cos)), (first, weights)) in
        residual.iter().zip(spectrum::oscillation(frequency_hz, data)).zip(rows)
    {
        let of = |i: usize| weights[i / 2] * [cos, sin][i % 2];
        for i in 0..2 * W {
            product[2 * first + i] += of(i) * left;
            (0..=i).for_each(|j| normal[(2 * first + i, 2 * first + j)] += of(i) * of(j));
        }
    }
    // The Cholesky decomposition reads the lower triangle only.
    let amplitudes = normal.cholesky()?.solve(&product);
    Some((amplitudes.dot(&product), amplitudes.as_slice().to_vec()))
}

/// Returns the root mean square of the amplitude over the rows, in V.
pub(super) fn mean<const W: usize>(amplitudes: &[f64], rows: impl Iterator<Item = Weights<W>>) -> f64 {
    let squares = rows.map(|weights| {
        let of = at(amplitudes, weights);
        dot(&of, &of)
    });
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// A sine in one stretch of rows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) rows: Range<usize>,
    /// Amplitudes of cosine and sine, in V.
    pub(super) amplitudes: [f64; 2],
}

/// Returns the stretch in which a sine of a frequency reduces the squared residual most, with sine and cosine taken as orthogonal; rows
/// that are NaN do not count. `None` if it is too short, or the whole record.
pub(super) fn stretch(residual: &[f64], data: &Data, frequency_hz: f64) -> Option<Stretch> {
    let mut sums = vec![(0.0, 0.0)];
    let (mut cosine, mut sine) = (0.0, 0.0);
    for (left, (sin, cos)) in residual.iter().zip(spectrum::oscillation(frequency_hz, data)) {
        let left = if left.is_nan() { 0.0 } else { *left };
        (cosine, sine) = (cosine + left * cos, sine + left * sin);
        sums.push((cosine, sine));
    }
    let rows = residual.len();
    let fewest = (FEWEST_PERIODS / (frequency_hz * data.sample_s)).ceil() as usize;
    let over = |from: usize, to: usize| [sums[to].0 - sums[from].0, sums[to].1 - sums[from].1];
    let gain = |&(from, to): &(usize, usize)| {
        let of = over(from, to);
        if to < from + fewest { f64::NEG_INFINITY } else { dot(&of, &of) / (to - from) as f64 }
    };
    let best = |ends: &mut dyn Iterator<Item = (usize, usize)>| ends.max_by(|a, b| gain(a).total_cmp(&gain(b)));
    let cut = |part: usize| part * rows / PARTS;
    let mut coarse = (0..PARTS).flat_map(|from| (from + 1..=PARTS).map(move |to| (cut(from), cut(to))));
    let mut found = best(&mut coarse)?;
    for _ in 0..ROUNDS {
        let near = |row: usize| row.saturating_sub(cut(1))..=(row + cut(1)).min(rows);
        found = best(&mut near(found.0).map(|from| (from, found.1)).filter(|(from, to)| from < to))?;
        found = best(&mut near(found.1).map(|to| (found.0, to)).filter(|(from, to)| from < to))?;
    }
    let (from, to) = found;
    let half = (to - from) as f64 / 2.0;
    let whole = (from, to) == (0, rows);
    (gain(&found) > 0.0 && !whole).then(|| Stretch { rows: from..to, amplitudes: over(from, to).map(|sum| sum / half) })
}
