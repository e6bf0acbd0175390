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

/// Smallest determinant of cosine and sine in some rows, relative to the square of their sum, with which both are determined.
const LEAST_INDEPENDENT: f64 = 1e-9;

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

/// Sums over rows of a residual with the cosine and the sine, and of the squares of these and their product.
#[derive(Clone, Copy, Default)]
struct Sums {
    with: [f64; 2],
    squares: [f64; 2],
    product: f64,
}

impl Sums {
    /// Sums with one row more; one that is NaN adds nothing.
    fn and(mut self, left: f64, turn: [f64; 2]) -> Self {
        if left.is_nan() {
            return self;
        }
        for (k, of) in turn.into_iter().enumerate() {
            self.with[k] += left * of;
            self.squares[k] += of * of;
        }
        self.product += turn[0] * turn[1];
        self
    }

    /// Sums over the rows after those of others.
    fn after(self, before: Self) -> Self {
        let less = |k: usize| (self.with[k] - before.with[k], self.squares[k] - before.squares[k]);
        let [cosine, sine] = [less(0), less(1)];
        Self { with: [cosine.0, sine.0], squares: [cosine.1, sine.1], product: self.product - before.product }
    }

    /// The amplitudes of cosine and sine that reduce the squared residual most, by least squares: near an end of a stretch a row counts by
    /// what the sine is there, not by its mean square.
    fn amplitudes(&self) -> [f64; 2] {
        let ([cosine, sine], [of_cosine, of_sine]) = (self.with, self.squares);
        let sum = of_cosine + of_sine;
        let determinant = of_cosine * of_sine - self.product * self.product;
        if determinant > LEAST_INDEPENDENT * sum * sum {
            [of_sine * cosine - self.product * sine, of_cosine * sine - self.product * cosine]
                .map(|of| of / determinant)
        } else {
            self.with.map(|of| of / sum.max(f64::MIN_POSITIVE))
        }
    }

    /// Reduction of the squared residual, in V^2.
    fn gain(&self) -> f64 {
        dot(&self.amplitudes(), &self.with)
    }
}

/// Returns the stretch in which a sine of a frequency reduces the squared residual most; rows that are NaN do not count. `None` if it is
/// too short, or the whole record.
pub(super) fn stretch(residual: &[f64], data: &Data, frequency_hz: f64) -> Option<Stretch> {
    let mut sums = vec![Sums::default()];
    for (left, (sin, cos)) in residual.iter().zip(spectrum::oscillation(frequency_hz, data)) {
        sums.push(sums[sums.len() - 1].and(*left, [cos, sin]));
    }
    let rows = residual.len();
    let fewest = (FEWEST_PERIODS / (frequency_hz * data.sample_s)).ceil() as usize;
    let over = |from: usize, to: usize| sums[to].after(sums[from]);
    let gain =
        |&(from, to): &(usize, usize)| if to < from + fewest { f64::NEG_INFINITY } else { over(from, to).gain() };
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
    let whole = (from, to) == (0, rows);
    (gain(&found) > 0.0 && !whole).then(|| Stretch { rows: from..to, amplitudes: over(from, to).amplitudes() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    /// Rows at the ends where the sine is small are its rows as well, and those at its peaks are none beyond the ends.
    #[test]
    fn the_ends_of_a_stretch_are_found_to_the_row_whatever_the_phase() {
        let rows = 500;
        let row = |row: usize| Row { line: 0, time_s: 0.01 * row as f64, voltage_v: 0.0, measured: Some(0.0) };
        let data = Data::new(&Record { name: String::new(), rows: (0..rows).map(row).collect() }, Input::Hold);
        for (frequency_hz, stretched) in [(16.1, 130..410), (6.3, 51..300), (23.0, 200..260), (11.7, 240..447)] {
            for tenth in 0..10 {
                let (sine, cosine) = (0.628 * f64::from(tenth)).sin_cos();
                let mut residual = vec![0.0; rows];
                for (row, (sin, cos)) in spectrum::oscillation(frequency_hz, &data).enumerate() {
                    if stretched.contains(&row) {
                        residual[row] = cosine * cos + sine * sin;
                    }
                }
                let found = stretch(&residual, &data, frequency_hz).unwrap();
                // A row without a sine is on either side.
                let with = |rows: Range<usize>| {
                    let is_in = |row: &usize| residual[*row].abs() > 1e-3;
                    (rows.clone().find(is_in), rows.rev().find(is_in))
                };
                assert_eq!(with(found.rows.clone()), with(stretched.clone()), "{frequency_hz} {tenth}");
                assert!(found.rows.len() <= stretched.len() + 2, "{frequency_hz} {tenth}: {:?}", found.rows);
                assert!((found.amplitudes[0] - cosine).abs() < 0.01, "{frequency_hz} {tenth}");
                assert!((found.amplitudes[1] - sine).abs() < 0.01, "{frequency_hz} {tenth}");
            }
        }
    }
}
