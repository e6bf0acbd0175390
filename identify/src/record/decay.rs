//! Detection of a spring that is not at rest when its record begins: its readings decay before the first voltage.

use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::stats::scale::{robust_scale, second_differences};
use crate::stats::thresholds::empirical::{
    FEWEST_ROWS_AT_REST, FEWEST_ROWS_OF_REST, LARGEST_CORRELATION, SHORT_REST, SIGNIFICANT_DECAY,
};

/// Time constants of the decays that are tried, relative to the expected one.
const DECAY_TIMES: [f64; 3] = [0.5, 1.0, 2.0];
/// Longest time constant of a decay that readings at rest can show, in lengths of the rest.
const LONGEST_DECAY: f64 = 2.0;

/// Returns true if the readings before the first voltage contain an exponential decay from an earlier stiffness; where
/// the rest is too short to show a decay, if the readings differ from `zero`.
pub(super) fn relaxes_from_earlier_input(time_s: &[f64], voltage_v: &[f64], reading: &[f64], zero: f64) -> bool {
    let rest = rows_before_voltage(voltage_v);
    if rest == 0 {
        return false;
    }
    let tau_s = REFERENCE_TIME_CONSTANT_S;
    let short = rest < FEWEST_ROWS_AT_REST.count() || time_s[rest - 1] - time_s[0] < SHORT_REST.get() * tau_s;
    decays(&time_s[..rest], reading, short.then_some(zero), DECAY_TIMES.iter().map(|times| times * tau_s))
}

/// Returns true if there are readings enough before the first voltage and none of them shows a decay. A decay so slow that they cannot
/// show it may remain.
pub(crate) fn starts_at_rest(time: &[f64], voltage: &[f64], reading: &[f64]) -> bool {
    let rest = rows_before_voltage(voltage);
    if rest < FEWEST_ROWS_OF_REST.count() {
        return false;
    }
    let length = time[rest - 1] - time[0];
    let halves = std::iter::successors(Some(LONGEST_DECAY * length), |tau| Some(0.5 * tau));
    !decays(&time[..rest], reading, None, halves.take_while(|tau| *tau > length / rest as f64))
}

fn rows_before_voltage(voltage: &[f64]) -> usize {
    voltage.iter().take_while(|voltage| **voltage == 0.0).count()
}

/// Returns true if the first readings, one for each of `time`, contain an exponential decay with about one of the time constants, to
/// `zero` or, without one, to any value.
fn decays(time: &[f64], reading: &[f64], zero: Option<f64>, mut time_constants: impl Iterator<Item = f64>) -> bool {
    let at_rest = &reading[..time.len()];
    let from_row_to_row = robust_scale(&second_differences(reading).collect::<Vec<_>>());
    // Least squares on the decay, and on a constant where the two can be distinguished.
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let falls = |tau: f64| {
        let decay: Vec<f64> = time.iter().map(|at| (-(at - time[0]) / tau).exp()).collect();
        let (mean_decay, mean_reading) = zero.map_or_else(|| (mean(&decay), mean(at_rest)), |zero| (0.0, zero));
        let pairs = || decay.iter().zip(at_rest).map(|(decay, reading)| (decay - mean_decay, reading - mean_reading));
        let power: f64 = pairs().map(|(decay, _)| decay * decay).sum();
        let height = pairs().map(|(decay, reading)| decay * reading).sum::<f64>() / power;
        let left: Vec<f64> = pairs().map(|(decay, reading)| reading - height * decay).collect();
        height.abs() * power.sqrt() > SIGNIFICANT_DECAY.get() * from_row_to_row.max(scaled_deviation_of_sum(&left))
    };
    time_constants.any(falls)
}

/// Returns the standard deviation of the sum of autocorrelated noise over `n` rows, divided by `sqrt(n)`: `sigma
/// sqrt((1 + rho) / (1 - rho))` for a first-order autoregression with lag-1 correlation `rho`.
fn scaled_deviation_of_sum(noise: &[f64]) -> f64 {
    let power: f64 = noise.iter().map(|value| value * value).sum();
    let memory = noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / power.max(f64::MIN_POSITIVE);
    let memory = memory.clamp(0.0, LARGEST_CORRELATION.get());
    (power / noise.len() as f64 * (1.0 + memory) / (1.0 - memory)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::starts_at_rest;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// Autocorrelated noise is not taken for a decay; a decay faster or slower than the paper's time constant is
    /// recognised.
    #[test]
    fn autocorrelated_noise_is_not_taken_for_a_decay() {
        let record = |row: &dyn Fn(f64, f64) -> f64, at_rest: usize, seed: usize| {
            let noise = normals(3000 + seed).split_off(seed);
            let remembered = noise.iter().scan(0.0, |last, noise| {
                *last = 0.9 * *last + noise;
                Some(*last)
            });
            let rows = remembered.zip(&noise).enumerate().map(|(index, (slow, quick))| {
                let time_s = 0.1 * index as f64;
                let voltage_v = if index < at_rest { 0.0 } else { 300.0 };
                Row {
                    line: 0,
                    time_s,
                    voltage_v,
                    measured: Some(row(time_s, if seed.is_multiple_of(2) { slow } else { *quick })),
                }
            });
            Data::new(&Record { name: String::new(), rows: rows.collect() }, Input::Hold).initial_state_unknown
        };
        // In 1.5 s the spring hardly relaxes, so slow noise may be taken for a decay in up to 20 % of the records.
        for (at_rest, most) in [(60, 3), (16, 20)] {
            let mistaken = (0..100).filter(|seed| record(&|_, noise| noise, at_rest, *seed)).count();
            assert!(mistaken < most, "{at_rest} rows: {mistaken} of 100");
            for tau_s in [2.0, 3.5, 8.0, 15.0] {
                let decay = |time: f64, noise| 60.0 * (-time / tau_s).exp() + noise;
                let falls = (0..100).filter(|seed| record(&decay, at_rest, *seed));
                assert!(falls.count() > 90, "{at_rest} rows, {tau_s} s");
            }
        }
    }

    #[test]
    fn readings_without_a_decay_show_a_rest_whatever_the_unit_of_time() {
        let noise = normals(400);
        let starts = |rest: usize, tau: f64, second: f64| {
            let time: Vec<f64> = (0..400).map(|row| second * row as f64).collect();
            let voltage: Vec<f64> = (0..400).map(|row| if row < rest { 0.0 } else { 1.0 }).collect();
            let decay = |row: usize| if tau > 0.0 { 40.0 * (-(row as f64) / tau).exp() } else { 0.0 };
            let reading: Vec<f64> = (0..400).map(|row| 7.0 + decay(row) + noise[row]).collect();
            starts_at_rest(&time, &voltage, &reading)
        };
        for second in [1e-6, 1.0, 3600.0] {
            assert!(starts(60, 0.0, second) && starts(12, 0.0, second) && !starts(6, 0.0, second));
            for tau in [3.0, 10.0, 30.0, 120.0] {
                assert!(!starts(60, tau, second), "{tau} rows");
            }
        }
    }
}
