//! The watchdog is fed only when every task has checked in.

use core::sync::atomic::{AtomicU32, Ordering};

/// A task that must show that it lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Member {
    /// The control tick.
    Control = 1,
    /// Log and summary.
    Housekeeping = 2,
    /// The host's frames.
    Link = 4,
}

/// Who has checked in since the last time all had.
#[derive(Debug)]
pub struct RollCall {
    expected: AtomicU32,
    present: AtomicU32,
}

impl RollCall {
    /// Expects nobody yet.
    pub const fn new() -> Self {
        Self { expected: AtomicU32::new(0), present: AtomicU32::new(0) }
    }

    /// From now on `member` is expected.
    pub fn enrol(&self, member: Member) {
        self.expected.fetch_or(member as u32, Ordering::Relaxed);
    }

    /// `member` lives.
    pub fn check_in(&self, member: Member) {
        self.present.fetch_or(member as u32, Ordering::Relaxed);
    }

    /// True if all are there; then everybody has to check in anew. Called by one task only.
    pub fn complete(&self) -> bool {
        let expected = self.expected.load(Ordering::Relaxed);
        let all = self.present.load(Ordering::Relaxed) & expected == expected;
        if all {
            self.present.store(0, Ordering::Relaxed);
        }
        all
    }
}

impl Default for RollCall {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_missing_is_enough() {
        let call = RollCall::new();
        call.enrol(Member::Control);
        call.enrol(Member::Housekeeping);
        call.check_in(Member::Control);
        assert!(!call.complete());
        call.check_in(Member::Housekeeping);
        assert!(call.complete());
        call.check_in(Member::Control);
        assert!(!call.complete(), "the last time does not count");
        call.check_in(Member::Link);
        assert!(!call.complete(), "nor does somebody else");
    }
}
