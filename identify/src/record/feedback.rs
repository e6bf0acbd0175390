//! Whether the command of a record follows its readings: a record in feedback, where noise of the readings reaches the command.
//!
//! Each row's reading `y` and command `u` are predicted from the rows before it. What is new in both is compared by rank correlation:
//!
//! ```text
//! e(t) = y(t) - prediction from y and u before t
//! v(t) = u(t) - prediction from y and u before t          w(t) = u(t) - prediction from u before t
//! ```
//!
//! A command that follows the last reading makes `w(t + 1)` follow `e(t)`, a later one a `w` after that. One that follows the reading of
//! its own row makes `v(t)` follow `e(t)` against the sign of the gain; with its sign an instantaneous response does. (Söderström and Ljung, *Automatica* 13, 1977, on
//! detecting feedback.)
//!
//! Noise is new in every row, and so is the command that follows it. Where `w` still follows itself from row to row, the command is smooth
//! and the prediction short: such a remainder of fixed sines follows every error of the simulation, that is smooth as well, and shows no
//! feedback.

use nalgebra::{DMatrix, DVector};

use crate::stats::rank::rank_correlation;

/// Rows before a row from which it is predicted.
const ORDER: usize = 4;
/// Smallest rank correlation that shows a feedback: in the fewest rows chance reaches it once in a million.
const LEAST_CORRELATION: f64 = 0.3;
/// Largest rank correlation of what is new in the command with itself some rows later: more than a quarter of it is then old.
const MOST_OLD: f64 = 0.5;
/// Smallest number of rows in which a feedback is looked for.
const FEWEST_ROWS: usize = 300;
/// Largest number of rows after which a command follows a reading.
const LATEST: usize = 3;
/// Largest number of rows that are used, the first ones.
const MOST_ROWS: usize = 20_000;
/// Part of the rows in which a command in feedback moves: noise is in every row.
const LEAST_MOVING: f64 = 0.5;
/// Change of a command below which it is none, relative to the largest command.
const FINEST: f64 = 1e-6;

/// True if the command follows the readings, both in evenly spaced rows; the response to the command is positive.
pub(crate) fn is_in_feedback(command: &[f64], reading: &[f64]) -> bool {
    let rows = command.len().min(MOST_ROWS);
    if rows < FEWEST_ROWS {
        return false;
    }
    let (u, y) = (&command[..rows], &reading[..rows]);
    let finest = FINEST * u.iter().map(|u| u.abs()).fold(0.0, f64::max);
    let moving = u.windows(2).filter(|two| (two[1] - two[0]).abs() > finest).count();
    if (moving as f64) < LEAST_MOVING * rows as f64 {
        return false;
    }
    let [new, both] = unpredicted([y, u], &[y, u]);
    let [own] = unpredicted([u], &[u]);
    let correlation = |one: &[f64], other: &[f64]| rank_correlation(one, other) / (one.len() as f64 - 1.0).sqrt();
    let is_old = |late: usize| correlation(&own[..own.len() - late], &own[late..]).abs() > MOST_OLD;
    if (1..=ORDER).any(is_old) {
        return false;
    }
    let follows = |late: usize| correlation(&new[..new.len() - late], &own[late..]).abs() > LEAST_CORRELATION;
    (1..=LATEST).any(follows) || correlation(&new, &both) < -LEAST_CORRELATION
}

/// What the rows before each row, of all signals `from`, do not predict of each of some signals of the same length by linear regression.
fn unpredicted<const N: usize>(signals: [&[f64]; N], from: &[&[f64]]) -> [Vec<f64>; N] {
    let rows = from[0].len() - ORDER;
    let columns = 1 + ORDER * from.len();
    let before = DMatrix::from_fn(rows, columns, |row, column| match column.checked_sub(1) {
        None => 1.0,
        Some(column) => from[column / ORDER][row + ORDER - 1 - column % ORDER],
    });
    let normal = before.tr_mul(&before).svd(true, true);
    signals.map(|signal| {
        let now = DVector::from_column_slice(&signal[ORDER..]);
        // Signals that are constant, or predict each other, need not all be used.
        let part = normal.solve(&before.tr_mul(&now), 1e-12 * before.norm_squared());
        part.map_or_else(|_| signal[ORDER..].to_vec(), |part| (now - &before * part).as_slice().to_vec())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    const ROWS: usize = 2000;

    /// Readings of a lag with an instantaneous share, and its commands, which are `command(row, readings before and in it)`.
    fn record(share: f64, noise: f64, command: impl Fn(usize, &[f64]) -> f64) -> (Vec<f64>, Vec<f64>) {
        let normal = normals(ROWS);
        let (mut u, mut y, mut lag, mut slow) = (vec![0.0f64; ROWS], vec![0.0; ROWS], 0.0, 0.0);
        for row in 0..ROWS {
            slow = 0.9 * slow + noise * normal[row];
            y[row] = (1.0 - share) * lag + slow;
            u[row] = command(row, &y[..=row]);
            y[row] += share * u[row];
            lag += 0.06 * (u[row] - lag);
        }
        (u, y)
    }

    fn is_found((u, y): &(Vec<f64>, Vec<f64>)) -> bool {
        is_in_feedback(u, y)
    }

    /// A set-point that steps every 200 rows.
    fn target(row: usize) -> f64 {
        [100.0, 250.0, 30.0, 180.0, 60.0][row / 200 % 5]
    }

    #[test]
    fn a_controller_is_found_that_reads_the_same_row_or_the_one_before() {
        let error = |row: usize, y: &[f64], late: usize| y[row.saturating_sub(late)];
        for late in [0, 1, 2] {
            let loop_of = |gain: f64| {
                record(0.0, 2.0, |row, y| {
                    let past: f64 = (0..=row).map(|row| target(row) - error(row, y, late)).sum();
                    gain * (target(row) - error(row, y, late)) + 0.02 * past
                })
            };
            assert!(is_found(&loop_of(1.5)), "{late}");
        }
    }

    #[test]
    fn a_schedule_is_no_feedback_whatever_the_response() {
        let other = normals(ROWS + 7);
        let mut slow = 0.0;
        let filtered: Vec<f64> = (0..ROWS)
            .map(|row| {
                slow = 0.8 * slow + other[row + 7];
                100.0 * slow
            })
            .collect();
        for share in [0.0, 0.3, 1.0] {
            for noise in [0.001, 2.0] {
                let held = record(share, noise, |row, _| target(row));
                let random = record(share, noise, |row, _| 100.0 * other[row + 7]);
                let coloured = record(share, noise, |row, _| filtered[row]);
                let sines = record(share, noise, |row, _| {
                    100.0 + 40.0 * (0.05 * row as f64).sin() + 20.0 * (0.31 * row as f64).cos()
                });
                for (what, record) in [("held", held), ("random", random), ("coloured", coloured), ("sines", sines)] {
                    assert!(!is_found(&record), "{what}, share {share}, noise {noise}");
                }
            }
        }
    }

    /// The rows before predict a second response and a curve in part only: what is left is as smooth as the command.
    #[test]
    fn smooth_sines_beside_a_smooth_error_are_no_feedback() {
        let angles = [0.022, 0.046, 0.074, 0.106, 0.158, 0.226, 0.298, 0.374, 0.446, 0.52];
        let command = |row: usize| {
            let sines = angles.iter().enumerate().map(|(k, angle)| (angle * row as f64 + 1.7 * (k * k) as f64).sin());
            100.0 + 20.0 * sines.sum::<f64>()
        };
        for (part, curved, noise) in [(0.0, 0.0, 0.02), (0.6, 0.0, 0.0), (0.6, 0.0, 0.02), (0.3, 1.0, 0.02)] {
            let (u, mut y) = record(0.1, noise, |row, _| command(row));
            let mut second = 0.0;
            for (y, u) in y.iter_mut().zip(&u) {
                second += 0.3 * (u - second);
                *y += part * second + curved * y.max(0.0).sqrt();
            }
            assert!(!is_in_feedback(&u, &y), "{part} {curved} {noise}");
        }
    }

    /// A rate that is bounded, or a curve, is predicted by no linear regression, but by the commands before.
    #[test]
    fn an_error_of_the_simulation_is_no_feedback() {
        let other = normals(ROWS + 7);
        let (u, _) = record(0.0, 0.0, |row, _| 100.0 * other[row + 7]);
        let mut lag = 0.0;
        let curved: Vec<f64> = u
            .iter()
            .map(|u| {
                lag += 0.2 * (u.max(0.0).powi(2) - lag);
                lag
            })
            .collect();
        assert!(!is_in_feedback(&u, &curved));
    }
}
