//! Verdicts and messages for invalid files, poor records and records that no cause explains.

use std::fmt::Write;
use std::fs;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use validation::ground_truth::Cause;
use validation::ground_truth::record::Recipe;

use super::{FILES, folder, names, papers, rejected};

/// A record with the readings `reading(time, voltage)` on a stair of 100 V every 10 s, two rows per second.
fn stair(reading: impl Fn(f64, f64) -> f64) -> String {
    let mut csv = "time_s,voltage_v,stiffness\n".to_owned();
    for row in 0..120 {
        let time = f64::from(row) * 0.5;
        let voltage = 100.0 * (time / 10.0).floor();
        writeln!(csv, "{time},{voltage},{}", reading(time, voltage)).expect("a string takes anything");
    }
    csv
}

#[test]
fn an_invalid_file_is_rejected_with_line_and_column() {
    let folder = folder();
    let good = stair(|_, voltage| voltage);
    let edited = |from: &str, to: &str| good.replacen(from, to, 1);
    for (name, csv, expected) in [
        ("empty", String::new(), "no header; expected one with time_s, voltage_v, stiffness"),
        ("comments", "# nothing\n".to_owned(), "no header; expected one with time_s"),
        ("header", "time_s,voltage_v,stiffness\n".to_owned(), "0 row(s) of data"),
        (
            "few",
            good.lines().take(6).map(|line| format!("{line}\n")).collect(),
            "5 row(s) with a reading; expected at least",
        ),
        ("twice", edited("\n1,", "\n0.5,"), "line 4, column time_s: 0.5 follows 0.5; expected increasing times"),
        ("back", edited("\n1,", "\n0.2,"), "line 4, column time_s: 0.2 follows 0.5"),
        ("text", edited("\n1,0,0\n", "\n1,0,high\n"), "line 4, column stiffness: `high` is not a finite number"),
        ("nan", edited("\n1,0,0\n", "\n1,NaN,0\n"), "line 4, column voltage_v: `NaN` is not a finite number"),
        ("infinite", edited("\n1,0,0\n", "\n1,0,-inf\n"), "line 4, column stiffness: `-inf` is not a finite number"),
        ("hole", edited("\n1,0,0\n", "\n1,,0\n"), "line 4, column voltage_v: no value; expected a finite number"),
        ("short", edited("\n1,0,0\n", "\n1,0\n"), "line 4: 2 field(s); expected 3"),
        ("voltage", edited("voltage_v", "volts"), "line 1: no column `voltage_v`"),
        ("reading", edited("stiffness", "strain"), "no column `stiffness`"),
    ] {
        let name = format!("{name}.csv");
        fs::write(folder.path().join(&name), csv).expect("a file");
        for more in [&[][..], &["--json"]] {
            let (code, error) = rejected(folder.path(), &[&["diagnose", name.as_str()][..], more].concat());
            assert_eq!(code, Some(2), "{name}: {error}");
            assert!(error.contains(&name) && error.contains(expected), "{name}: {error}");
        }
    }
    let (code, error) = rejected(folder.path(), &["diagnose", "none.csv"]);
    assert!(code == Some(2) && error.contains("none.csv: cannot be read"), "{error}");
    let (code, error) = rejected(folder.path(), &["diagnose", "reading.csv", "--column", "force"]);
    assert!(code == Some(2) && error.contains("no column `force`"), "{error}");
    fs::write(folder.path().join("other.csv"), "time_s,voltage_v,stiffness\n0,0,1\n25,0,1\n").expect("a file");
    let (code, error) = rejected(folder.path(), &["diagnose", "other.csv", "--input", "stair"]);
    assert!(code == Some(2) && error.contains("other.csv, line 3, column voltage_v: 0 V at 25 s"), "{error}");
}

/// Poor records are not invalid files: they get a verdict and all output files.
#[test]
fn a_poor_record_gets_a_verdict() {
    let folder = folder();
    let steady = |voltage: &str, reading: f64| -> String {
        let csv = stair(|time, _| reading + (time * 7919.0).sin());
        let rows = csv.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
        let rows = rows.map(|fields| format!("{},{voltage},{}\n", fields[0], fields[2]));
        std::iter::once("time_s,voltage_v,stiffness\n".to_owned()).chain(rows).collect()
    };
    // Rows are missing in the middle, but none where the voltage changes.
    let whole = Recipe { rows: 600, ..Recipe::of(&[Cause::TimeConstant]) }.draw(3).csv();
    let lines: Vec<&str> = whole.lines().collect();
    let voltage = |line: usize| lines.get(line).and_then(|row| row.split(',').nth(1));
    let changes = |line: usize| voltage(line) != voltage(line - 1) || voltage(line) != voltage(line + 1);
    let kept = (0..lines.len()).filter(|&line| !(250..350).contains(&line) || changes(line));
    let gap: String = kept.map(|line| format!("{}\n", lines[line])).collect();
    for (name, csv, verdicts) in [
        ("constant-voltage", steady("100", 100.0), &["insufficient"][..]),
        ("zero-voltage", steady("0", 0.0), &["insufficient"]),
        ("constant-readings", stair(|_, _| 42.0), &["unexplained"]),
        ("gap", gap, &["explained", "ambiguous"]),
    ] {
        let name = format!("{name}.csv");
        fs::write(folder.path().join(&name), csv).expect("a file");
        let answer = json(folder.path(), &["diagnose", &name, "--json", "--out", &format!("{name}.out")]);
        let verdict = answer["verdict"].as_str().expect("a verdict");
        assert!(verdicts.contains(&verdict), "{name}: {verdict}");
        assert_eq!(
            verdict == "explained",
            answer["next_experiment"].is_null(),
            "{name}: {}",
            answer["next_experiment"]
        );
        assert_eq!(names(&folder.path().join(format!("{name}.out"))), FILES, "{name}");
        let page = fs::read_to_string(folder.path().join(format!("{name}.out/report.html"))).expect("a page");
        assert!(page.contains(verdict) && !page.contains("NaN"), "{name}");
        assert!(verdict != "insufficient" || !page.contains("xtended"), "{name}: the page shows an extended model");
    }
}

/// Readings shifted within a single held-out segment are named, but no other segment can predict them.
#[test]
fn an_offset_within_one_held_out_segment_gives_no_held_out_improvement() {
    let csv = papers(1200, |row| if (633..655).contains(&row) { 40.0 } else { 0.0 });
    let folder = folder();
    fs::write(folder.path().join("record.csv"), csv).expect("a file");
    let found = json(folder.path(), &["diagnose", "--json", "record.csv"]);
    assert_eq!(found["findings"][0]["cause"], "reading-offset", "{found}");
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).expect("a number");
    assert!(number("/extended/rmse") < 0.4, "{found}");
    assert!(number("/extended/held_out_rmse") > 0.9 * number("/baseline/held_out_rmse"), "{found}");
    let printed = text(&run(folder.path(), &["diagnose", "record.csv"]).stdout);
    assert!(printed.contains("the other parts of the record do not predict it"), "{printed}");
}

/// Errors that no cause explains are neither consistent nor outliers, although autocorrelated noise may resemble them
/// locally.
#[test]
fn errors_that_no_cause_explains_are_unexplained() {
    use std::f64::consts::{PI, TAU};
    let strange = |what: usize, part: f64| match what {
        0 => 20.0 * (PI * part).sin(),
        1 => 30.0 * (-6.0 * part).exp(),
        _ => 10.0 * (TAU * (2.4 * part + 30.0 * part * part)).sin(),
    };
    for (what, place) in ["slow swing", "slow swing", "rhythm that changes"].into_iter().enumerate() {
        let folder = folder();
        let csv = papers(2400, |row| strange(what, f64::from(row) / 2400.0));
        fs::write(folder.path().join("record.csv"), csv).expect("a file");
        let found = json(folder.path(), &["diagnose", "--json", "record.csv"]);
        assert_eq!(found["verdict"], "unexplained", "{place}: {found}");
        assert!(found["leftover"].as_str().expect("a sentence").contains(place), "{place}: {found}");
    }
}
