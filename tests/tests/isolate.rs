//! `vsj isolate`.

use std::fmt::Write;
use std::fs;

use end_to_end::vsj::{json, run, text};
use random_numbers::Xorshift32;
use tempfile::tempdir;

/// A record of the paper's spring at 100 rows per second between levels held for 7 s, whose gain changes after 40 s, with noise of a
/// third of a volt.
fn record(gain: f64) -> String {
    let mut csv = "time_s,voltage_v,stiffness\n".to_owned();
    let (mut relaxed, mut numbers) = (0.0, Xorshift32::new(1));
    for row in 0..14_000u32 {
        let voltage = [100.0, 400.0, 200.0, 500.0, 0.0, 300.0, 50.0][(row / 700) as usize % 7];
        let noise = (f64::from(numbers.draw()) / f64::from(u32::MAX) - 0.5) * 12f64.sqrt() / 3.0;
        let stiffness = (if row < 4000 { 1.0 } else { gain }) * (relaxed + (voltage - relaxed) / 11.0) + noise;
        writeln!(csv, "{:.2},{voltage},{stiffness:.3}", f64::from(row) / 100.0).unwrap();
        relaxed += (voltage - relaxed) * -f64::exp_m1(-0.01 / 5.5);
    }
    csv
}

#[test]
fn a_gain_that_changes_is_named_with_size_and_beginning_and_nothing_is_not() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("changed.csv"), record(1.04)).unwrap();
    fs::write(folder.path().join("sound.csv"), record(1.0)).unwrap();
    let report = json(folder.path(), &["isolate", "changed.csv", "--json"]);
    let last = &report["last"];
    assert_eq!((last["verdict"].as_str(), last["cause"].as_str()), (Some("named"), Some("gain-error")), "{report}");
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    assert!((number(&last["size"]["value"]) - 0.04).abs() < 0.001, "{last}");
    assert!(number(&last["size"]["low"]) < number(&last["size"]["high"]), "{last}");
    assert!((number(&last["since_s"]) - 40.0).abs() < 3.0, "{last}");
    assert!((number(&report["noise_v"]) - 1.0 / 3.0).abs() < 0.1, "{report}");
    let trace: Vec<_> = report["trace"].as_array().unwrap().iter().map(|event| event["verdict"].clone()).collect();
    assert_eq!(trace[..2], ["quiet", "alarm"], "{report}");
    let said = text(&run(folder.path(), &["isolate", "changed.csv"]).stdout);
    assert!(said.contains("at the end:") && said.contains("named gain-error, size 0.04"), "{said}");
    let sound = json(folder.path(), &["isolate", "sound.csv", "--json"]);
    assert_eq!(sound["trace"].as_array().unwrap().len(), 1, "{sound}");
    assert_eq!(sound["last"]["verdict"], "quiet");
}

/// A record with another header and other units, read by the options of the other commands, gives the answer of the plain one.
#[test]
fn a_record_in_any_columns_and_units_gives_the_same_answer() {
    let folder = tempdir().unwrap();
    let plain = record(1.04);
    fs::write(folder.path().join("plain.csv"), &plain).unwrap();
    let mut foreign = "t_ms;set_mm;u_kV;y_mm\n".to_owned();
    for row in plain.lines().skip(1) {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let (ms, kv, mm) = (1e3 * cells[0] + 1.7e12, cells[1] / 1e3, 0.5 + 0.02 * cells[2]);
        writeln!(foreign, "{ms:.0};0;{kv:.6};{mm:.6}").unwrap();
    }
    fs::write(folder.path().join("foreign.csv"), foreign).unwrap();
    let spring = "schema = 1\n[units]\nreading = \"mm\"\n[reading]\ngain = 0.02\nzero = 0.5\n[relaxation]\nshare = 0.09090909090909091\ntau_s = 5.5\n";
    fs::write(folder.path().join("spring.toml"), spring).unwrap();
    fs::write(folder.path().join("columns.toml"), "[columns]\nreading = \"y_mm\"\ninput = \"linear\"\n").unwrap();
    let named = |arguments: &[&str]| {
        let report = json(folder.path(), &[&["isolate"], arguments, &["--json"]].concat());
        let last = &report["last"];
        let size = last["size"]["value"].as_f64().unwrap();
        (last["cause"].to_string(), (1e3 * size).round(), report["rows"].as_u64().unwrap())
    };
    let expected = ("\"gain-error\"".to_owned(), 40.0, 14_000);
    assert_eq!(named(&["plain.csv", "--column", "stiffness"]), expected);
    assert_eq!(named(&["foreign.csv", "--reading", "y_mm", "--plant", "spring.toml"]), expected);
    let asked = ["foreign.csv", "--time", "t_ms:ms", "--voltage", "u_kV:kV", "--reading", "y_mm:mm"];
    assert_eq!(named(&[&asked[..], &["--plant", "spring.toml"]].concat()), expected);
    for (arguments, expected) in [
        (&asked[..], "foreign.csv: readings in mm; expected V, as the nominal spring's, or --column for a stiffness"),
        (&["foreign.csv", "--columns", "columns.toml"], "columns.toml, [columns]: input: expected hold"),
        (
            &["plain.csv", "--column", "voltage_v"],
            "column `voltage_v` is the voltage; expected another one for --column",
        ),
    ] {
        let output = run(folder.path(), &[&["isolate"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
}

#[test]
fn what_cannot_be_run_is_one_line_and_exit_code_2() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("sound.csv"), record(1.0)).unwrap();
    fs::write(folder.path().join("bare.csv"), "time_s,voltage_v\n0,1\n1,2\n").unwrap();
    fs::write(folder.path().join("slow.csv"), "time_s,voltage_v,stiffness\n0,1,1\n1,2,1\n2,3,1\n").unwrap();
    for (arguments, expected) in [
        (&["isolate", "no.csv"][..], "no.csv"),
        (&["isolate", "bare.csv"], "bare.csv, line 1: no column `stiffness`; expected a header"),
        (&["isolate", "slow.csv"], "slow.csv: fewer than 10 readings; expected more, or --noise-v"),
        (&["isolate", "slow.csv", "--noise-v", "1"], "slow.csv: rows 1.000 s apart; expected at most 0.6 s"),
        (&["isolate", "sound.csv", "--noise-v", "0"], "--noise-v: noise_v = 0 is not allowed: expected 0.05 to 100 V"),
        (&["isolate", "sound.csv", "--noise-correlation-s", "1"], "--noise-correlation-s: expected --noise-v as well"),
        (&["isolate", "sound.csv", "--limit-v", "9"], "--limit-v: range_v = 9 is not allowed"),
        (&["isolate", "sound.csv", "--alarm-nats", "nan"], "--alarm-nats: alarm_nats = NaN is not allowed"),
        (&["isolate", "sound.csv", "--plant", "no.toml"], "no.toml: cannot be read"),
    ] {
        let output = run(folder.path(), arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected) && stderr.trim_end().lines().count() == 1, "{arguments:?}: {stderr}");
    }
}
