//! The fast capture: the control tick writes a row of RAM, the host's task reads it afterwards.
//!
//! The tick does the same bounded work in every row, two words and a counter, and never waits: a row is read only once the
//! counter says that it is complete. Both tasks share atomic words; the tick interrupts the host's task, never the reverse.

use core::sync::atomic::{AtomicU32, Ordering};

use link::capture::{Capture, Captured, Row, Rows};
use link::{Reason, Reply, Telemetry};

/// State of the capture; the rows are in memory that each function is given.
#[derive(Debug)]
pub struct Recorder {
    wanted: AtomicU32,
    captured: AtomicU32,
    /// Missed ticks since the start, as seen by the last tick.
    overruns: AtomicU32,
}

impl Recorder {
    /// Without a capture.
    pub const fn new() -> Self {
        Self { wanted: AtomicU32::new(0), captured: AtomicU32::new(0), overruns: AtomicU32::new(0) }
    }

    /// Writes a tick, after which `overruns` ticks were missed since the start, if a capture wants it. To be called by
    /// the control task only.
    #[inline]
    pub fn tick(&self, memory: &[AtomicU32], sample: &Telemetry, overruns: u32) {
        let missed = overruns.wrapping_sub(self.overruns.load(Ordering::Relaxed));
        self.overruns.store(overruns, Ordering::Relaxed);
        let number = self.captured.load(Ordering::Relaxed);
        if number >= self.wanted.load(Ordering::Relaxed) {
            return;
        }
        // Before the first row nothing is missing.
        let missed = if number == 0 { 0 } else { missed };
        let at = 2 * number as usize;
        if let Some([first, second]) = memory.get(at..at + 2) {
            let row = Row::new(sample, missed).pack();
            first.store(row[0], Ordering::Relaxed);
            second.store(row[1], Ordering::Relaxed);
            self.captured.store(number + 1, Ordering::Release);
        }
    }

    /// Executes a request of the host. To be called by the host's task only.
    pub fn execute(&self, memory: &[AtomicU32], request: Capture) -> Reply {
        let most = (memory.len() / 2) as u32;
        match request {
            Capture::Start { rows } if rows > most => return Reply::Refused(Reason::TooManyRows { most }),
            Capture::Start { rows } => {
                // In this order: no tick may write a row between the two captures.
                self.wanted.store(0, Ordering::Release);
                self.captured.store(0, Ordering::Release);
                self.wanted.store(rows, Ordering::Release);
            }
            Capture::State => {}
            Capture::Read { first } => {
                let word = |at: usize| memory.get(at).map_or(0, |word| word.load(Ordering::Relaxed));
                let row = |number: u32| [word(2 * number as usize), word(2 * number as usize + 1)];
                return Reply::Rows(Rows::read(first, self.captured.load(Ordering::Acquire), row));
            }
        }
        let (wanted, captured) = (self.wanted.load(Ordering::Relaxed), self.captured.load(Ordering::Acquire));
        Reply::Captured(Captured { most, wanted, captured })
    }
}

impl Default for Recorder {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::WireVolts;
    use std::vec::Vec;

    fn memory(rows: usize) -> Vec<AtomicU32> {
        (0..2 * rows + 1).map(|_| AtomicU32::new(0xdead)).collect()
    }

    fn sample(tick: u64) -> Telemetry {
        Telemetry { tick, code: tick as u16, estimate: WireVolts(-(tick as i32)), ..Telemetry::default() }
    }

    fn captured(recorder: &Recorder, memory: &[AtomicU32]) -> Captured {
        let Reply::Captured(captured) = recorder.execute(memory, Capture::State) else { panic!() };
        captured
    }

    fn codes(recorder: &Recorder, memory: &[AtomicU32], first: u32) -> Vec<u16> {
        let Reply::Rows(rows) = recorder.execute(memory, Capture::Read { first }) else { panic!() };
        // Of one tick each: [`sample`] has code and estimate of its number.
        assert!(rows.iter().all(|row| row.stiffness == WireVolts(-i32::from(row.code))), "words of two rows are mixed");
        rows.iter().map(|row| row.code).collect()
    }

    #[test]
    fn each_tick_from_the_start_on_is_a_row_until_all_are_there() {
        let (recorder, memory) = (Recorder::new(), memory(20));
        (1..5).for_each(|tick| recorder.tick(&memory, &sample(tick), 0));
        assert_eq!(captured(&recorder, &memory), Captured { most: 20, wanted: 0, captured: 0 });
        recorder.execute(&memory, Capture::Start { rows: 15 });
        (5..10).for_each(|tick| recorder.tick(&memory, &sample(tick), 0));
        assert_eq!(captured(&recorder, &memory), Captured { most: 20, wanted: 15, captured: 5 });
        assert_eq!(codes(&recorder, &memory, 0), [5, 6, 7, 8, 9], "rows can be read meanwhile");
        (10..40).for_each(|tick| recorder.tick(&memory, &sample(tick), 0));
        assert_eq!(captured(&recorder, &memory), Captured { most: 20, wanted: 15, captured: 15 });
        assert_eq!(codes(&recorder, &memory, 0), (5..18).collect::<Vec<_>>());
        assert_eq!(codes(&recorder, &memory, 13), [18, 19]);
        assert!(memory[30..].iter().all(|word| word.load(Ordering::Relaxed) == 0xdead), "nothing is written behind it");
    }

    #[test]
    fn a_new_capture_replaces_the_old_one_and_one_of_no_rows_ends_it() {
        let (recorder, memory) = (Recorder::new(), memory(20));
        recorder.execute(&memory, Capture::Start { rows: 20 });
        (0..10).for_each(|tick| recorder.tick(&memory, &sample(tick), 0));
        recorder.execute(&memory, Capture::Start { rows: 3 });
        assert!(codes(&recorder, &memory, 0).is_empty());
        (50..60).for_each(|tick| recorder.tick(&memory, &sample(tick), 0));
        assert_eq!(codes(&recorder, &memory, 0), [50, 51, 52]);
        recorder.execute(&memory, Capture::Start { rows: 0 });
        recorder.tick(&memory, &sample(70), 0);
        assert_eq!(captured(&recorder, &memory), Captured { most: 20, wanted: 0, captured: 0 });
    }

    #[test]
    fn more_rows_than_fit_are_refused_and_the_running_capture_goes_on() {
        let (recorder, memory) = (Recorder::new(), memory(20));
        recorder.execute(&memory, Capture::Start { rows: 20 });
        for rows in [21, u32::MAX] {
            let refused = recorder.execute(&memory, Capture::Start { rows });
            assert_eq!(refused, Reply::Refused(Reason::TooManyRows { most: 20 }));
        }
        (0..25).for_each(|tick| recorder.tick(&memory, &sample(tick), 0));
        assert_eq!(captured(&recorder, &memory).captured, 20);
    }

    #[test]
    fn a_row_says_how_many_ticks_are_missing_before_it() {
        let (recorder, memory) = (Recorder::new(), memory(20));
        recorder.tick(&memory, &sample(0), 4);
        recorder.execute(&memory, Capture::Start { rows: 5 });
        for (tick, overruns) in [(1, 6), (2, 6), (3, 9), (4, 9), (5, 400)] {
            recorder.tick(&memory, &sample(tick), overruns);
        }
        let Reply::Rows(rows) = recorder.execute(&memory, Capture::Read { first: 0 }) else { panic!() };
        assert_eq!(rows.iter().map(|row| row.missed).collect::<Vec<_>>(), [0, 0, 3, 0, 255]);
    }
}
