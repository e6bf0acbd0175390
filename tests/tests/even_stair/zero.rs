//! Constant offsets: a sensor with a zero error, a truncating converter.

use super::{causes, diagnosed, read};

/// Offset of the finding `reading-offset`, in V; `None` if the record has no such finding.
fn offset(report: &serde_json::Value) -> Option<f64> {
    report["findings"].as_array()?.iter().find(|it| it["cause"] == "reading-offset")?["parameters"]["offset"]["value"]
        .as_f64()
}

#[test]
fn a_zero_error_is_found_as_one_offset() {
    for (seed, zero) in [(1, 15.0), (2, -15.0), (3, 4.0)] {
        let report = diagnosed(&read(seed, |_, y, noise| y + noise + zero));
        assert_eq!(causes(&report), ["reading-offset"], "{zero}: {report}");
        assert!((offset(&report).unwrap() - zero).abs() < 0.2, "{zero}: {report}");
        // A constant offset is predicted in held-out segments too.
        assert!(report["extended"]["held_out_rmse"].as_f64().unwrap() < 1.1, "{zero}: {report}");
        let report = diagnosed(&read(seed, |_, y, noise| 1.1 * y + noise + zero));
        assert!(offset(&report).is_some_and(|found| (found - zero).abs() < 0.5), "{zero}: {report}");
        assert!(causes(&report).contains(&"gain-error") && causes(&report).len() == 2, "{zero}: {report}");
    }
}

/// An offset of half a step is due to the truncation, not to the sensor's zero.
#[test]
fn truncation_is_quantisation_and_not_an_offset() {
    for (seed, step) in [(1, 6.0), (2, 10.115), (3, 12.0), (4, 14.6), (5, 15.7), (6, 17.5)] {
        let report = diagnosed(&read(seed, |_, y, noise| step * ((y + noise) / step).floor()));
        assert_eq!(causes(&report), ["quantisation"], "{step}: {report}");
    }
    // With a rounding converter the zero error is found too.
    let report = diagnosed(&read(7, |_, y, noise| 12.0 * ((y + noise + 20.0) / 12.0).round()));
    assert!(offset(&report).is_some_and(|found| (found - 20.0).abs() < 1.0), "{report}");
}

/// The rows from 110 to 160 s, over two steps of the stair, with readings of `wrong`, which gets the reading of 110 s and the right one.
fn wrong_for_a_while(wrong: impl Fn(f64, f64) -> f64) -> Vec<(f64, f64)> {
    let fresh = read(8, |_, y, noise| y + noise);
    let (stretch, mut rows) = (1100..1600, fresh.clone());
    rows[stretch.clone()].iter_mut().for_each(|row| row.1 = wrong(fresh[stretch.start].1, row.1));
    rows
}

/// An error that no cause explains is located in time.
#[test]
fn an_error_of_a_stretch_of_readings_is_reported_with_its_time() {
    let report = diagnosed(&wrong_for_a_while(|first, y| 2.0 * first - y));
    assert_eq!(report["verdict"], "unexplained", "{report}");
    let leftover = report["leftover"].as_str().unwrap();
    let times: Vec<f64> = leftover.split(" s").filter_map(|part| part.rsplit(' ').next()?.parse().ok()).collect();
    assert!(times.iter().any(|time| (110.0..160.0).contains(time)), "{leftover}");
}

#[test]
fn a_sensor_that_sticks_for_a_while_is_named_with_its_time() {
    let report = diagnosed(&wrong_for_a_while(|first, _| first));
    assert_eq!((&report["verdict"], causes(&report)), (&"explained".into(), vec!["stuck-sensor"]), "{report}");
    let parameters = &report["findings"][0]["parameters"];
    let time = |name: &str| parameters[name]["value"].as_f64().unwrap();
    assert!((time("from_s") - 110.0).abs() < 0.15 && (time("to_s") - 159.9).abs() < 0.15, "{parameters}");
}
