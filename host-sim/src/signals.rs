//! Signals that end the program: Ctrl-C, SIGTERM and SIGHUP.
//!
//! In: what the first signal does, the temporary folders that exist, and what else is to be undone. Out: a program that ends
//! with the code 128 plus the signal's number, leaves no temporary folder, and is not ended while results are moved to their
//! places.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is done once; its argument is the number of the signal.
type OnSignal = Box<dyn FnOnce(i32) + Send>;
/// What is done once.
type Action = Box<dyn FnOnce() + Send>;

/// Temporary folders that exist. Whoever holds the lock is not interrupted.
static FOLDERS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
/// What the next Ctrl-C does instead of ending the program.
static ON_CTRL_C: Mutex<Option<Action>> = Mutex::new(None);
/// What the next signal does instead of ending the program.
static ON_SIGNAL: Mutex<Option<OnSignal>> = Mutex::new(None);
/// What is done before a signal ends the program.
static AT_END: Mutex<Vec<Action>> = Mutex::new(Vec::new());

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes the next Ctrl-C call `action`; the one after it ends the program.
pub fn on_ctrl_c(action: impl FnOnce() + Send + 'static) {
    *lock(&ON_CTRL_C) = Some(Box::new(action));
}

/// Makes the next signal, whichever of those that end the program, call `action` with its number; the one after it ends the
/// program.
pub fn on_signal(action: impl FnOnce(i32) + Send + 'static) {
    *lock(&ON_SIGNAL) = Some(Box::new(action));
}

/// Does `action` before a signal ends the program. It is not done when the program ends otherwise.
pub fn at_end(action: impl FnOnce() + Send + 'static) {
    lock(&AT_END).push(Box::new(action));
}

/// Runs `work` without being ended by a signal.
pub fn uninterrupted<T>(work: impl FnOnce() -> T) -> T {
    let _held = lock(&FOLDERS);
    work()
}

/// A temporary folder that is removed when it is dropped or the program is ended by a signal.
#[derive(Debug)]
pub struct TemporaryFolder {
    path: PathBuf,
}

impl TemporaryFolder {
    /// Creates a folder with a name of its own, hidden, in `folder`.
    ///
    /// # Errors
    /// If it cannot be created.
    pub fn new_in(folder: &Path) -> io::Result<Self> {
        let mut folders = lock(&FOLDERS);
        let path = tempfile::Builder::new().prefix(".vsj-").tempdir_in(folder)?.keep();
        folders.insert(path.clone());
        Ok(Self { path })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        let mut folders = lock(&FOLDERS);
        // It may have become the folder of the results.
        let _ = fs::remove_dir_all(&self.path);
        folders.remove(&self.path);
    }
}

/// Ends the program as `signal` would, without leaving a temporary folder.
pub fn end(signal: i32) -> ! {
    for action in lock(&AT_END).drain(..) {
        action();
    }
    let folders = lock(&FOLDERS);
    for path in folders.iter() {
        // Under another name first: a file that is created in it meanwhile would keep the folder.
        let away = path.with_extension("away");
        let path = if fs::rename(path, &away).is_ok() { &away } else { path };
        let _ = fs::remove_dir_all(path);
    }
    std::process::exit(128 + signal)
}

/// Handles the signals from now on, in a thread of its own. A SIGHUP that is ignored, as under nohup, stays so.
///
/// # Errors
/// If the thread cannot be started.
#[cfg(unix)]
pub fn handle() -> io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let hang_up = (ignored() & (1 << (SIGHUP - 1)) == 0).then_some(SIGHUP);
    let handled = [SIGINT, SIGTERM].into_iter().chain(hang_up);
    let mut signals = signal_hook::iterator::Signals::new(handled)?;
    let handle = move || {
        for signal in signals.forever() {
            let action = if signal == SIGINT { lock(&ON_CTRL_C).take() } else { None };
            if let Some(action) = action {
                action();
                continue;
            }
            let action = lock(&ON_SIGNAL).take();
            match action {
                Some(action) => action(signal),
                None => end(signal),
            }
        }
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(handle).map(drop)
}

/// The set of the signals that the program was started with to ignore, bit `n - 1` for signal `n`; empty where the kernel
/// does not say.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Handles Ctrl-C from now on.
///
/// # Errors
/// If the handler cannot be installed.
#[cfg(not(unix))]
pub fn handle() -> io::Result<()> {
    const SIGINT: i32 = 2;
    let handler = || {
        let (ctrl_c, any) = (lock(&ON_CTRL_C).take(), lock(&ON_SIGNAL).take());
        match (ctrl_c, any) {
            (Some(action), _) => action(),
            (None, Some(action)) => action(SIGINT),
            (None, None) => end(SIGINT),
        }
    };
    ctrlc::set_handler(handler).map_err(io::Error::other)
}
