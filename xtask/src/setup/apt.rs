//! Installs packages with apt-get, and waits for its locks while another one runs.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::shell;

/// Longest wait for another apt-get.
const PATIENCE: Duration = Duration::from_secs(15 * 60);
/// Time between two attempts.
const PAUSE: Duration = Duration::from_secs(2);

/// Updates the package lists and installs `package` without what it only recommends.
pub(super) fn install(package: &str) -> Result<()> {
    let is_root = shell::output(shell::command("id").arg("-u"))?.trim() == "0";
    for args in [&["update"][..], &["install", "--yes", "--no-install-recommends", package]] {
        patiently(|| apt_get(is_root, args), PATIENCE, PAUSE)?;
    }
    Ok(())
}

/// The command for root, or through sudo for anybody else. sudo drops the caller's environment, so `env` sets it behind
/// sudo.
fn apt_get(is_root: bool, args: &[&str]) -> Command {
    let words: &[&str] = if is_root { &["env"] } else { &["sudo", "--non-interactive", "env"] };
    let mut command = shell::command(words[0]);
    command.args(&words[1..]).args(["LC_ALL=C", "DEBIAN_FRONTEND=noninteractive", "apt-get"]).args(args);
    command
}

/// Runs a command again, up to `patience` after the first attempt, as long as it fails because another process holds a
/// lock.
///
/// apt-get can wait for dpkg's locks itself (`DPkg::Lock::Timeout`), but not for those of the package lists and of the
/// archive.
fn patiently(command: impl Fn() -> Command, patience: Duration, pause: Duration) -> Result<()> {
    let line = shell::line(&command());
    eprintln!("$ {line}");
    let begin = Instant::now();
    let mut waiting_for = None;
    loop {
        match attempt(&mut command(), &line)? {
            Attempt::Done => return Ok(()),
            Attempt::Locked(lock) if begin.elapsed() < patience => {
                if waiting_for.as_ref() != Some(&lock) {
                    eprintln!("setup: another apt-get is running, waiting for it ({lock})");
                    waiting_for = Some(lock);
                }
                thread::sleep(pause);
            }
            Attempt::Locked(lock) => bail!("another apt-get still runs after {} s: {lock}", patience.as_secs()),
        }
    }
}

enum Attempt {
    Done,
    /// The message that names the lock.
    Locked(String),
}

/// Runs the command once. Its output goes to stderr, except for messages about locks.
fn attempt(command: &mut Command, line: &str) -> Result<Attempt> {
    let mut child = command
        .stdout(Stdio::from(std::io::stderr()))
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{line}`"))?;
    let mut locked = None;
    for message in BufReader::new(child.stderr.take().context("a pipe that was asked for")?).lines() {
        let message = message?;
        match lock(&message) {
            Some(lock) => _ = locked.get_or_insert(lock.to_owned()),
            None if locked.is_none() => eprintln!("{message}"),
            None => {}
        }
    }
    match (child.wait()?, locked) {
        (status, _) if status.success() => Ok(Attempt::Done),
        (_, Some(lock)) => Ok(Attempt::Locked(lock)),
        (status, None) => bail!("`{line}` failed ({status})"),
    }
}

/// The part of a message of apt-get's that says which lock is held and by whom.
fn lock(message: &str) -> Option<&str> {
    message.strip_prefix("E: Could not get lock ").map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The message of apt 2.6 and 3.0 that its lists are locked; the second line is for root alone.
    const HELD: &str = "E: Could not get lock /var/lib/apt/lists/lock. It is held by process 4711 (apt-get)";

    #[test]
    fn messages_about_locks_are_recognised() {
        assert_eq!(lock(HELD), Some("/var/lib/apt/lists/lock. It is held by process 4711 (apt-get)"));
        assert_eq!(
            lock("E: Could not get lock /var/lib/dpkg/lock-frontend - open (11)").map(|l| &l[..13]),
            Some("/var/lib/dpkg")
        );
        assert_eq!(lock("E: Unable to locate package qemu"), None);
    }

    /// A shell that reports a held lock until `file` exists, and creates it at its second attempt.
    fn locked_once(file: &str) -> Command {
        let script = format!("if [ -e {file} ]; then rm {file}; else touch {file}; echo '{HELD}' >&2; exit 100; fi");
        let mut command = Command::new("sh");
        command.args(["-c", &script]);
        command
    }

    #[test]
    fn a_held_lock_is_waited_for() {
        let file = std::env::temp_dir().join(format!("xtask-lock-{}", std::process::id())).display().to_string();
        patiently(|| locked_once(&file), Duration::from_secs(60), Duration::from_millis(1)).unwrap();
        assert!(!std::path::Path::new(&file).exists(), "the second attempt ran");
    }

    #[test]
    fn a_lock_held_for_too_long_is_an_error_that_names_it() {
        let always = || {
            let mut command = Command::new("sh");
            command.args(["-c", &format!("echo '{HELD}' >&2; exit 100")]);
            command
        };
        let error = patiently(always, Duration::ZERO, Duration::ZERO).unwrap_err().to_string();
        assert!(error.contains("lists/lock") && error.contains("4711"), "{error}");
    }

    #[test]
    fn other_failures_are_not_repeated() {
        let error = patiently(|| Command::new("false"), Duration::from_secs(60), Duration::ZERO).unwrap_err();
        assert!(error.to_string().contains("`false` failed"), "{error}");
    }

    #[test]
    fn the_environment_is_set_behind_sudo() {
        assert_eq!(
            shell::line(&apt_get(false, &["update"])),
            "sudo --non-interactive env LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get update"
        );
    }
}
