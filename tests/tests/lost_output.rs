//! The exit code of every subcommand when stdout or stderr cannot be written; `vsj link` is tested with its MCU in
//! `host-sim/tests/link/`.
#![cfg(target_os = "linux")]

use std::fs::{self, File};
use std::path::Path;
use std::process::{Output, Stdio};

use end_to_end::defmt::Firmware;
use end_to_end::vsj::{text, vsj};

/// The writing end of a pipe whose reader is gone.
fn closed_pipe() -> Stdio {
    let (_, writer) = std::io::pipe().expect("pipes are available");
    writer.into()
}

/// A device on which no byte can be written.
fn full_device() -> Stdio {
    File::options().write(true).open("/dev/full").expect("Linux has /dev/full").into()
}

fn run(folder: &Path, arguments: &[&str], stdout: Stdio, stderr: Stdio) -> Output {
    vsj().args(arguments).current_dir(folder).stdout(stdout).stderr(stderr).output().expect("vsj starts")
}

/// A folder with an ELF file, its log, complete and cut off, a spring that `vsj stair` does not simulate in full, and a record.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("there is room");
    let firmware = Firmware { encoding: "rzcobs", strings: vec![("info", "ready")] };
    let log = firmware.frame("ready", 1, &[]).repeat(1000);
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/sample_hysteresis.csv");
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("there is room");
    put("fw.elf", &firmware.elf());
    put("log.bin", &log);
    put("cut.bin", &log[..log.len() - 1]);
    put("spring.toml", include_bytes!("../../docs/plant.toml"));
    put("record.csv", &fs::read(sample).expect("the sample record is part of the repository"));
    let diagnosis = run(folder.path(), &["diagnose", "record.csv", "--json"], Stdio::piped(), Stdio::null());
    put("diagnosis.json", &diagnosis.stdout);
    folder
}

/// Arguments of `vsj` with its exit code when nothing is lost.
const COMMANDS: &[(i32, &[&str])] = &[
    (0, &["--help"]),
    (0, &["--version"]),
    (0, &["stair", "--help"]),
    (0, &[]),
    (0, &["stair", "--plant", "spring.toml"]),
    (0, &["stair", "--json"]),
    (0, &["adapt", "--spring-error", "gain=5"]),
    (0, &["beam", "--out", "out"]),
    (0, &["bound", "--spring-error", "share=10"]),
    (0, &["compare", "--limit-v", "700"]),
    (0, &["diagnose", "record.csv"]),
    (0, &["dynamics", "zener"]),
    (0, &["export", "model"]),
    (0, &["identify", "record.csv"]),
    (0, &["isolate", "record.csv"]),
    (0, &["joint"]),
    (0, &["log", "fw.elf", "log.bin"]),
    (0, &["log", "fw.elf", "log.bin", "--csv"]),
    (0, &["log", "fw.elf", "log.bin", "--json"]),
    (0, &["man", "--out", "man"]),
    (0, &["plan", "diagnosis.json", "--minutes", "1"]),
    (0, &["reproduce"]),
    (0, &["tune"]),
    (0, &["completions", "bash"]),
    (2, &["watch", "unix:/nonexistent", "--lines"]),
    (1, &["log", "fw.elf", "cut.bin", "--json"]),
    (2, &["link", "unix:/nonexistent", "status"]),
    (2, &["link", "unix:/nonexistent", "record", "out.csv", "--input", "long.csv"]),
    (2, &["diagnose", "missing.csv"]),
    (2, &["stair", "--limit-v", "-1"]),
    (2, &["jump"]),
];

#[test]
fn every_command_is_one_whose_output_is_lost() {
    let help = text(&vsj().arg("--help").output().expect("vsj starts").stdout);
    // A line of the list has the name two columns in, and further lines of its description none there.
    let names = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names: Vec<&str> =
        names.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.contains(&"diagnose") && names.len() > 15, "{names:?}");
    for name in names.into_iter().filter(|name| *name != "help") {
        assert!(COMMANDS.iter().any(|(_, arguments)| arguments.first() == Some(&name)), "{name}");
    }
}

#[test]
fn lost_output_ends_no_command_with_a_panic_or_a_signal() {
    let folder = folder();
    fs::write(folder.path().join("long.csv"), "time_s,voltage_v\n0,50\n1e308,50\n").expect("there is room");
    let folder = folder.path();
    for &(code, arguments) in COMMANDS {
        let whole = run(folder, arguments, Stdio::piped(), Stdio::piped());
        assert_eq!(whole.status.code(), Some(code), "{arguments:?}: {}", text(&whole.stderr));

        let output = run(folder, arguments, closed_pipe(), Stdio::piped());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?} with a closed stdout: {said}");
        assert_eq!(said, text(&whole.stderr), "{arguments:?} with a closed stdout");

        let output = run(folder, arguments, full_device(), Stdio::piped());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code.max(1)), "{arguments:?} with a full stdout: {said}");
        if !whole.stdout.is_empty() {
            let last = said.lines().last().unwrap_or_default();
            assert!(last.starts_with("vsj: stdout cannot be written: "), "{arguments:?} with a full stdout: {said}");
        }

        for (lost, stderr) in [("closed", closed_pipe()), ("full", full_device())] {
            let output = run(folder, arguments, Stdio::piped(), stderr);
            assert_eq!(output.status.code(), Some(code), "{arguments:?} with a {lost} stderr");
            assert_eq!(output.stdout, whole.stdout, "{arguments:?} with a {lost} stderr");
        }

        let output = run(folder, arguments, full_device(), full_device());
        assert_eq!(output.status.code(), Some(code.max(1)), "{arguments:?} with stdout and stderr full");
    }
}
