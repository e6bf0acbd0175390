//! Options that say how a record is read and how long its causes are searched for.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::tempdir;

/// Rows of a spring whose gain is off by 10 %: time in ms, voltage in kV, reading in mm, written by `line`.
fn table(header: &str, line: impl Fn(usize, f64, f64, f64) -> String) -> Vec<String> {
    let (mut lag, mut lines) = (0.0, vec![header.to_owned()]);
    for row in 0..400usize {
        let voltage_v = [0.0, 200.0, 400.0, 100.0, 300.0][row / 80];
        let noise = ((row * 7919) % 101) as f64 / 101.0 - 0.5;
        let reading = 1.1 * (voltage_v / 11.0 + lag * 10.0 / 11.0) + noise;
        lag = voltage_v + (lag - voltage_v) * f64::exp(-0.2 / 5.5);
        lines.push(line(row, 200.0 * row as f64, voltage_v, reading));
    }
    lines
}

fn write(path: &Path, lines: &[String]) {
    let text = lines.iter().fold(String::new(), |mut text, line| {
        writeln!(text, "{line}").unwrap();
        text
    });
    std::fs::write(path, text).unwrap();
}

fn diagnose(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vsj")).current_dir(folder).arg("diagnose").args(arguments).output().unwrap()
}

fn report(output: &Output) -> Value {
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

/// The value of the gain.
fn gain(report: &Value) -> f64 {
    assert_eq!(report["findings"][0]["cause"], "gain-error", "{report}");
    report["findings"][0]["parameters"]["gain"]["value"].as_f64().unwrap()
}

#[test]
fn columns_file_and_sort_read_what_the_instrument_wrote() {
    let folder = tempdir().unwrap();
    let plain = table("time_s,voltage_v,stiffness", |_, ms, volts, reading| format!("{},{volts},{reading}", ms / 1e3));
    write(&folder.path().join("plain.csv"), &plain);
    let mut other =
        table("t_ms;u;x", |_, ms, volts, reading| format!("{ms};{};{reading}", volts / 1e3).replace('.', ","));
    other.swap(100, 300);
    write(&folder.path().join("other.csv"), &other);
    let columns = "[columns]\ntime = \"t_ms:ms\"\nvoltage = \"u:kV\"\nreading = \"x:V\"\n";
    std::fs::write(folder.path().join("columns.toml"), columns).unwrap();
    let expected = gain(&report(&diagnose(folder.path(), &["plain.csv", "--json"])));
    let arguments = ["other.csv", "--columns", "columns.toml", "--json"];
    let refused = diagnose(folder.path(), &arguments);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(said.contains("other.csv, line") && said.contains("--sort"), "{said}");
    let sorted = report(&diagnose(folder.path(), &[&arguments[..], &["--sort"]].concat()));
    assert!((gain(&sorted) / expected - 1.0).abs() < 1e-6, "{} {expected}", gain(&sorted));
}

#[test]
fn progress_is_on_stderr_also_with_json() {
    let folder = tempdir().unwrap();
    let plain = table("time_s,voltage_v,stiffness", |_, ms, volts, reading| format!("{},{volts},{reading}", ms / 1e3));
    write(&folder.path().join("plain.csv"), &plain);
    let output = diagnose(folder.path(), &["plain.csv", "--json", "--progress"]);
    assert_eq!(report(&output)["complete"], true);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.lines().any(|line| line.ends_with("so far: gain-error")), "{said}");
}

#[test]
fn time_limit_gives_the_best_answer_so_far() {
    let folder = tempdir().unwrap();
    let plain = table("time_s,voltage_v,stiffness", |_, ms, volts, reading| format!("{},{volts},{reading}", ms / 1e3));
    write(&folder.path().join("plain.csv"), &plain);
    let output = diagnose(folder.path(), &["plain.csv", "--json", "--within", "0.000001", "--effort", "thorough"]);
    assert_eq!(report(&output)["complete"], false);
}
