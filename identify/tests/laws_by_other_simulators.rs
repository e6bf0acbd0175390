//! Laws of a cause that differ from its usual one, in records of a small simulator in this file: the cause is the first finding.

use identify::{Options, Report, diagnose};
use simulation::record::{Record, Row};

const ROWS: usize = 2400;
const SAMPLE_S: f64 = 0.1;
/// Integration steps per row.
const STEPS: usize = 40;
const TAU_S: f64 = 5.5;

/// Reproducible uniform numbers from 0 to 1.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Returns a record of levels that are held for 6 to 16 s. `tau_s` is the time constant over settled stiffness and relaxed part,
/// `reads` makes a reading of row and stiffness; noise of 1 V is added.
fn record(seed: u64, tau_s: impl Fn(f64, f64) -> f64, mut reads: impl FnMut(usize, f64) -> f64) -> Record {
    let mut random = uniform(seed);
    let (mut voltage_v, mut relaxed, mut until) = (0.0, 0.0, 40);
    let row = |row: usize| {
        if row == until {
            voltage_v = 50.0 * (11.0 * random()).floor();
            until += 60 + (100.0 * random()) as usize;
        }
        let stiffness = voltage_v / 11.0 + 10.0 / 11.0 * relaxed;
        for _ in 0..STEPS {
            relaxed += (voltage_v - relaxed) * SAMPLE_S / STEPS as f64 / tau_s(voltage_v, relaxed);
        }
        let noise = (0..12).map(|_| random() - 0.5).sum::<f64>();
        Row { line: row + 2, time_s: SAMPLE_S * row as f64, voltage_v, measured: Some(reads(row, stiffness) + noise) }
    };
    Record { name: "levels".into(), rows: (0..ROWS).map(row).collect() }
}

fn first(record: &Record) -> (String, Report) {
    let report = diagnose(record, &Options::default()).expect("a report");
    (report.findings.first().map_or_else(String::new, |finding| finding.cause.to_string()), report)
}

fn value(report: &Report, parameter: &str) -> f64 {
    let parameters = &report.findings[0].parameters;
    parameters
        .iter()
        .find(|(name, _)| name == parameter)
        .unwrap_or_else(|| panic!("{parameter}: {parameters:?}"))
        .1
        .value
}

#[test]
fn time_constant_that_depends_on_the_direction_is_a_voltage_dependent_one() {
    for (seed, rising_s, falling_s) in [(1, 3.5, 7.0), (2, 8.0, 4.5)] {
        let tau_s = |settled: f64, relaxed: f64| if settled > relaxed { rising_s } else { falling_s };
        let (cause, report) = first(&record(seed, tau_s, |_, stiffness| stiffness));
        assert_eq!(cause, "voltage-dependent-time-constant", "{report:?}");
        assert!((value(&report, "tau_rising_s") - rising_s).abs() < 0.1, "{report:?}");
        assert!((value(&report, "tau_falling_s") - falling_s).abs() < 0.1, "{report:?}");
    }
}

#[test]
fn backlash_of_the_sensor_is_hysteresis() {
    let (threshold, mut shown) = (12.0, 0.0f64);
    let reads = |_, stiffness: f64| {
        shown = shown.clamp(stiffness - threshold, stiffness + threshold);
        shown
    };
    let (cause, report) = first(&record(4, |_, _| TAU_S, reads));
    assert_eq!(cause, "hysteresis", "{report:?}");
    assert!((value(&report, "width_v") - 2.0 * threshold).abs() < 0.5, "{report:?}");
}

#[test]
fn step_of_the_gain_is_a_drift() {
    for (seed, factor, at) in [(5, 1.06, 900), (6, 0.94, 1500)] {
        let reads = |row: usize, stiffness: f64| if row >= at { factor * stiffness } else { stiffness };
        let (cause, report) = first(&record(seed, |_, _| TAU_S, reads));
        assert_eq!(cause, "drift", "{report:?}");
        assert!((value(&report, "factor") - factor).abs() < 0.003, "{report:?}");
        assert!((value(&report, "at_s") - SAMPLE_S * at as f64).abs() < 1.0, "{report:?}");
    }
}
