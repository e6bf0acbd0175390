//! The full screen of `vsj watch --emulated` in a pseudo-terminal: the command starts the board, and keys arm, set, stop and quit it.
//!
//! In: the command and the board's image. Out: an error with the screen unless each key shows what it must.

use std::io::{Read, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use portable_pty::{CommandBuilder, PtySize, native_pty_system};

/// Longest wait for what a key shows.
const PATIENCE: Duration = Duration::from_secs(60);
/// Size of the terminal, in characters.
const SIZE: PtySize = PtySize { rows: 30, cols: 100, pixel_width: 0, pixel_height: 0 };
/// Time between two looks at the screen.
const LOOK: Duration = Duration::from_millis(20);
/// Keys, and what the screen then shows.
const KEYS: [(&str, &str); 5] = [
    ("", " DISARMED "),
    ("a", " ARMED "),
    ("s300\r", "armed, target 300.000 V"),
    ("\x1b[A", "armed, target 310.000 V"),
    (" ", " DISARMED "),
];

/// Runs the command with an image and presses the keys.
pub(crate) fn run(vsj: &Path, elf: &Path) -> Result<()> {
    let pair = native_pty_system().openpty(SIZE)?;
    let mut command = CommandBuilder::new(vsj);
    command.args(["watch", "--emulated", "--timeout", "20", "--firmware"]);
    command.arg(elf);
    command.env("TERM", "xterm-256color");
    let mut child = pair.slave.spawn_command(command)?;
    let screen = Arc::new(Mutex::new(vt100::Parser::new(SIZE.rows, SIZE.cols, 0)));
    let (mut output, parser) = (pair.master.try_clone_reader()?, screen.clone());
    thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = output.read(&mut bytes) {
            parser.lock().unwrap_or_else(PoisonError::into_inner).process(&bytes[..count]);
        }
    });
    let shown = || screen.lock().unwrap_or_else(PoisonError::into_inner).screen().contents();
    let wait = |is_so: &mut dyn FnMut() -> Result<bool>| {
        let begin = Instant::now();
        while !is_so()? {
            ensure!(begin.elapsed() < PATIENCE, "after {} s the screen is:\n{}", PATIENCE.as_secs(), shown());
            thread::sleep(LOOK);
        }
        Ok(())
    };
    let mut keys = pair.master.take_writer()?;
    let pressed = KEYS.iter().try_for_each(|(key, expected)| {
        keys.write_all(key.as_bytes())?;
        wait(&mut || Ok(shown().contains(expected))).with_context(|| format!("key {key:?} does not show {expected:?}"))
    });
    let ended = pressed.and_then(|()| {
        keys.write_all(b"q")?;
        wait(&mut || Ok(child.try_wait()?.is_some())).context("q does not end it")
    });
    if ended.is_err() {
        let _ = child.kill();
    }
    ended?;
    let status = child.wait()?;
    ensure!(status.success(), "it ended with {}: {}", status.exit_code(), shown());
    println!("watch: the command started a board; keys armed it, set 300 V and 310 V, stopped it and quit");
    Ok(())
}
