//! Ctrl-C during a diagnosis: the first gives the best answer so far, the second ends the program.
#![cfg(unix)]

use std::fmt::Write;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use random_numbers::Lcg32;
use tempfile::TempDir;

/// Rows of a voltage that changes at every row, with a response that no cause explains: a thorough search takes minutes.
fn write_record(path: &Path) {
    let mut numbers = Lcg32::new(1);
    let mut text = "time_s,voltage_v,stiffness\n".to_owned();
    let mut slow = 0.0;
    for row in 0..4000 {
        let voltage_v = 500.0 * numbers.uniform();
        let reading = slow + 0.0006 * (voltage_v - slow) * (slow - 250.0) * (slow / 60.0).sin() + numbers.uniform();
        slow += 0.04 * (voltage_v - slow);
        writeln!(text, "{},{voltage_v},{reading}", 0.2 * f64::from(row)).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

/// Starts a thorough diagnosis with its files in `out`, and waits until its search has begun.
fn start(folder: &Path) -> Child {
    let record = folder.join("record.csv");
    write_record(&record);
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
    command.arg("diagnose").arg(&record).args(["--effort", "thorough", "--progress", "--json", "--out"]);
    let mut diagnosis = command.arg(folder.join("out")).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut first = String::new();
    let mut lines = BufReader::new(diagnosis.stderr.take().unwrap());
    assert!(lines.read_line(&mut first).unwrap() > 0, "no progress is shown");
    // What follows is read, so that the pipe never fills.
    std::thread::spawn(move || lines.lines().for_each(drop));
    diagnosis
}

fn interrupt(diagnosis: &Child) {
    assert!(Command::new("kill").args(["-INT", &diagnosis.id().to_string()]).status().unwrap().success());
}

/// Names of the files in a folder.
fn files(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    names.map(|name| name.to_string_lossy().into_owned()).collect()
}

#[test]
fn first_ctrl_c_gives_the_best_answer_so_far() {
    let folder = tempfile::tempdir().unwrap();
    let diagnosis = start(folder.path());
    interrupt(&diagnosis);
    let Output { status, stdout, .. } = diagnosis.wait_with_output().unwrap();
    assert!(status.success(), "{status}");
    let report: serde_json::Value = serde_json::from_slice(&stdout).unwrap();
    assert_eq!(report["complete"], false);
    let files = files(&folder.path().join("out"));
    assert!(files.iter().any(|name| name == "plant.toml"), "{files:?}");
    assert!(!files.iter().any(|name| name.starts_with('.')), "{files:?}");
}

/// Starts a diagnosis and interrupts it twice; `None` if a busy machine sent the second signal after the answer to the first.
fn interrupted_twice() -> Option<(TempDir, Output)> {
    let folder = tempfile::tempdir().unwrap();
    let diagnosis = start(folder.path());
    interrupt(&diagnosis);
    // Two signals that arrive together would be one.
    std::thread::sleep(Duration::from_millis(2));
    interrupt(&diagnosis);
    let output = diagnosis.wait_with_output().unwrap();
    (!output.status.success()).then_some((folder, output))
}

#[test]
fn second_ctrl_c_ends_the_program_and_leaves_nothing() {
    let (folder, Output { status, stdout, .. }) =
        (0..10).find_map(|_| interrupted_twice()).expect("a second signal in time");
    assert_eq!((status.code(), stdout.len()), (Some(130), 0));
    let mut left = files(folder.path());
    left.sort_unstable();
    assert_eq!(left, ["out", "record.csv"], "no temporary folder");
    assert!(files(&folder.path().join("out")).is_empty());
}
