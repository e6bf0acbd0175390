//! Sensor faults and sensor noise.

use super::{causes, diagnosed, noise, read, stiffness};

/// Readings in another unit, of any size and sign, are a gain error of that size and nothing else.
#[test]
fn readings_in_another_unit_are_a_gain_error() {
    let exact = stiffness(1.0, 5.5);
    let noise = noise(4, exact.len());
    for scale in [1000.0, 0.05, 0.001, -1.0] {
        let noise = noise.iter().map(|noise| noise * scale);
        let rows: Vec<_> = exact.iter().zip(noise).map(|((u, y), noise)| (*u, scale * y + noise)).collect();
        let report = diagnosed(&rows);
        assert_eq!(causes(&report), ["gain-error"], "{scale}: {report}");
        let gain = report["findings"][0]["parameters"]["gain"]["value"].as_f64().unwrap();
        assert!((gain / scale - 1.0).abs() < 0.01, "{scale}: {report}");
    }
}

/// A constant reading with noise is not explained by any spring.
#[test]
fn a_constant_reading_is_unexplained() {
    for (seed, (level, scatter)) in
        [(0.0, 1.0), (42.0, 0.02), (42.0, 20.0), (200.0, 1.0), (600.0, 1.0)].into_iter().enumerate()
    {
        let report = diagnosed(&read(seed as u64, |_, _, noise| level + scatter * noise));
        assert_eq!(report["verdict"], "unexplained", "{level} {scatter}: {report}");
        assert!(causes(&report).is_empty(), "{level} {scatter}: {report}");
        assert!(report["leftover"].as_str().unwrap().contains("do not follow the voltage"), "{report}");
        let next = report["next_experiment"].as_str().unwrap();
        assert!(next.contains("sensor") && !next.contains("cable"), "{report}");
    }
}

/// The noise at full scale is ten times as large as at rest.
#[test]
fn noise_that_grows_with_the_reading_gets_no_finding() {
    for seed in 0..12 {
        let report = diagnosed(&read(seed, |_, y, noise| y + (0.2 + 0.004 * y) * noise));
        assert_eq!(report["verdict"], "consistent", "{seed}: {report}");
    }
}

/// A quantisation step that is not a multiple of the last printed digit, by a rounding and by a truncating converter.
#[test]
fn a_quantisation_step_is_found_in_rounded_decimal_readings() {
    const STEP: f64 = 9.7737;
    for (seed, digits) in [(1, 1), (2, 2), (3, 4)] {
        let unit = 10f64.powi(digits);
        let printed = |steps: f64| (steps * STEP * unit).round() / unit;
        let rounded = read(seed, |_, y, noise| printed(((y + noise) / STEP).round()));
        let cut = read(seed, |_, y, noise| printed(((y + noise) / STEP).floor()));
        for rows in [rounded, cut] {
            let report = diagnosed(&rows);
            assert_eq!(causes(&report), ["quantisation"], "{digits}: {report}");
            let step = &report["findings"][0]["parameters"]["step"];
            let [low, value, high] = ["low", "value", "high"].map(|name| step[name].as_f64().unwrap());
            assert!(low <= STEP && STEP <= high && (value / STEP - 1.0).abs() < 1e-3, "{digits}: {step}");
        }
    }
}

/// A saturating sensor stops at its limit; an isolated code above all others is a failed reading.
#[test]
fn an_isolated_code_is_an_outlier_and_not_saturation() {
    let failed = |row: usize| row * 37 % 101 < 2;
    let report = diagnosed(&read(5, |row, y, noise| if failed(row) { 1000.0 } else { y + noise }));
    assert_eq!(causes(&report), ["outliers"], "{report}");
    let stopped = diagnosed(&read(5, |_, y, noise| (y + noise).min(430.0)));
    assert_eq!(causes(&stopped), ["sensor-saturation"], "{stopped}");
}

/// Runs of deviating readings to one side are not outliers: here each reading is repeated for five rows.
#[test]
fn repeated_readings_are_not_outliers() {
    let fresh = read(6, |_, y, noise| y + noise);
    let held: Vec<(f64, f64)> = fresh.iter().enumerate().map(|(row, (u, _))| (*u, fresh[row / 5 * 5].1)).collect();
    let report = diagnosed(&held);
    assert!(!causes(&report).contains(&"outliers"), "{report}");
}
