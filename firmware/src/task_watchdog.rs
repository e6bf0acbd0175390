//! Check that every task is alive: the hardware watchdog is fed only after all registered tasks have checked in.

use core::sync::atomic::{AtomicU32, Ordering};

/// A task that must check in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Task {
    /// The control task.
    Control = 1,
    /// The housekeeping task, which writes the log.
    Housekeeping = 2,
    /// The task that communicates with the host.
    Link = 4,
}

/// The watchdog of the program's tasks.
pub static TASK_WATCHDOG: TaskWatchdog = TaskWatchdog::new();

/// The registered tasks, and those that have checked in during the current round.
#[derive(Debug)]
pub struct TaskWatchdog {
    registered: AtomicU32,
    checked_in: AtomicU32,
}

impl TaskWatchdog {
    /// A watchdog without registered tasks.
    pub const fn new() -> Self {
        Self { registered: AtomicU32::new(0), checked_in: AtomicU32::new(0) }
    }

    /// Requires `task` to check in from now on.
    pub fn register(&self, task: Task) {
        self.registered.fetch_or(task as u32, Ordering::Relaxed);
    }

    /// Reports that `task` is alive.
    pub fn check_in(&self, task: Task) {
        self.checked_in.fetch_or(task as u32, Ordering::Relaxed);
    }

    /// True if all registered tasks have checked in; then a new round starts. Only one task may call it.
    pub fn complete(&self) -> bool {
        let registered = self.registered.load(Ordering::Relaxed);
        let complete = self.checked_in.load(Ordering::Relaxed) & registered == registered;
        if complete {
            self.checked_in.store(0, Ordering::Relaxed);
        }
        complete
    }
}

impl Default for TaskWatchdog {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_is_complete_only_when_every_registered_task_has_checked_in() {
        let watchdog = TaskWatchdog::new();
        watchdog.register(Task::Control);
        watchdog.register(Task::Housekeeping);
        watchdog.check_in(Task::Control);
        assert!(!watchdog.complete());
        watchdog.check_in(Task::Housekeeping);
        assert!(watchdog.complete());
        watchdog.check_in(Task::Control);
        assert!(!watchdog.complete(), "the previous round does not count");
        watchdog.check_in(Task::Link);
        assert!(!watchdog.complete(), "a task that is not registered does not count");
    }
}
