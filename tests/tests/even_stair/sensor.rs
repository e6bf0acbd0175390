//! What a sensor makes of the readings.

use super::{causes, diagnosed, noise, read, stiffness};

/// What a cable, a unit or a wrong channel makes is no spring's, however full the schedule.
#[test]
fn a_sensor_that_reads_no_spring_is_told() {
    let exact = stiffness(1.0, 5.5);
    let noise = noise(4, exact.len());
    for scale in [0.0, 1000.0, 0.001, -1.0] {
        let noise = noise.iter().map(|noise| noise * f64::max(scale, 0.001));
        let rows: Vec<_> = exact.iter().zip(noise).map(|((u, y), noise)| (*u, scale * y + noise)).collect();
        let report = diagnosed(&rows);
        assert_eq!(report["verdict"], "unexplained", "{scale}: {report}");
        let told = report["leftover"].as_str().unwrap();
        let times = told.strip_prefix("The readings are ").and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
        let right = times.map_or(told.contains("do not follow"), |times| (times - scale).abs() <= 0.01 * scale.abs());
        assert!(right && times.is_some() == (scale != 0.0), "{scale}: {report}");
        assert!(report["next_experiment"].as_str().unwrap().contains("sensor"), "{scale}: {report}");
    }
}

/// A sensor that stays where it is has noise, which no spring explains.
#[test]
fn a_sensor_that_stands_still_is_told() {
    for (seed, (level, scatter)) in
        [(0.0, 1.0), (42.0, 0.02), (42.0, 20.0), (200.0, 1.0), (600.0, 1.0)].into_iter().enumerate()
    {
        let report = diagnosed(&read(seed as u64, |_, _, noise| level + scatter * noise));
        assert_eq!(report["verdict"], "unexplained", "{level} {scatter}: {report}");
        assert!(causes(&report).is_empty(), "{level} {scatter}: {report}");
        assert!(report["leftover"].as_str().unwrap().contains("do not follow the voltage"), "{report}");
    }
}

/// A part of what is read: ten times as much at the top as at rest.
#[test]
fn noise_that_grows_with_the_reading_is_no_cause() {
    for seed in 0..12 {
        let report = diagnosed(&read(seed, |_, y, noise| y + (0.2 + 0.004 * y) * noise));
        assert_eq!(report["verdict"], "consistent", "{seed}: {report}");
    }
}

/// A step that is no multiple of the last digit printed, by a converter that rounds and by one that cuts off.
#[test]
fn a_step_is_found_behind_the_digits_that_were_printed() {
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

/// A sensor stops where it comes to; a code above all else, now and then, is a reading that failed.
#[test]
fn a_code_that_stands_alone_is_an_outlier() {
    let failed = |row: usize| row * 37 % 101 < 2;
    let report = diagnosed(&read(5, |row, y, noise| if failed(row) { 1000.0 } else { y + noise }));
    assert_eq!(causes(&report), ["outliers"], "{report}");
    let stopped = diagnosed(&read(5, |_, y, noise| (y + noise).min(430.0)));
    assert_eq!(causes(&stopped), ["sensor-saturation"], "{stopped}");
}

/// Far readings in runs to one side are no outliers: here each is held for five rows.
#[test]
fn held_readings_are_no_outliers() {
    let fresh = read(6, |_, y, noise| y + noise);
    let held: Vec<(f64, f64)> = fresh.iter().enumerate().map(|(row, (u, _))| (*u, fresh[row / 5 * 5].1)).collect();
    let report = diagnosed(&held);
    assert!(!causes(&report).contains(&"outliers"), "{report}");
}
