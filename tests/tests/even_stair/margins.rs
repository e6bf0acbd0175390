//! The detection margins that a consistent diagnosis states: errors of that size are found, much smaller ones are not.

use super::{ROWS_PER_LEVEL, SAMPLE_S, diagnosed, noise, read, stiffness};

const RECORDS: u64 = 5;

/// Number of records of a spring with this gain and time constant whose verdict is not `consistent`.
fn detected(first_seed: u64, gain: f64, tau_s: f64) -> usize {
    let agrees = |seed| {
        let exact = stiffness(gain, tau_s);
        let noise = noise(seed, exact.len());
        let rows: Vec<_> = exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect();
        diagnosed(&rows)["verdict"] == "consistent"
    };
    (first_seed..first_seed + RECORDS).filter(|&seed| !agrees(seed)).count()
}

#[test]
fn an_error_of_the_margins_size_is_detected_and_one_of_0_4_times_is_not() {
    let exact = stiffness(1.0, 5.5);
    let noise = noise(100, exact.len());
    let rows: Vec<_> = exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect();
    let report = diagnosed(&rows);
    let [gain, time_constant] =
        ["gain", "time_constant"].map(|of| report["would_show"][of].as_f64().expect("a margin"));
    // Nine of ten are expected to be detected, and few of those 0.4 times as large.
    assert!(detected(200, 1.0 + gain, 5.5) >= 4, "{gain}");
    assert!(detected(300, 1.0, 5.5 * (1.0 + time_constant)) >= 4, "{time_constant}");
    assert!(detected(400, 1.0 + 0.4 * gain, 5.5) <= 2, "{gain}");
    assert!(detected(500, 1.0, 5.5 * (1.0 + 0.4 * time_constant)) <= 2, "{time_constant}");
}

#[test]
fn a_record_that_could_not_show_a_gain_error_of_half_is_insufficient() {
    // Steps of 2 V in noise of 1 V, starting just before the first step.
    let exact = stiffness(1.0, 5.5).split_off(ROWS_PER_LEVEL - 10);
    let noise = noise(7, exact.len());
    let rows = |rows: usize| -> Vec<(f64, f64)> {
        exact.iter().zip(&noise).take(rows).map(|((u, y), noise)| (u / 50.0, y / 50.0 + noise)).collect()
    };
    assert_eq!(diagnosed(&rows(2000))["verdict"], "consistent");
    let report = diagnosed(&rows(90));
    assert_eq!(report["verdict"], "insufficient", "{report}");
    assert!(!report["next_experiment"].is_null(), "{report}");
}

/// A gain that oscillates slowly resembles strongly autocorrelated noise; it is named, with its amplitude.
#[test]
fn a_gain_that_swings_slowly_is_a_drift_and_no_autocorrelated_noise() {
    let swinging = |part: f64| {
        let swing = move |row: usize| 1.0 + part * (row as f64 * SAMPLE_S / 80.0 * std::f64::consts::TAU).sin();
        diagnosed(&read(9, |row, y, noise| swing(row) * y + noise))
    };
    let calm = swinging(0.0);
    assert!(calm["verdict"] == "consistent" && calm["next_experiment"].is_null(), "{calm}");
    let report = swinging(0.06);
    assert!(report["baseline"]["rmse"].as_f64().unwrap() > 5.0, "{report}");
    let finding = &report["findings"][0];
    assert_eq!(finding["cause"], "drift", "{report}");
    assert!((finding["parameters"]["amplitude"]["value"].as_f64().unwrap() - 0.06).abs() < 0.002, "{report}");
}
