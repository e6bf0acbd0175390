//! Columns that a general law of the spring could respond to: functions of the present and earlier voltages, of the simulated
//! response to them, and of time.
//!
//! With the voltage `u` relative to the full scale, its first-order lags `x_k` at multiples of the nominal time constant, the
//! simulated response `y` relative to its largest magnitude, and the relative time `s` from 0 to 1:
//!
//! | group | columns |
//! | --- | --- |
//! | earlier voltages | `u`, `x_k`, and the lags of the voltage's absolute changes |
//! | levels | powers and products of `u` and `x_k`; triangles over the range of `u` and of the nominal lag `x` |
//! | levels of the response | powers of `y`; triangles over its range; powers and products of `y` and `v = y - lag(y)` |
//! | direction | `play(u) - u` and `play(x) - x` at five widths; `|d|`, `d |d|`, `d^3` of the difference `d = u - x` |
//! | ageing | `u` and `x` times `s`, `s^2` and `ln(1 + 9 s)`; the sensitivity of `x` to its time constant, times `s`, `s^2` and `s^3` |

use crate::record::data::Data;
use crate::record::signal::{Lag, Piece};
use crate::stats::scale::largest_magnitude;

/// Time constants of the lags, in nominal time constants.
const LAGS: [f64; 7] = [1.0 / 16.0, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0];
/// Number of lags of the absolute changes, the quickest first.
const LAGS_OF_CHANGES: usize = 5;
/// Lags shorter than this are the voltage itself, in rows.
const SHORTEST_LAG: f64 = 1.5;
/// Lags longer than this cannot be distinguished in the record, in durations of the record.
const LONGEST_LAG: f64 = 2.0;
/// Half widths of the plays, in full scales.
const PLAYS: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.4];
/// Number of intervals into which triangles divide a range.
const TRIANGLES: usize = 8;

/// One column of values, one for each row, and the words for its group that follow "it shows".
pub(super) struct Column {
    pub(super) group: &'static str,
    pub(super) values: Vec<f64>,
}

/// Returns all columns of a record whose spring has the nominal time constant `tau_s`, in s, and answers with `response`, in V,
/// one value for each row; columns may be constant.
pub(super) fn columns(data: &Data, tau_s: f64, response: &[f64]) -> Vec<Column> {
    let scale = data.full_scale_v.max(f64::MIN_POSITIVE);
    let u: Vec<f64> = data.voltage_v.iter().map(|voltage| voltage / scale).collect();
    let start = if data.initial_state_unknown { u[0] } else { 0.0 };
    let duration_s = data.duration_s();
    let taus: Vec<f64> = LAGS
        .iter()
        .map(|lag| lag * tau_s)
        .filter(|tau| *tau > SHORTEST_LAG * data.sample_s && *tau < LONGEST_LAG * duration_s)
        .collect();
    let lags: Vec<Vec<f64>> = taus.iter().map(|&tau| lagged(data, &u, tau, start)).collect();
    let x = lagged(data, &u, tau_s, start);
    let changes: Vec<f64> = (0..u.len()).map(|row| if row == 0 { 0.0 } else { (u[row] - u[row - 1]).abs() }).collect();
    let each = |of: &dyn Fn(usize) -> f64| (0..u.len()).map(of).collect::<Vec<f64>>();

    let mut columns = Vec::new();
    let mut add = |group, values| columns.push(Column { group, values });
    let earlier = "in the response to earlier voltages";
    add(earlier, u.clone());
    lags.iter().for_each(|lag| add(earlier, lag.clone()));
    taus.iter().take(LAGS_OF_CHANGES).for_each(|&tau| add(earlier, lagged(data, &changes, tau, 0.0)));
    let levels = "in the dependence on the level of the voltage";
    add(levels, each(&|row| u[row].powi(2)));
    add(levels, each(&|row| u[row].powi(3)));
    for lag in &lags {
        add(levels, each(&|row| lag[row].powi(2)));
        add(levels, each(&|row| lag[row].powi(3)));
        add(levels, each(&|row| u[row] * lag[row]));
    }
    for signal in [&u, &x] {
        triangles(signal).into_iter().for_each(|triangle| add(levels, triangle));
    }
    // The law of a spring of higher order may act between its lags, where no lag of the voltage is.
    let response_levels = "in the dependence on the level of the response";
    let largest = largest_magnitude(response).max(f64::MIN_POSITIVE);
    let y: Vec<f64> = response.iter().map(|value| value / largest).collect();
    let behind = lagged(data, &y, tau_s, y[0]);
    let v = |row: usize| y[row] - behind[row];
    triangles(&y).into_iter().for_each(|triangle| add(response_levels, triangle));
    for power in 1..=3 {
        add(response_levels, each(&|row| y[row].powi(power)));
        add(response_levels, each(&|row| v(row).powi(power)));
    }
    add(response_levels, each(&|row| y[row] * v(row)));
    add(response_levels, each(&|row| y[row].powi(2) * v(row)));
    add(response_levels, each(&|row| y[row] * v(row).powi(2)));
    add(response_levels, each(&|row| v(row).abs()));
    let direction = "in the direction and size of changes";
    for signal in [&u, &x] {
        PLAYS.iter().for_each(|&width| add(direction, play(signal, width)));
    }
    let d = |row: usize| u[row] - x[row];
    add(direction, each(&|row| d(row).abs()));
    add(direction, each(&|row| d(row).abs() * d(row)));
    add(direction, each(&|row| d(row).powi(3)));
    let ageing = "in a response that changes along the record";
    let s = |row: usize| (data.time_s[row] - data.time_s[0]) / duration_s.max(f64::MIN_POSITIVE);
    add(ageing, each(&|row| s(row) * u[row]));
    add(ageing, each(&|row| s(row) * x[row]));
    add(ageing, each(&|row| s(row).powi(2) * x[row]));
    add(ageing, each(&|row| (9.0 * s(row)).ln_1p() * x[row]));
    // The lag of the lag, less the lag: the derivative of the lag by the logarithm of its time constant.
    let slower = lagged(data, &x, tau_s, start);
    (1..=3).for_each(|power| add(ageing, each(&|row| s(row).powi(power) * (slower[row] - x[row]))));
    columns
}

/// First-order lag of values that are held between rows, from `start` on.
fn lagged(data: &Data, values: &[f64], tau_s: f64, start: f64) -> Vec<f64> {
    let mut lag = Lag::at(tau_s, start);
    let next_s = data.time_s.iter().skip(1).chain(data.time_s.last());
    let rows = values.iter().zip(data.time_s.iter().zip(next_s));
    rows.map(|(&value, (time_s, next_s))| lag.pass(Piece { duration_s: next_s - time_s, from: value, to: value }).0)
        .collect()
}

/// Triangles of height 1 over the range of `signal` and 0, each as wide as two of its [`TRIANGLES`] intervals.
fn triangles(signal: &[f64]) -> Vec<Vec<f64>> {
    let (low, high) = signal.iter().fold((0.0f64, 0.0f64), |(low, high), value| (low.min(*value), high.max(*value)));
    let width = ((high - low) / TRIANGLES as f64).max(f64::MIN_POSITIVE);
    let around = |at: f64| signal.iter().map(|value| (1.0 - ((value - at) / width).abs()).max(0.0)).collect();
    (0..=TRIANGLES).map(|corner| around(low + corner as f64 * width)).collect()
}

/// Output of a play operator of half width `width`, less its input.
fn play(values: &[f64], width: f64) -> Vec<f64> {
    let mut output = 0.0f64;
    values
        .iter()
        .map(|value| {
            output = output.clamp(value - width, value + width);
            output - value
        })
        .collect()
}
