//! Causes are found that hide each other, so that none of them explains much without the others.

use identify::{Options, Verdict, diagnose};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

const ROWS: usize = 900;
const SAMPLE_S: f64 = 0.19;
/// Rows of each level.
const HELD: usize = 40;
const SHARE: f64 = 1.0 / 11.0;
const TAU_S: f64 = 5.5;
const GAIN: f64 = 1.19;
const OFFSET_V: f64 = -28.0;
/// Part of the response that relaxes more slowly, and its time constant, in s.
const SLOW: (f64, f64) = (0.12, 38.6);

/// The paper's spring under steps to random levels, with noise of 1 V.
fn record() -> Record {
    let mut random = Lcg32::new(5);
    let (mut voltage_v, mut lag, mut slow) = (0.0, 0.0, 0.0);
    let row = |row: usize| {
        if row >= 25 && row % HELD == 5 {
            voltage_v = (500.0 * random.uniform()).round();
        }
        let input = GAIN * voltage_v;
        let quick = SHARE * input + (1.0 - SHARE) * lag;
        let response = (1.0 - SLOW.0) * quick + SLOW.0 * slow + OFFSET_V;
        let measured = response + random.normal();
        lag += (input - lag) * -f64::exp_m1(-SAMPLE_S / TAU_S);
        slow += (input - slow) * -f64::exp_m1(-SAMPLE_S / SLOW.1);
        Row { line: row + 2, time_s: SAMPLE_S * row as f64, voltage_v, measured: Some(measured) }
    };
    Record { name: "three".into(), rows: (0..ROWS).map(row).collect() }
}

#[test]
fn a_gain_an_offset_and_a_second_relaxation_are_found() {
    let report = diagnose(&record(), &Options::default()).unwrap();
    let mut causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    let wanted = vec!["gain-error", "reading-offset", "second-relaxation"];
    assert_eq!((report.verdict, causes), (Verdict::Explained, wanted), "{report:#?}");
    assert!(report.extended.quality.rmse < 1.1, "{:?}", report.extended.quality);
}
