//! Computations that Ctrl-C ends.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use anyhow::Result;
use identify::Stop;
use pyo3::{PyResult, Python};

use crate::error::exception;

/// Longest time until a signal is noticed.
const POLL: Duration = Duration::from_millis(50);

/// Runs `work` in another thread, without the interpreter's lock. At a signal for which the interpreter has an exception, as
/// Ctrl-C has, requests `stop` and raises the exception.
///
/// # Errors
/// The error of `work` as an exception, or the exception of a signal.
pub(crate) fn run<T: Send>(py: Python<'_>, stop: &Stop, work: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    thread::scope(|scope| {
        let (done, finished) = channel::<()>();
        let worker = scope.spawn(move || {
            // Dropped when the work ends, also by a panic.
            let _done = done;
            work()
        });
        let mut interrupted = None;
        let finished = std::sync::Mutex::new(finished);
        loop {
            let ended = py.detach(|| {
                let finished = finished.lock().expect("only this thread locks it");
                finished.recv_timeout(POLL) == Err(RecvTimeoutError::Disconnected)
            });
            if ended {
                break;
            }
            if interrupted.is_none()
                && let Err(signal) = py.check_signals()
            {
                stop.request();
                interrupted = Some(signal);
            }
        }
        let answer = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
        interrupted.map_or_else(|| answer.map_err(exception), Err)
    })
}
