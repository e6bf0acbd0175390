//! Starts other programs: prints the command line first, and returns an error that names the program when it fails.

use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use anyhow::{Context, Result, anyhow, ensure};
use serde_json::Value;

/// Target triple of the MCU.
pub const MCU: &str = "thumbv7em-none-eabihf";

/// The root folder of the workspace.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask is a folder of the workspace")
}

/// A command whose working directory is [`root`].
pub fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root());
    command
}

/// A command of the cargo that started `cargo xtask`, with [`root`] as its working directory.
pub fn cargo() -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Prints `command` to stderr and runs it to its end. Its stdout goes to stderr, because stdout is reserved for
/// results. An exit code other than 0 is an error.
pub fn run(command: &mut Command) -> Result<()> {
    eprintln!("$ {}", line(command));
    let status = command.stdout(Stdio::from(io::stderr())).status().map_err(|e| not_started(command, e))?;
    succeeded(command, status)
}

/// Runs `command` as [`run`] does, and returns its stdout as well.
pub fn run_and_read(command: &mut Command) -> Result<String> {
    eprintln!("$ {}", line(command));
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(|e| not_started(command, e))?;
    let mut text = String::new();
    for line in child.stdout.take().into_iter().flat_map(|stdout| BufReader::new(stdout).lines()) {
        let line = line?;
        eprintln!("{line}");
        text += &(line + "\n");
    }
    succeeded(command, child.wait()?)?;
    Ok(text)
}

/// Runs `command` to its end and returns its stdout. An exit code other than 0 is an error.
pub fn output(command: &mut Command) -> Result<String> {
    let output = command.stderr(Stdio::inherit()).output().map_err(|e| not_started(command, e))?;
    succeeded(command, output.status)?;
    String::from_utf8(output.stdout).with_context(|| format!("`{}` printed bytes that are not UTF-8", line(command)))
}

/// Runs `command` to its end and parses its stdout as JSON.
pub fn json(command: &mut Command) -> Result<Value> {
    let text = output(command)?;
    serde_json::from_str(&text).with_context(|| format!("`{}` did not print JSON", line(command)))
}

/// The output of `cargo metadata` for the packages of the workspace.
pub fn metadata() -> Result<Value> {
    json(cargo().args(["metadata", "--no-deps", "--format-version=1"]))
}

/// The folder that cargo builds in, absolute.
pub fn target_directory() -> Result<PathBuf> {
    let metadata = metadata()?;
    Ok(metadata["target_directory"].as_str().context("cargo metadata names no target directory")?.into())
}

/// An error that names the command if it ended with another exit code than 0.
fn succeeded(command: &Command, status: ExitStatus) -> Result<()> {
    ensure!(status.success(), "`{}` failed ({status})", line(command));
    Ok(())
}

fn not_started(command: &Command, error: io::Error) -> anyhow::Error {
    let program = command.get_program().display();
    match error.kind() {
        ErrorKind::NotFound => anyhow!("`{program}` is not installed"),
        _ => anyhow!("cannot start `{program}`: {error}"),
    }
}

/// The command line as a person would type it.
pub fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let program = program.file_name().unwrap_or(program.as_os_str());
    let set = command.get_envs().filter_map(|(key, value)| Some(format!("{}={}", key.display(), value?.display())));
    let words = [program].into_iter().chain(command.get_args()).map(|word| word.display().to_string());
    set.chain(words).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_command_prints_is_read_and_its_failure_is_an_error() {
        assert_eq!(run_and_read(command("echo").arg("one\ntwo")).unwrap(), "one\ntwo\n");
        assert!(run_and_read(&mut command("false")).unwrap_err().to_string().contains("`false` failed"));
    }
}
