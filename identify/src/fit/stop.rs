//! A request to end a diagnosis early: by time, by another thread, or by a function that is asked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Ends a diagnosis early with the best answer so far. Clones share the request.
///
/// ```
/// use std::time::Duration;
/// use identify::Stop;
///
/// let stop = Stop::default();
/// let of_other_thread = stop.clone();
/// assert!(!stop.requested());
/// of_other_thread.request();
/// assert!(stop.requested() && Stop::after(Duration::ZERO).requested());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Stop {
    deadline: Option<Instant>,
    asked: Option<fn() -> bool>,
    request: Arc<AtomicBool>,
}

impl Stop {
    /// Returns a stop after a time that begins now.
    pub fn after(time: Duration) -> Self {
        // A time that is too long to be added is none.
        Self { deadline: Instant::now().checked_add(time), ..Self::default() }
    }

    /// Returns a stop that asks a function whether the end was requested, where no other thread can request it. Once the function has
    /// returned true it is not asked again.
    pub fn when(asked: fn() -> bool) -> Self {
        Self { asked: Some(asked), ..Self::default() }
    }

    /// Requests the end.
    pub fn request(&self) {
        self.request.store(true, Ordering::Relaxed);
    }

    /// Returns true once the time is over or the end was requested.
    pub fn requested(&self) -> bool {
        if !self.request.load(Ordering::Relaxed) && self.asked.is_some_and(|asked| asked()) {
            self.request();
        }
        self.request.load(Ordering::Relaxed) || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}
