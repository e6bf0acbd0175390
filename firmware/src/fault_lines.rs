//! Faults whose lines of the log are not queued yet: a full queue delays them, and drops none.

use model::supervisor::{Fault, Faults};

/// The faults that wait for a place in the queue, each with the tick in which it came.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaultLines {
    waiting: Faults,
    /// Ticks in the order of [`Fault::ALL`].
    ticks: [u32; Fault::ALL.len()],
}

impl FaultLines {
    /// Takes the `faults` that have come in `tick`. One that still waits has its newest tick.
    pub fn add(&mut self, faults: Faults, tick: u32) {
        for (fault, at) in Fault::ALL.iter().zip(&mut self.ticks) {
            if faults.contains(*fault) {
                *at = tick;
            }
        }
        self.waiting = self.waiting.and(faults);
    }

    /// Passes the waiting faults with their ticks to `queue`, until it returns false because it is full.
    pub fn pass(&mut self, mut queue: impl FnMut(Fault, u32) -> bool) {
        if self.waiting == Faults::NONE {
            return;
        }
        for (fault, tick) in Fault::ALL.iter().zip(&self.ticks) {
            if self.waiting.contains(*fault) {
                if !queue(*fault, *tick) {
                    return;
                }
                self.waiting = self.waiting.without(*fault);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Number of places in the queue of the tests: that of the log's channel.
    const PLACES: usize = 16;

    #[test]
    fn a_full_queue_delays_the_line_of_a_fault_and_drops_none() {
        let mut lines = FaultLines::default();
        let mut queue: Vec<Option<(Fault, u32)>> = std::vec![None; PLACES];
        let pass = |lines: &mut FaultLines, queue: &mut Vec<_>| {
            lines.pass(|fault, tick| {
                let has_room = queue.len() < PLACES;
                if has_room {
                    queue.push(Some((fault, tick)));
                }
                has_room
            });
        };
        lines.add(Faults::NONE.with(Fault::Interlock), 7);
        pass(&mut lines, &mut queue);
        lines.add(Faults::NONE.with(Fault::Monitor).with(Fault::Overrun), 9);
        pass(&mut lines, &mut queue);
        assert!(queue.iter().all(Option::is_none), "it was full");
        // One place at first, then all.
        queue.pop();
        pass(&mut lines, &mut queue);
        queue.drain(..PLACES - 1);
        pass(&mut lines, &mut queue);
        assert_eq!(queue, [(Fault::Overrun, 9), (Fault::Interlock, 7), (Fault::Monitor, 9)].map(Some));
        pass(&mut lines, &mut queue);
        assert_eq!(queue.len(), 3, "each is queued once");
    }
}
