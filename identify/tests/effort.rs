//! The work of a diagnosis is bounded, whatever the record, and a stop gives the best answer so far.

use std::time::Duration;

use identify::{Effort, Options, Report, Stop, diagnose};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

const ROWS: usize = 2400;
const SAMPLE_S: f64 = 0.2;

/// A sine whose frequency rises from 2 mHz to 0.8 Hz.
fn chirp(row: usize) -> f64 {
    let time_s = SAMPLE_S * row as f64;
    250.0 + 220.0 * (std::f64::consts::TAU * (0.002 + 0.8 / (2.0 * SAMPLE_S * ROWS as f64) * time_s) * time_s).sin()
}

/// A record of a spring with the paper's time constant, whose error depends on the voltage, the slow and a fast state.
fn record(voltage_v: &[f64], pause_s: f64, error: impl Fn(f64, f64, f64) -> f64) -> Record {
    let (mut slow, mut fast, mut noise) = (voltage_v[0], voltage_v[0], Lcg32::new(9));
    let row = |(row, &voltage_v): (usize, &f64)| {
        let time_s = SAMPLE_S * row as f64 + if 2 * row > ROWS { pause_s } else { 0.0 };
        let measured = slow / 1.1 + voltage_v / 11.0 + error(voltage_v, slow, fast) + noise.uniform() - 0.5;
        slow = voltage_v + (slow - voltage_v) * f64::exp(-SAMPLE_S / 5.5);
        fast = voltage_v + (fast - voltage_v) * f64::exp(-SAMPLE_S / 0.8);
        Row { line: row + 2, time_s, voltage_v, measured: Some(measured) }
    };
    Record { name: "record".into(), rows: voltage_v.iter().enumerate().map(row).collect() }
}

/// No cause has this law.
fn strange(voltage_v: f64, slow: f64, fast: f64) -> f64 {
    0.2 * (voltage_v - slow) * (fast / 60.0).sin() + 0.0006 * (voltage_v - slow) * (fast - 300.0)
}

fn report(record: &Record, effort: Effort, stop: Stop) -> Report {
    diagnose(record, &Options { effort, stop, ..Options::default() }).unwrap()
}

#[test]
fn work_stays_within_the_effort_where_nothing_fits() {
    let mut numbers = Lcg32::new(1);
    let at_every_row: Vec<f64> = (0..ROWS).map(|_| 500.0 * numbers.uniform()).collect();
    let chirp: Vec<f64> = (0..ROWS).map(chirp).collect();
    let stairs: Vec<f64> = (0..ROWS).map(|row| 100.0 * ((row / 40 * 7) % 6) as f64).collect();
    for (voltage_v, pause_s) in [(&at_every_row, 0.0), (&chirp, 0.0), (&stairs, 0.0), (&stairs, 1e4)] {
        let found = report(&record(voltage_v, pause_s, strange), Effort::Quick, Stop::default());
        let search = &found.search;
        // The last fit may exceed it.
        assert!(search.work as f64 <= 1.02 * search.allowed as f64, "{search:?}");
        assert!(!search.finished && found.complete, "{search:?}");
        assert!(found.extended.quality.held_out_rmse <= found.baseline.held_out_rmse, "{found:?}");
    }
}

#[test]
fn the_same_work_gives_the_same_answer() {
    let voltage_v: Vec<f64> = (0..ROWS).map(chirp).collect();
    let record = record(&voltage_v, 0.0, strange);
    let [first, second] = [0, 1].map(|_| report(&record, Effort::Quick, Stop::default()));
    assert_eq!(format!("{first:?}"), format!("{second:?}"));
}

#[test]
fn a_stop_ends_with_the_best_answer_so_far() {
    let voltage_v: Vec<f64> = (0..ROWS).map(chirp).collect();
    let record = record(&voltage_v, 0.0, strange);
    let whole = report(&record, Effort::Quick, Stop::default());
    let stopped = report(&record, Effort::Thorough, Stop::after(Duration::ZERO));
    assert!(whole.complete && !stopped.complete && !stopped.search.finished);
    assert!(stopped.findings.is_empty(), "{:?}", stopped.findings);
    // Nothing but the simulation as it is given is fitted, and its report made.
    assert!(10 * stopped.search.work < whole.search.work, "{:?} {:?}", stopped.search, whole.search);
}
