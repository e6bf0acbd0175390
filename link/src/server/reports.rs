//! Reports of faults: each new fault is sent ahead of everything else, and again until the host has heard of it.

use model::supervisor::{self, Faults};

use super::View;
use crate::Mismatch;
use crate::reply::FaultReport;

/// Number of faults that there are.
const FAULTS: usize = supervisor::Fault::ALL.len();

/// The faults that were seen, and the reports of which the host has not heard: at most one of each fault, in the order of the faults'
/// codes. A fault replaces no report but its own earlier one, and comes again only after the host has acknowledged it by its code.
#[derive(Clone, Debug)]
pub(super) struct Reports {
    standing: Faults,
    /// The faults of whose report the host has not heard.
    unheard: Faults,
    /// The unheard faults whose report is still to be sent in this round.
    unsent: Faults,
    /// Number of faults since the start; it wraps around.
    number: u32,
    /// Tick in which the round began.
    round_at: u64,
    // An array of each part of a report: one of reports would have three bytes of padding in each.
    ticks: [u64; FAULTS],
    numbers: [u32; FAULTS],
    mismatches: [Mismatch; FAULTS],
}

impl Reports {
    /// No fault was seen yet.
    pub(super) const NEW: Self = Self {
        standing: Faults::NONE,
        unheard: Faults::NONE,
        unsent: Faults::NONE,
        number: 0,
        round_at: 0,
        ticks: [0; FAULTS],
        numbers: [0; FAULTS],
        mismatches: [Mismatch(0); FAULTS],
    };

    /// Takes the faults that stand after a tick. It has to see the tick in which a fault was acknowledged, so that the same
    /// one is a new fault when it comes again.
    pub(super) fn see(&mut self, view: &View) {
        let new = view.standing.except(self.standing);
        self.standing = view.standing;
        for fault in new.iter() {
            self.number = self.number.wrapping_add(1);
            let place = place(fault);
            self.ticks[place] = view.sample.tick;
            self.numbers[place] = self.number;
            self.mismatches[place] = view.sample.mismatch;
            self.unheard = self.unheard.with(fault);
            self.unsent = self.unsent.with(fault);
        }
    }

    /// The oldest of the reports to send at tick `now`, with the faults that stand now; `None` if none is due. A new report is sent in the
    /// present round, and every one again in the next, `interval` ticks later.
    pub(super) fn due(&mut self, now: u64, interval: u64) -> Option<FaultReport> {
        if self.unsent == Faults::NONE && now.saturating_sub(self.round_at) >= interval {
            self.unsent = self.unheard;
        }
        if self.unsent == self.unheard {
            self.round_at = now;
        }
        let age = |fault: &supervisor::Fault| self.number.wrapping_sub(self.numbers[place(*fault)]);
        let fault = self.unsent.iter().max_by_key(age)?;
        self.unsent = self.unsent.without(fault);
        let place = place(fault);
        Some(FaultReport {
            number: self.numbers[place],
            tick: self.ticks[place],
            fault: fault.into(),
            standing: self.standing.bits(),
            mismatch: self.mismatches[place],
        })
    }

    /// Ends the repetition of the report with this number.
    pub(super) fn hear(&mut self, number: u32) {
        for fault in self.unheard.iter().filter(|fault| self.numbers[place(*fault)] == number) {
            self.unheard = self.unheard.without(fault);
            self.unsent = self.unsent.without(fault);
        }
    }
}

/// Returns the place of a fault's report.
fn place(fault: supervisor::Fault) -> usize {
    usize::from(fault.code()) % FAULTS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::Telemetry;
    use model::supervisor::{Fault, State};
    use std::vec::Vec;

    fn view(tick: u64, faults: &[Fault]) -> View {
        View {
            sample: Telemetry { tick, ..Telemetry::default() },
            state: faults.first().map_or(State::Disarmed, |fault| State::Faulted(*fault)),
            standing: faults.iter().copied().collect(),
            refusal: None,
            overruns: 0,
        }
    }

    /// The reports that are sent at tick `now`: one more than there are faults if they never end, which fails a test that would otherwise
    /// not end.
    fn all_due(reports: &mut Reports, now: u64) -> Vec<FaultReport> {
        core::iter::from_fn(|| reports.due(now, 5)).take(FAULTS + 1).collect()
    }

    /// Number and fault of each report that is sent at tick `now`.
    fn sent(reports: &mut Reports, now: u64) -> Vec<(u32, u8)> {
        all_due(reports, now).into_iter().map(|report| (report.number, report.fault.0)).collect()
    }

    #[test]
    fn every_fault_is_reported_and_heard_across_the_wrap_of_its_number() {
        let before = u32::MAX - 3;
        let mut reports = Reports { number: before, ..Reports::NEW };
        for step in 1..=8 {
            let now = 10 * u64::from(step);
            let number = before.wrapping_add(step);
            reports.see(&view(now, &[Fault::Interlock]));
            assert_eq!(sent(&mut reports, now), [(number, 4)], "reported");
            reports.hear(number.wrapping_sub(1));
            assert_eq!(reports.due(now + 4, 5), None, "not yet again");
            assert!(reports.due(now + 5, 5).is_some(), "an earlier number does not end the repetition");
            reports.hear(number);
            assert_eq!(reports.due(now + 10, 5), None, "heard");
            reports.see(&view(now + 1, &[]));
        }
    }

    #[test]
    fn a_report_that_nobody_has_heard_outlives_its_fault_and_every_later_one() {
        // The numbers wrap around between the faults.
        let mut reports = Reports { number: u32::MAX - 1, ..Reports::NEW };
        reports.see(&view(1, &[Fault::Monitor]));
        assert_eq!(sent(&mut reports, 1), [(u32::MAX, 6)]);
        reports.see(&view(2, &[]));
        // Three in one tick, of which one has the lowest code of all.
        reports.see(&view(3, &[Fault::Panic, Fault::Interlock, Fault::Watchdog]));
        assert_eq!(sent(&mut reports, 3), [(0, 1), (1, 4), (2, 5)], "the new ones do not wait");
        assert_eq!(sent(&mut reports, 5), [], "not yet again");
        assert_eq!(sent(&mut reports, 6), [(u32::MAX, 6), (0, 1), (1, 4), (2, 5)], "the first one is still sent");
        assert_eq!(sent(&mut reports, 10), [], "not yet again");
        reports.hear(1);
        assert_eq!(sent(&mut reports, 20), [(u32::MAX, 6), (0, 1), (2, 5)], "the oldest first");
        // The monitor fault has been acknowledged and comes again: its earlier report is the only one that is replaced.
        reports.see(&view(21, &[Fault::Panic, Fault::Watchdog, Fault::Monitor]));
        assert_eq!(sent(&mut reports, 21), [(3, 6)]);
        assert_eq!(sent(&mut reports, 25), [(0, 1), (2, 5), (3, 6)]);
        for number in [u32::MAX, 0, 2, 3] {
            reports.hear(number);
        }
        assert_eq!(sent(&mut reports, 100), []);
    }

    #[test]
    fn a_report_has_its_own_tick_and_mismatch_and_the_faults_that_stand_when_it_is_sent() {
        let mut reports = Reports::NEW;
        let mut first = view(7, &[Fault::Monitor]);
        first.sample.mismatch = crate::Mismatch(3);
        reports.see(&first);
        reports.see(&view(9, &[Fault::Monitor, Fault::Supply]));
        let sent = all_due(&mut reports, 9);
        let expected = |number, tick, fault: Fault, mismatch| FaultReport {
            number,
            tick,
            fault: fault.into(),
            standing: 0xa0,
            mismatch: crate::Mismatch(mismatch),
        };
        assert_eq!(sent, [expected(1, 7, Fault::Monitor, 3), expected(2, 9, Fault::Supply, 0)]);
    }
}
