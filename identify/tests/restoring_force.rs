//! A spring whose restoring force is far from linear is explained by that force.

use identify::{Options, Report, Verdict, diagnose};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

const ROWS: usize = 1200;
const SAMPLE_S: f64 = 0.275;
const TAU_S: f64 = 5.5;
const SHARE: f64 = 1.0 / 11.0;
const FULL_SCALE_V: f64 = 500.0;
/// Integration steps from row to row.
const STEPS: usize = 40;
/// Rounds in which stiffness and force are brought in line.
const ROUNDS: usize = 20;

/// Diagnoses the paper's spring with the restoring force `y (1 + bend ((y / 500 V)^2 - 1))` under steps to random levels, with noise of
/// 1 V.
fn report(bend: f64) -> Report {
    let mut random = Lcg32::new(3);
    let more = |y: f64| bend * y * ((y / FULL_SCALE_V).powi(2) - 1.0);
    let stiffness =
        |lag: f64, voltage_v: f64| (0..ROUNDS).fold(lag, |y, _| SHARE * (voltage_v - more(y)) + (1.0 - SHARE) * lag);
    let (mut voltage_v, mut lag) = (0.0, 0.0);
    let row = |row: usize| {
        if row >= 25 && row % 20 == 5 {
            voltage_v = (FULL_SCALE_V * random.uniform()).round();
        }
        let measured = stiffness(lag, voltage_v) + random.normal();
        for _ in 0..STEPS {
            let driven = voltage_v - more(stiffness(lag, voltage_v));
            lag += (driven - lag) * SAMPLE_S / STEPS as f64 / TAU_S;
        }
        Row { line: row + 2, time_s: SAMPLE_S * row as f64, voltage_v, measured: Some(measured) }
    };
    let record = Record { name: "force".into(), rows: (0..ROWS).map(row).collect() };
    diagnose(&record, &Options::default()).unwrap()
}

#[test]
fn a_force_that_stiffens_much_is_all_that_is_found() {
    let report = report(0.5);
    let causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    assert_eq!((report.verdict, causes), (Verdict::Explained, vec!["static-nonlinearity"]), "{report:#?}");
    assert!(report.extended.quality.rmse < 1.1, "{:?}", report.extended.quality);
}
