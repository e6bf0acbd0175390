//! Where an error is largest: the stretch of time, and the voltages, whose mean square is above the record's.
//!
//! ```text
//! max over stretches of sum(e^2 - mean(e^2))        (Bentley, Communications of the ACM 27, 1984: Kadane's algorithm)
//! ```

use std::ops::Range;

use crate::record::data::Data;
use crate::stats::sums::dot;

/// Voltages that hold more than this part of the power, and more densely than the stretch of time does, are named beside it.
const MOST: f64 = 0.5;

/// In words that follow what the error looks like.
pub(crate) fn whereabouts(data: &Data, errors: &[f64]) -> String {
    let power = dot(errors, errors).max(f64::MIN_POSITIVE);
    let part = |rows: usize| rows as f64 / errors.len() as f64;
    let at_once: Vec<(f64, usize)> = errors.iter().map(|error| (error * error / power, 1)).collect();
    let (run, share, rows) = densest(&at_once);
    let decimals = (-(1.001 * data.sample_s).log10().floor()).clamp(0.0, 9.0) as usize;
    let [from, to] = [run.start, run.end - 1].map(|row| format!("{:.decimals$}", data.time_s[row]));
    let [percent, of_time] = [share, part(rows)].map(|part| 100.0 * part);
    let mut words = format!(", {percent:.0} % of it from {from} s to {to} s, in {of_time:.0} % of the readings");

    let mut by_voltage: Vec<(f64, f64)> =
        data.voltage_v.iter().zip(&at_once).map(|(voltage, (square, _))| (voltage.abs(), *square)).collect();
    by_voltage.sort_by(|a, b| a.0.total_cmp(&b.0));
    let levels: Vec<&[(f64, f64)]> = by_voltage.chunk_by(|a, b| a.0 == b.0).collect();
    let of_levels: Vec<(f64, usize)> =
        levels.iter().map(|level| (level.iter().map(|row| row.1).sum(), level.len())).collect();
    let (run, at_voltages, there) = densest(&of_levels);
    if at_voltages > MOST && at_voltages / part(there) > share / part(rows) {
        let [low, high] = [run.start, run.end - 1].map(|level| levels[level][0].0);
        words += &format!(", and {:.0} % at voltages from {low:.0} V to {high:.0} V", 100.0 * at_voltages);
    }
    words
}

/// Of neighbours, each with its part of the power and its rows, those that hold most beyond their rows' share of it; their
/// part of the power, and their rows.
fn densest(parts: &[(f64, usize)]) -> (Range<usize>, f64, usize) {
    let rows: usize = parts.iter().map(|part| part.1).sum();
    let (mut best, mut best_sum) = (0..1, f64::NEG_INFINITY);
    let (mut from, mut sum) = (0, 0.0);
    for (place, &(power, count)) in parts.iter().enumerate() {
        if sum < 0.0 {
            (from, sum) = (place, 0.0);
        }
        sum += power - count as f64 / rows as f64;
        if sum > best_sum {
            (best, best_sum) = (from..place + 1, sum);
        }
    }
    let inside = &parts[best.clone()];
    (best, inside.iter().map(|part| part.0).sum(), inside.iter().map(|part| part.1).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::data::Input;
    use simulation::record::{Record, Row};

    #[test]
    fn a_burst_is_found_in_time_and_at_its_voltage() {
        // Levels of 100 rows, 0.1 s apart; each comes twice.
        let volts = |row: usize| 100.0 * (row / 100 % 5) as f64;
        let row = |row: usize| Row { line: row, time_s: 0.1 * row as f64, voltage_v: volts(row), measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..1000).map(row).collect() };
        let data = Data::new(&record, Input::Hold);
        let told = |large: &dyn Fn(usize) -> bool| {
            whereabouts(&data, &(0..1000).map(|row| if large(row) { 9.0 } else { 1.0 }).collect::<Vec<_>>())
        };
        assert_eq!(
            told(&|row| (420..450).contains(&row)),
            ", 71 % of it from 42.0 s to 44.9 s, in 3 % of the readings"
        );
        let at_300 = told(&|row| volts(row) == 300.0);
        assert!(at_300.ends_with(", and 95 % at voltages from 300 V to 300 V"), "{at_300}");
    }
}
