//! Runs the command.

use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

pub(crate) fn vsj(port: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
    command.arg("link").arg(port).args(arguments);
    command
}

pub(crate) fn run(port: &str, arguments: &[&str]) -> Output {
    vsj(port, arguments).output().unwrap()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Asserts success; what came out.
pub(crate) fn good(port: &str, arguments: &[&str]) -> String {
    let output = run(port, arguments);
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    stdout(&output)
}

pub(crate) fn json(port: &str, arguments: &[&str]) -> Value {
    serde_json::from_str(&good(port, &[arguments, &["--json"]].concat())).unwrap()
}

/// Asserts an exit code, one line on stderr and nothing on stdout; returns that line.
pub(crate) fn bad(code: i32, port: &str, arguments: &[&str]) -> String {
    let output = run(port, arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {output:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!((text.lines().count(), output.stdout.len()), (1, 0), "{arguments:?}: {text}");
    text
}

pub(crate) fn start(port: &str, arguments: &[&str]) -> Child {
    vsj(port, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

pub(crate) fn send(signal: &str, to: &Child) {
    assert!(Command::new("kill").args([signal, &to.id().to_string()]).status().unwrap().success());
}
