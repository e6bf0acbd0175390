//! Reports of faults: each new fault is sent ahead of everything else, and again until the host has heard of it.

use model::supervisor::Faults;

use super::View;
use crate::diagnosis::Mismatch;
use crate::fault::Fault;
use crate::reply::FaultReport;

/// The faults that were seen, and what the host has heard of them.
#[derive(Clone, Debug)]
pub(super) struct Reports {
    standing: Faults,
    latest: FaultReport,
    /// Number of the last report that the host has heard.
    heard: u32,
    sent_at: Option<u64>,
}

impl Reports {
    /// No fault was seen yet.
    pub(super) const NEW: Self = Self {
        standing: Faults::NONE,
        latest: FaultReport { number: 0, tick: 0, fault: Fault::NONE, standing: 0, mismatch: Mismatch(0) },
        heard: 0,
        sent_at: None,
    };

    /// Takes the faults that stand after a tick. It has to see the tick in which a fault was acknowledged, so that the same
    /// one is a new fault when it comes again.
    pub(super) fn see(&mut self, view: &View) {
        let new = view.standing.except(self.standing);
        self.standing = view.standing;
        self.latest.standing = view.standing.bits();
        if let Some(fault) = new.iter().next() {
            let number = self.latest.number.wrapping_add(new.iter().count() as u32);
            let (tick, mismatch) = (view.sample.tick, view.sample.mismatch);
            self.latest = FaultReport { number, tick, fault: fault.into(), mismatch, ..self.latest };
            self.sent_at = None;
        }
    }

    /// The report to send at tick `now`, at most every `interval` ticks; `None` if the host has heard of every fault.
    pub(super) fn due(&mut self, now: u64, interval: u64) -> Option<FaultReport> {
        let due = self.latest.number != self.heard && self.sent_at.is_none_or(|at| now.saturating_sub(at) >= interval);
        if due {
            self.sent_at = Some(now);
        }
        due.then_some(self.latest)
    }

    /// Ends the repetition if `number` is that of the latest report.
    pub(super) fn hear(&mut self, number: u32) {
        if number == self.latest.number {
            self.heard = number;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::Telemetry;
    use model::supervisor::{self, State};

    fn view(tick: u64, fault: Option<supervisor::Fault>) -> View {
        View {
            sample: Telemetry { tick, ..Telemetry::default() },
            state: fault.map_or(State::Disarmed, State::Faulted),
            standing: fault.map_or(Faults::NONE, |fault| Faults::NONE.with(fault)),
            refusal: None,
            overruns: 0,
        }
    }

    #[test]
    fn every_fault_is_reported_and_heard_across_the_wrap_of_its_number() {
        let before = u32::MAX - 3;
        let mut reports = Reports::NEW;
        (reports.latest.number, reports.heard) = (before, before);
        for step in 1..=8 {
            let now = 10 * u64::from(step);
            let number = before.wrapping_add(step);
            reports.see(&view(now, Some(supervisor::Fault::Interlock)));
            assert_eq!(reports.due(now, 5).map(|report| report.number), Some(number), "reported");
            reports.hear(number.wrapping_sub(1));
            assert_eq!(reports.due(now + 4, 5), None, "not yet again");
            assert!(reports.due(now + 5, 5).is_some(), "an earlier number does not end the repetition");
            reports.hear(number);
            assert_eq!(reports.due(now + 10, 5), None, "heard");
            reports.see(&view(now + 1, None));
        }
    }
}
