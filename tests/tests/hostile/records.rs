//! Records on which a diagnosis could take long or be misled.

use std::ffi::OsString;
use std::fmt::Write;
use std::path::Path;
use std::process::{Output, Stdio};

use end_to_end::vsj::text;
use serde_json::Value;

use crate::attack;

/// Runs `vsj` under the limits of every hostile run.
fn run(folder: &Path, arguments: &[&str]) -> Output {
    let arguments: Vec<OsString> = arguments.iter().map(OsString::from).collect();
    attack::command(folder, &arguments).stdout(Stdio::piped()).output().expect("sh starts")
}

/// A record of the report's spring from times and voltages, its readings changed by `reading`.
fn record(rows: &[(f64, f64)], reading: impl Fn(f64) -> f64) -> String {
    let (mut relaxed, mut before) = (0.0, rows[0].0);
    rows.iter().enumerate().fold("time_s,voltage_v,stiffness\n".to_owned(), |mut table, (row, &(time_s, volts))| {
        relaxed += (volts - relaxed) * (1.0 - ((before - time_s) / 5.5).exp());
        before = time_s;
        let noise = 0.5 * (12.9898 * row as f64).sin();
        let stiffness = reading(volts / 11.0 + relaxed * 10.0 / 11.0) + noise;
        let _ = writeln!(table, "{time_s:.6},{volts},{stiffness:.4}");
        table
    })
}

/// Work of the search, counted in operations, which do not depend on the machine.
fn work(name: &str, table: &str) -> u64 {
    let folder = tempfile::tempdir().expect("there is room");
    std::fs::write(folder.path().join(name), table).expect("there is room");
    let output = run(folder.path(), &["diagnose", name, "--json"]);
    assert!(output.status.success(), "{name}: {}", text(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).expect("one JSON object on stdout");
    let (work, allowed) = (&answer["search"]["work"], &answer["search"]["allowed"]);
    let (work, allowed) = (work.as_u64().expect("a count"), allowed.as_u64().expect("a count"));
    // The last step of a search may go on beyond.
    assert!(work < 2 * allowed, "{name}: {work} of {allowed}");
    work
}

#[test]
fn the_work_of_a_diagnosis_grows_with_its_rows_and_not_with_its_pauses() {
    let level = |row: usize| 100.0 * (row * 5 / 400 + 1) as f64;
    let with_pauses = |pause_s: f64, every: usize| {
        let mut time_s = 0.0;
        let rows: Vec<(f64, f64)> = (0..400)
            .map(|row| {
                time_s += if row % every == every - 1 { pause_s } else { 0.1 };
                (time_s, level(row))
            })
            .collect();
        record(&rows, |stiffness| stiffness)
    };
    let shorter = work("pauses.csv", &with_pauses(10.0, 200));
    for (pause_s, every) in [(1e4, 200), (1e6, 200)] {
        let longer = work("pauses.csv", &with_pauses(pause_s, every));
        assert!(longer < 10 * shorter, "a pause of {pause_s} s: {longer}, one of 10 s: {shorter}");
    }
}

#[test]
fn records_that_no_cause_explains_end_within_the_work_that_is_allowed() {
    let stair: Vec<(f64, f64)> = (0..1200).map(|row| (0.1 * row as f64, 100.0 * (row / 240 % 6) as f64)).collect();
    let multisine = |time_s: f64| {
        let tone = |(tone, hz): (usize, &f64)| 40.0 * (std::f64::consts::TAU * hz * time_s + tone as f64).sin();
        250.0 + [0.01, 0.03, 0.07, 0.11, 0.23, 0.41, 0.83].iter().enumerate().map(tone).sum::<f64>()
    };
    let tones: Vec<(f64, f64)> = (0..1200).map(|row| (0.1 * row as f64, multisine(0.1 * row as f64))).collect();
    work("codes.csv", &record(&stair, |stiffness| (stiffness / 250.0).round() * 250.0));
    work("multisine.csv", &record(&tones, |stiffness| stiffness));
    work(
        "cubic.csv",
        &record(&stair, |stiffness| stiffness - 3e-6 * stiffness.powi(3) + 30.0 * (stiffness / 7.0).sin()),
    );
}

#[test]
fn a_record_of_the_controllers_own_estimates_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("there is room");
    let rows: Vec<(f64, f64)> = (0..400).map(|row| (0.1 * row as f64, 100.0 * (row / 80) as f64)).collect();
    let table = record(&rows, |stiffness| stiffness).replace("stiffness", "estimate");
    std::fs::write(folder.path().join("r.csv"), format!("# recorded\n{table}")).expect("there is room");
    for arguments in
        [&["diagnose", "r.csv"][..], &["identify", "r.csv"], &["diagnose", "r.csv", "--reading", "estimate"]]
    {
        let output = run(folder.path(), arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.starts_with("vsj: r.csv, line 2: column `estimate` is the controller's own estimate"), "{said}");
    }
}

#[test]
fn a_record_whose_rows_miss_turns_of_the_voltage_is_diagnosed_with_a_warning() {
    let folder = tempfile::tempdir().expect("there is room");
    let volts = |row: usize| 2.0 * (row as f64 - 400.0 * (row as f64 / 400.0).round()).abs();
    let is_kept = |row: &usize| row % 200 >= 5 && row % 200 <= 195;
    for (kept, expected) in [(false, ""), (true, "vsj: r.csv: the voltage turns in 3 gap(s) between the rows")] {
        let rows = (0..800).filter(|row| !kept || is_kept(row)).map(|row| (0.1 * row as f64, volts(row)));
        let table = record(&rows.collect::<Vec<_>>(), |stiffness| stiffness);
        std::fs::write(folder.path().join("r.csv"), table).expect("there is room");
        let output = run(folder.path(), &["diagnose", "r.csv", "--effort", "quick"]);
        let said = text(&output.stderr);
        assert!(
            output.status.success() && said.starts_with(expected) && said.is_empty() == expected.is_empty(),
            "{said}"
        );
    }
}

#[test]
fn a_record_that_is_too_long_for_its_rows_is_refused_with_its_row() {
    let folder = tempfile::tempdir().expect("there is room");
    for (first_s, second_s, last_s, accepted) in [
        (0.0, 0.1, 1e9, true),
        (0.0, 0.1, 1e12, false),
        (0.0, 0.1, 1e100, false),
        (0.0, 0.1, 1e308, false),
        (-1e308, 1.0, 1e308, false),
        (0.0, 1e-9, 1e12, false),
    ] {
        let rows: String =
            (0..40).map(|row| format!("{},{row},{row}\n", second_s * (1.0 + 0.1 * f64::from(row)))).collect();
        let table = format!("time_s,voltage_v,stiffness\n{first_s:e},0,0\n{rows}{last_s:e},5,5\n");
        std::fs::write(folder.path().join("r.csv"), table).expect("there is room");
        let output = run(folder.path(), &["diagnose", "r.csv", "--effort", "quick"]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(if accepted { 0 } else { 2 }), "{last_s:e}: {said}");
        assert_eq!(said.contains("s after the first row; expected at most"), !accepted, "{last_s:e}: {said}");
    }
}

/// 300 MiB of comments around the rows, in less memory than that.
#[test]
fn a_large_file_with_few_rows_is_read_in_little_memory() {
    let folder = tempfile::tempdir().expect("there is room");
    let rows: Vec<(f64, f64)> = (0..40).map(|row| (0.1 * row as f64, 100.0 * (row / 10) as f64)).collect();
    let comment = format!("# {}\n", "x".repeat((1 << 20) - 100)).repeat(150);
    let path = folder.path().join("r.csv");
    let table = record(&rows, |stiffness| stiffness);
    std::fs::write(&path, format!("{comment}{table}{comment}")).expect("there is room");
    let arguments = ["stair", "--input", "r.csv", "--json"].map(OsString::from);
    let output = attack::command_in(256 << 10, folder.path(), &arguments).output().expect("sh starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
}
