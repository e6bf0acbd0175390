//! A sensor that sticks, or whose wire is loose, is named, and so is the error of the spring in the same record.

use std::ops::Range;

use identify::answer::{Report, Verdict};
use identify::{Options, diagnose};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

/// A stair of 100 V each 10 s up and down, twice, with a time constant of `tau_s`, an instantaneous part of 1/11 and noise of about 1 V.
fn record(tau_s: f64) -> Record {
    let (mut state, mut numbers) = (0.0, Lcg32::new(1));
    let rows = (0..2200).map(|index: usize| {
        let level = index / 100 % 11;
        let voltage_v = 100.0 * level.min(10 - level) as f64;
        let measured = voltage_v / 11.0 + state * 10.0 / 11.0;
        state += (voltage_v - state) * (1.0 - (-0.1 / tau_s).exp());
        let noise = 3.4 * (numbers.uniform() - 0.5);
        Row { line: index + 2, time_s: 0.1 * index as f64, voltage_v, measured: Some(measured + noise) }
    });
    Record { name: "stair".into(), rows: rows.collect() }
}

/// The record with one reading in all rows of `run`: that of the row before, or `value`.
fn stuck(mut record: Record, run: &Range<usize>, value: Option<f64>) -> Record {
    let repeated = value.or(record.rows[run.start - 1].measured);
    record.rows[run.clone()].iter_mut().for_each(|row| row.measured = repeated);
    record
}

fn causes(report: &Report) -> Vec<&str> {
    let mut causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    causes
}

#[test]
fn a_stuck_sensor_is_named_for_as_long_as_it_sticks() {
    for (run, value) in [(815..830, None), (900..1500, None), (2100..2200, None), (1210..1230, Some(0.0))] {
        let report = diagnose(&stuck(record(5.5), &run, value), &Options::default()).unwrap();
        assert_eq!((report.verdict, causes(&report)), (Verdict::Explained, vec!["stuck-sensor"]), "{run:?}");
        let first = run.start - 1;
        let found = &report.findings[0];
        let parameter = |name: &str| found.parameters.iter().find(|(of, _)| of == name).unwrap().1.value;
        let expected = [first, run.end - 1].map(|row| 0.1 * row as f64);
        assert!((parameter("from_s") - expected[0]).abs() < 1e-6 && (parameter("to_s") - expected[1]).abs() < 1e-6);
        assert_eq!((found.probability, report.rows), (1.0, 2200));
        assert!((parameter("fraction") - run.len() as f64 / 2200.0).abs() < 1e-9);
    }
}

#[test]
fn a_time_constant_is_found_beside_a_stuck_sensor() {
    let report = diagnose(&stuck(record(8.0), &(900..1100), None), &Options::default()).unwrap();
    assert_eq!((report.verdict, causes(&report)), (Verdict::Explained, vec!["stuck-sensor", "time-constant"]));
    let found = report.findings.iter().find(|finding| finding.cause == "time-constant").unwrap();
    let tau_s = &found.parameters[0].1;
    assert!(tau_s.low < 8.0 && 8.0 < tau_s.high, "{tau_s:?}");
}
