//! The fast capture.

use std::path::Path;

use link::State;
use serde_json::Value;
use simulation::record::{MEASURED, Record};

use crate::mcu::{Mcu, ROWS, Setup};
use crate::vsj::{bad, good, vsj};

/// The answer with `--json`.
fn capture(mcu: &Mcu, arguments: &[&str]) -> Value {
    let all = [&["capture", "--timeout", "10", "--json"], arguments].concat();
    serde_json::from_str(&good(&mcu.port, &all)).unwrap()
}

fn every_tick_is_a_row(setup: Setup) {
    let mcu = Mcu::on_socket(setup);
    let folder = tempfile::tempdir().unwrap();
    let (input, out) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    std::fs::write(&input, "time_s,voltage_v\n0,100\n0.4,300\n0.8,50\n1.2,50\n").unwrap();
    let path = |path: &Path| path.to_str().unwrap().to_owned();
    let report = capture(&mcu, &["--input", &path(&input), "--arm", "--out", &path(&out)]);
    assert_eq!((&report["rows"], &report["lost"]), (&1200.into(), &0.into()), "{report}");
    assert_eq!((&report["gaps"], &report["room"]), (&Value::Array(Vec::new()), &ROWS.into()));
    assert_eq!(mcu.wait_for(State::Disarmed).code, 0, "disarmed before the rows are sent");

    let rows = Record::open(&out, MEASURED).unwrap().rows;
    assert_eq!(rows.len(), 1200);
    for (number, row) in rows.iter().enumerate() {
        assert_eq!((row.time_s * 1000.0).round() as usize, number, "every tick has its row");
    }
    // The paper's controller overshoots: 100 V are reached with more, and the voltage follows both steps.
    let highest = |from: usize, to: usize| rows[from..to].iter().map(|row| row.voltage_v).fold(0.0, f64::max);
    assert!(highest(0, 300) > 250.0 && highest(500, 700) > 600.0, "{} {}", highest(0, 300), highest(500, 700));
    assert!(rows[1100].voltage_v < 100.0 && rows.iter().all(|row| row.measured.is_some()));
    // A voltage is that of its code, as in telemetry.
    let step = 700.0 / f64::from((1 << setup.dac_bits) - 1);
    assert!(rows.iter().all(|row| ((row.voltage_v / step).round() * step - row.voltage_v).abs() < 1e-4));
}

#[test]
fn a_capture_has_every_tick_and_is_a_record_for_diagnose() {
    every_tick_is_a_row(Setup { sensor: true, ..Setup::default() });
}

#[test]
fn the_voltage_of_a_code_is_that_of_the_converter_that_the_mcu_has() {
    every_tick_is_a_row(Setup { sensor: true, dac_bits: 10, ..Setup::default() });
}

/// One byte in 400 is damaged: about every third frame of rows.
#[test]
fn rows_in_damaged_frames_are_sent_again_and_none_is_missing() {
    every_tick_is_a_row(Setup { sensor: true, damage_one_in: Some(400), ..Setup::default() });
}

#[test]
fn a_capture_that_does_not_fit_is_refused_with_what_fits_and_writes_nothing() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let out = out.to_str().unwrap();
    let text = bad(2, &mcu.port, &["capture", "--seconds", "10", "--out", out]);
    let expected = "10 s at 1000 Hz are 10000 rows: the MCU's RAM has room for 2000 rows of a capture, 2 s";
    assert!(text.contains(expected) && !Path::new(out).exists(), "{text}");
    for seconds in ["0", "-1", "nan", "1e300"] {
        bad(2, &mcu.port, &["capture", "--seconds", seconds, "--out", out]);
    }
    bad(1, &mcu.port, &["capture", "--input", "stair", "--out", out]);
    assert!(mcu.with(|shared| shared.ordered.is_empty()) && !Path::new(out).exists());
}

#[test]
fn a_capture_without_a_sensor_says_that_it_is_no_measurement() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let output = vsj(&mcu.port, &["capture", "--seconds", "0.3", "--out", out.to_str().unwrap()]).output().unwrap();
    assert!(String::from_utf8_lossy(&output.stderr).contains("no sensor"), "{output:?}");
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert!(stdout.contains("300 rows, 0.299 s, 0 missing; room for 2000 rows"), "{stdout}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("\ntime_s,voltage_v,estimate\n") && text.lines().count() == 302, "{text}");
}
