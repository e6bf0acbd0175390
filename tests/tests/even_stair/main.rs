//! Diagnosis of typical first records: a stair of equal steps up and down, from an independent simulation, with little
//! or no noise.

use std::fmt::Write;

use end_to_end::vsj::json;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tempfile::tempdir;
use validation::ground_truth::noise::Noise;

mod forms;
mod margins;
mod pairs;
mod plant;
mod sensor;
mod start;
mod sweep;
mod zero;

const SAMPLE_S: f64 = 0.1;
const LEVELS_V: [f64; 8] = [0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 300.0, 100.0];
/// Rows of each level, as many as one period of the held-out segments.
const ROWS_PER_LEVEL: usize = 300;

/// Command and stiffness `gain (w + share (u - w))` of every row, `w` following `u` with `tau_s`; the paper's share.
fn stiffness(gain: f64, tau_s: f64) -> Vec<(f64, f64)> {
    with_share(1.0 / 11.0, gain, tau_s)
}

fn with_share(share: f64, gain: f64, tau_s: f64) -> Vec<(f64, f64)> {
    let kept = (-SAMPLE_S / tau_s).exp();
    let volts = LEVELS_V.into_iter().flat_map(|volts| std::iter::repeat_n(volts, ROWS_PER_LEVEL));
    let spring = volts.scan(0.0, |lag, volts| {
        let now = gain * (*lag + share * (volts - *lag));
        *lag = volts + (*lag - volts) * kept;
        Some((volts, now))
    });
    spring.collect()
}

/// Command and stiffness of every row; `amplifier` maps the command to the spring's voltage, millisecond by
/// millisecond.
fn seen_through(
    volts: impl Iterator<Item = f64>,
    share: f64,
    mut amplifier: impl FnMut(f64) -> f64,
) -> Vec<(f64, f64)> {
    const STEPS: usize = 100;
    let kept = (-SAMPLE_S / STEPS as f64 / 5.5).exp();
    let mut lag = 0.0;
    let spring = volts.map(|volts| {
        let mut now = None;
        for _ in 0..STEPS {
            let seen = amplifier(volts);
            now.get_or_insert(lag + share * (seen - lag));
            lag = seen + (lag - seen) * kept;
        }
        (volts, now.unwrap())
    });
    spring.collect()
}

/// White noise of 1 V.
fn noise(seed: u64, rows: usize) -> Vec<f64> {
    Noise::white(0.2).draw(&mut ChaCha8Rng::seed_from_u64(seed), rows)
}

/// The paper's spring; `reading(row, exact, noise)` gives each reading, in V.
fn read(seed: u64, reading: impl Fn(usize, f64, f64) -> f64) -> Vec<(f64, f64)> {
    let exact = stiffness(1.0, 5.5);
    let noise = noise(seed, exact.len());
    exact.into_iter().zip(noise).enumerate().map(|(row, ((u, y), noise))| (u, reading(row, y, noise))).collect()
}

/// Diagnosis of readings with the paper's plant.
fn diagnosed(rows: &[(f64, f64)]) -> Value {
    diagnosed_in(rows, None)
}

/// Diagnosis of readings with a plant file.
fn diagnosed_with(rows: &[(f64, f64)], plant: &str) -> Value {
    diagnosed_in(rows, Some(plant))
}

fn diagnosed_in(rows: &[(f64, f64)], plant: Option<&str>) -> Value {
    let mut text = String::from("time_s,voltage_v,stiffness\n");
    for (row, (volts, stiffness)) in rows.iter().enumerate() {
        writeln!(text, "{:.1},{volts},{stiffness}", row as f64 * SAMPLE_S).unwrap();
    }
    let folder = tempdir().unwrap();
    std::fs::write(folder.path().join("record.csv"), text).unwrap();
    std::fs::write(folder.path().join("plant.toml"), plant.unwrap_or_default()).unwrap();
    let plant = if plant.is_some() { "plant.toml" } else { "paper" };
    json(folder.path(), &["diagnose", "record.csv", "--plant", plant, "--json"])
}

fn causes(report: &Value) -> Vec<&str> {
    report["findings"].as_array().unwrap().iter().map(|finding| finding["cause"].as_str().unwrap()).collect()
}

/// The response of a fast spring is visible in the first rows after each step only.
#[test]
fn a_fast_spring_is_not_mistaken_for_outliers() {
    for (seed, tau_s) in [(1, 0.5), (2, 1.0), (3, 1.2)] {
        let exact = stiffness(1.0, tau_s);
        let noise = noise(seed, exact.len());
        let rows: Vec<_> = exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect();
        let report = diagnosed(&rows);
        assert_eq!(causes(&report), ["time-constant"], "{tau_s}: {report}");
        let found = report["findings"][0]["parameters"]["tau_s"]["value"].as_f64().unwrap();
        assert!((found / tau_s - 1.0).abs() < 0.02, "{tau_s}: {found}");
    }
}

#[test]
fn noise_free_records_are_diagnosed_correctly() {
    let as_is: fn(f64) -> f64 = |y| y;
    for round in [as_is, |y| (y * 1e3).round() / 1e3, |y| (y * 1e2).round() / 1e2] {
        let rounded = |gain, tau_s| stiffness(gain, tau_s).into_iter().map(|(u, y)| (u, round(y))).collect::<Vec<_>>();
        let report = diagnosed(&rounded(1.0, 5.5));
        assert_eq!(report["verdict"], "consistent", "{report}");
        assert_eq!(causes(&diagnosed(&rounded(0.9, 5.5))), ["gain-error"]);
        assert_eq!(causes(&diagnosed(&rounded(1.0, 3.0))), ["time-constant"]);
    }
}

/// A spring that the control tick cannot run is named, and the report states why the tick rejects it.
#[test]
fn a_spring_that_the_tick_rejects_is_reported() {
    let report = diagnosed(&with_share(0.95, 1.0, 5.5));
    assert_eq!(causes(&report), ["instantaneous-share"], "{report}");
    let reason = report["extended"]["tick_refuses"].as_str().expect("why");
    assert!(reason.contains("relaxation.share") && reason.contains("0 to 0.9"), "{reason}");
    assert!(diagnosed(&stiffness(0.9, 5.5))["extended"]["tick_refuses"].is_null());
}
