//! What becomes of the MCU when the output of `vsj link` is lost: nothing that it would not become otherwise.

use std::fs::File;
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::Duration;

use link::State;
use simulation::record::{MEASURED, Record};

use crate::mcu::{Mcu, Setup};
use crate::vsj::{bad, vsj};

/// The writing end of a pipe whose reader is gone.
fn closed_pipe() -> Stdio {
    let (_, writer) = std::io::pipe().unwrap();
    writer.into()
}

/// A device on which no byte can be written.
fn full_device() -> Stdio {
    File::options().write(true).open("/dev/full").unwrap().into()
}

fn run(port: &str, arguments: &[&str], stdout: Stdio, stderr: Stdio) -> Output {
    vsj(port, arguments).stdout(stdout).stderr(stderr).output().unwrap()
}

#[test]
fn lost_output_never_ends_a_link_command_with_a_panic() {
    let mcu = Mcu::on_socket(Setup { silence_ms: 1000, ..Setup::default() });
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let record = ["record", out.to_str().unwrap(), "--force", "--seconds", "0.2", "--arm"];
    let capture = ["capture", "--out", out.to_str().unwrap(), "--force", "--seconds", "0.05", "--arm"];
    for (code, arguments) in [
        (0, &["status"][..]),
        (0, &["status", "--json"]),
        (0, &["arm"]),
        (0, &["set", "100", "--arm", "--keep", "0.2"]),
        (0, &["watch", "--seconds", "0.2", "--every", "0.05"]),
        (0, &["watch", "--seconds", "0.2", "--every", "0.05", "--json"]),
        (0, &record),
        (0, &capture),
        (0, &["disarm"]),
        (0, &["isolation"]),
        (0, &["adaptation"]),
        (0, &["settings"]),
        (0, &["model"]),
        (0, &["model", "paper"]),
        (0, &["acknowledge", "panic"]),
        (1, &["set", "100"]),
        (2, &["set", "701", "--arm"]),
        (2, &["jump"]),
    ] {
        let ends = |stdout, stderr| run(&mcu.port, arguments, stdout, stderr).status;
        let message = |lost: &str| format!("{arguments:?} with {lost}");
        assert_eq!(ends(closed_pipe(), Stdio::null()).code(), Some(code), "{}", message("a closed stdout"));
        assert_eq!(ends(full_device(), Stdio::null()).code(), Some(code.max(1)), "{}", message("a full stdout"));
        assert_eq!(ends(Stdio::null(), closed_pipe()).code(), Some(code), "{}", message("a closed stderr"));
        assert_eq!(ends(Stdio::null(), full_device()).code(), Some(code), "{}", message("a full stderr"));
    }
}

#[test]
fn an_armed_recording_with_lost_output_is_complete_and_ends_disarmed() {
    let mcu = Mcu::on_socket(Setup { silence_ms: 1000, ..Setup::default() });
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.csv");
    std::fs::write(&input, "time_s,voltage_v\n0,50\n0.6,50\n").unwrap();
    for (name, code, stdout, stderr) in
        [("closed.csv", 0, closed_pipe(), closed_pipe()), ("full.csv", 1, full_device(), full_device())]
    {
        let out = folder.path().join(name);
        let arguments = ["record", out.to_str().unwrap(), "--input", input.to_str().unwrap(), "--arm"];
        assert_eq!(run(&mcu.port, &arguments, stdout, stderr).status.code(), Some(code), "{name}");
        let rows = Record::open(&out, MEASURED).unwrap().rows;
        assert!(rows.last().unwrap().time_s > 0.4, "{name}: {:?}", rows.last());
        assert_eq!(mcu.wait_for(State::Disarmed).code, 0, "{name}");
    }
}

#[test]
fn an_armed_mcu_is_kept_armed_for_as_long_as_asked_when_the_answer_is_lost() {
    let mcu = Mcu::on_socket(Setup { silence_ms: 1000, ..Setup::default() });
    for arguments in [&["arm", "--keep", "2.5"][..], &["set", "100", "--arm", "--keep", "2.5"]] {
        let kept = vsj(&mcu.port, arguments).stdout(full_device()).stderr(Stdio::piped()).spawn().unwrap();
        mcu.wait_for(State::Armed);
        std::thread::sleep(Duration::from_millis(1800));
        assert_eq!(mcu.with(|shared| shared.sample.state), State::Armed, "{arguments:?}");
        let kept = kept.wait_with_output().unwrap();
        let text = String::from_utf8(kept.stderr).unwrap();
        assert_eq!((kept.status.code(), text.lines().count()), (Some(1), 1), "{arguments:?}: {text}");
        assert!(text.starts_with("vsj: stdout cannot be written: "), "{text}");
        assert_eq!(mcu.wait_for(State::Disarmed).code, 0, "{arguments:?}");
    }
}

#[test]
fn an_input_that_lasts_longer_than_a_recording_can_is_rejected_before_anything_is_sent() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let (input, out) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    let (input, out) = (input.to_str().unwrap(), out.to_str().unwrap());
    for (start, end) in [("0", "1e308"), ("-1e308", "1e308"), ("0", "1.1e9")] {
        std::fs::write(input, format!("time_s,voltage_v\n{start},50\n{end},50\n")).unwrap();
        for arguments in [&["--arm"][..], &[], &["--arm", "--seconds", "1"]] {
            let text = bad(2, &mcu.port, &[&["record", out, "--input", input], arguments].concat());
            assert!(text.contains("in.csv lasts ") && text.contains("expected at most 1000000000 s"), "{text}");
        }
    }
    assert!(!Path::new(out).exists() && mcu.with(|shared| shared.ordered.is_empty()));
}
