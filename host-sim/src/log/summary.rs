//! Totals over a log.

use model::Limits;
use serde::Serialize;

use crate::log::Item;
use crate::log::event::{Boot, Done, Event};
use crate::log::line::{Level, Line};

/// Totals over all lines of a log. The firmware counts from its start, so the counts of all starts are added.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Number of decoded frames.
    pub lines: u64,
    /// Number of lines with the level error.
    pub errors: u64,
    /// Number of lines with the level warn.
    pub warnings: u64,
    /// The starts of the firmware.
    pub boots: Vec<Boot>,
    /// Number of starts without a boot line, detected by counts that decreased.
    pub boots_not_seen: u64,
    /// Number of ticks, as far as the lines tell.
    pub ticks: u64,
    /// Number of missed ticks as of each start's last summary line; `None` without such a line, like the next three
    /// fields.
    pub overruns: Option<u64>,
    /// Largest lateness of a tick, in us.
    pub worst_lateness_us: Option<u32>,
    /// Number of ticks in which a limit acted.
    pub limited_ticks: Option<u64>,
    /// Time in which a limit acted, in s; `None` if the rate of a start is unknown.
    pub limited_s: Option<f64>,
    /// Number of limit lines that name each limit.
    pub limit_lines: LimitLines,
    /// The kinds of faults, in order of first occurrence; a fault reported again after the restart that it caused
    /// counts once.
    pub faults: Vec<Fault>,
    /// The causes that the isolation bank has named, in order of first occurrence.
    pub causes: Vec<Cause>,
    /// Number of panics.
    pub panics: u64,
    /// Number of lines that the firmware reports as dropped.
    pub dropped: u64,
    /// End of an emulated run, if the log contains it.
    pub done: Option<Done>,
    /// Number of byte ranges that are not valid frames.
    pub damaged_frames: u64,
    /// Number of bytes in those ranges.
    pub damaged_bytes: u64,
    /// Position in the log of the first such range.
    pub first_damage: Option<u64>,
    /// Bytes of an incomplete frame at the end.
    pub cut_off_bytes: u64,
    #[serde(skip)]
    start: Start,
    #[serde(skip)]
    before: Start,
}

/// A kind of fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Number of the fault.
    pub code: u8,
    /// Name of the fault.
    pub name: String,
    /// Number of occurrences.
    pub count: u64,
}

/// A cause that the isolation bank has named.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cause {
    /// Code of the cause.
    pub cause: String,
    /// How often it was named.
    pub named: u64,
    /// How often its name has gone.
    pub withdrawn: u64,
}

/// Number of limit lines that name each limit; a line may name several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "as in model::Limits")]
pub struct LimitLines {
    pub upper: u64,
    pub lower: u64,
    pub slew: u64,
    pub target: u64,
}

/// Counts since one start, or totals over all earlier starts.
#[derive(Clone, Debug, Default, PartialEq)]
struct Start {
    rate_hz: Option<u32>,
    ticks: u64,
    /// Number of ticks at the latest summary line.
    last_summary: u64,
    /// Time of that line, in us.
    last_time_us: Option<u64>,
    /// Codes of the fault lines since the state was last left in which faults stand.
    standing: Vec<u8>,
    /// Codes of faults that the previous start has already reported.
    reported: Vec<u8>,
    overruns: u64,
    limited_ticks: u64,
    /// Time in limits of the earlier starts, in s.
    limited_s: f64,
    /// True if the rate of an earlier start with limited ticks is unknown.
    unknown_rate: bool,
}

impl Start {
    /// Number of ticks since the start for a `tick` of the firmware, which counts them in 32 bits: after 49.7 days at 1 kHz
    /// it begins again with 0. A smaller tick at a later time since the start is such a wrap, at an earlier one a restart.
    fn whole(&self, tick: u32, time_us: Option<u64>) -> u64 {
        let last = self.last_summary as u32;
        let ahead = tick.wrapping_sub(last) as i32;
        let later = self.last_time_us.zip(time_us).is_some_and(|(before, now)| before <= now);
        match self.last_summary.checked_add_signed(ahead.into()) {
            Some(whole) if later || whole <= self.last_summary => whole,
            _ => tick.into(),
        }
    }

    /// Time in limits, in s; `None` if it contains ticks of unknown length.
    fn limited_s(&self) -> Option<f64> {
        match self.rate_hz {
            _ if self.limited_ticks == 0 => Some(0.0),
            Some(rate) if rate > 0 => Some(self.limited_ticks as f64 / f64::from(rate)),
            _ => None,
        }
    }
}

impl Summary {
    /// Adds an item of the log.
    pub fn add(&mut self, item: &Item) {
        match *item {
            Item::Line(ref line) => self.line(line),
            Item::Damaged { offset, bytes } => {
                self.damaged_frames += 1;
                self.damaged_bytes += bytes;
                self.first_damage.get_or_insert(offset);
            }
            Item::Lost { offset } => {
                self.damaged_frames += 1;
                self.first_damage.get_or_insert(offset);
            }
            Item::Unread { bytes } => self.damaged_bytes += bytes,
            Item::CutOff { bytes, .. } => self.cut_off_bytes = bytes,
        }
        self.total();
    }

    /// True if no part of the log is known to be missing.
    pub fn is_whole(&self) -> bool {
        self.damaged_frames == 0 && self.cut_off_bytes == 0
    }

    fn line(&mut self, line: &Line) {
        self.lines += 1;
        self.errors += u64::from(line.level == Some(Level::Error));
        self.warnings += u64::from(line.level == Some(Level::Warn));
        match &line.event {
            Event::Boot(boot) => {
                // Faults that stand after a restart are reported again; a first line may have been lost in the crash.
                let reported = if boot.last_fault == 0 { Vec::new() } else { std::mem::take(&mut self.start.standing) };
                self.next_start();
                self.start.rate_hz = Some(boot.rate_hz);
                self.start.reported = reported;
                self.boots.push(boot.clone());
            }
            Event::Fault { code, name, tick } => {
                self.tick(*tick, line.time_us);
                self.start.standing.push(*code);
                if let Some(index) = self.start.reported.iter().position(|reported| reported == code) {
                    self.start.reported.swap_remove(index);
                    return;
                }
                match self.faults.iter_mut().find(|fault| fault.code == *code && fault.name == *name) {
                    Some(fault) => fault.count += 1,
                    None => self.faults.push(Fault { code: *code, name: name.clone(), count: 1 }),
                }
            }
            Event::Limit { bits, tick } => {
                self.tick(*tick, line.time_us);
                let LimitLines { upper, lower, slew, target } = &mut self.limit_lines;
                for (limit, lines) in
                    [(Limits::UPPER, upper), (Limits::LOWER, lower), (Limits::SLEW, slew), (Limits::TARGET, target)]
                {
                    *lines += u64::from(bits & limit.bits() != 0);
                }
            }
            Event::Isolation { verdict, cause, tick } => {
                self.tick(*tick, line.time_us);
                if let Some(cause) = cause {
                    self.isolation(verdict, cause);
                }
            }
            Event::Summary { tick, overruns, worst_lateness_us, limited_ticks, .. } => {
                // Only summary lines are guaranteed to be in order.
                if self.start.whole(*tick, line.time_us) < self.start.last_summary {
                    self.next_start();
                    self.boots_not_seen += 1;
                }
                self.tick(*tick, line.time_us);
                self.start.last_summary = self.start.whole(*tick, line.time_us);
                self.start.last_time_us = line.time_us;
                self.missed(*overruns);
                self.start.limited_ticks = self.start.limited_ticks.max((*limited_ticks).into());
                self.worst_lateness_us = self.worst_lateness_us.max(Some(*worst_lateness_us));
            }
            Event::Done(done) => {
                self.tick(done.ticks, line.time_us);
                self.missed(done.missed);
                self.done = Some(done.clone());
            }
            Event::Dropped { events } => self.dropped += u64::from(*events),
            Event::Panic { .. } => self.panics += 1,
            Event::State { from, .. } if from == link::State::Faulted.name() => self.start.standing.clear(),
            Event::State { .. } | Event::Text => {}
        }
    }

    /// Counts a line of the isolation bank with a cause.
    fn isolation(&mut self, verdict: &str, cause: &str) {
        let index = self.causes.iter().position(|known| known.cause == cause);
        match (verdict, index) {
            ("named", Some(index)) => self.causes[index].named += 1,
            ("named", None) => self.causes.push(Cause { cause: cause.to_owned(), named: 1, withdrawn: 0 }),
            ("withdrawn", Some(index)) => self.causes[index].withdrawn += 1,
            _ => {}
        }
    }

    /// Updates the number of missed ticks since the start.
    fn missed(&mut self, ticks: u32) {
        self.start.overruns = self.start.overruns.max(ticks.into());
        self.overruns = Some(0);
    }

    /// Updates the number of ticks since the start.
    fn tick(&mut self, tick: u32, time_us: Option<u64>) {
        self.start.ticks = self.start.ticks.max(self.start.whole(tick, time_us));
    }

    /// Adds the counts of the last start to the totals.
    fn next_start(&mut self) {
        let Start { ticks, overruns, limited_ticks, .. } = self.start;
        self.before.ticks += ticks;
        self.before.overruns += overruns;
        self.before.limited_ticks += limited_ticks;
        match self.start.limited_s() {
            Some(time) => self.before.limited_s += time,
            None => self.before.unknown_rate = true,
        }
        self.start = Start { rate_hz: self.start.rate_hz, ..Start::default() };
    }

    fn total(&mut self) {
        self.ticks = self.before.ticks + self.start.ticks;
        self.overruns = self.overruns.map(|_| self.before.overruns + self.start.overruns);
        if self.worst_lateness_us.is_some() {
            self.limited_ticks = Some(self.before.limited_ticks + self.start.limited_ticks);
            let before = (!self.before.unknown_rate).then_some(self.before.limited_s);
            self.limited_s = before.zip(self.start.limited_s()).map(|(before, now)| before + now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(time_us: impl Into<Option<u64>>, event: Event) -> Item {
        Item::Line(Line { time_us: time_us.into(), level: Some(Level::Info), message: String::new(), event })
    }

    fn once_a_second(tick: u32, overruns: u32, limited_ticks: u32) -> Event {
        Event::Summary {
            tick,
            overruns,
            worst_lateness_us: 3,
            rms_lateness_us: None,
            limited_ticks,
            state: "armed".into(),
            target_mv: 0,
            applied_mv: 0,
            stiffness_mv: 0,
        }
    }

    fn boot(last_fault: u8) -> Event {
        let (version, git, reset, controller) = ("0.1.0".into(), "1".into(), "software".into(), None);
        Event::Boot(Boot { version, git, reset, last_fault, rate_hz: 1000, controller })
    }

    fn fault(code: u8, tick: u32) -> Event {
        Event::Fault { code, name: code.to_string(), tick }
    }

    fn of(items: &[Item]) -> Summary {
        let mut summary = Summary::default();
        items.iter().for_each(|item| summary.add(item));
        summary
    }

    #[test]
    fn named_causes_are_counted_and_so_are_the_names_that_have_gone() {
        let isolation = |verdict: &str, cause: Option<&str>| {
            line(1, Event::Isolation { verdict: verdict.into(), cause: cause.map(str::to_owned), tick: 1 })
        };
        let gain = Some("gain-error");
        let summary = of(&[
            isolation("alarm", None),
            isolation("ambiguous", Some("delay")),
            isolation("named", gain),
            isolation("withdrawn", gain),
            isolation("named", gain),
        ]);
        assert_eq!(summary.causes, [Cause { cause: "gain-error".into(), named: 2, withdrawn: 1 }]);
    }

    /// 2^32 ticks of 1 ms are 49.7 days.
    #[test]
    fn a_wrapped_tick_is_not_a_restart() {
        const WRAP: u64 = 1 << 32;
        let at = |tick: u64, limited| line(tick * 1000 + 7, once_a_second(tick as u32, 5, limited));
        let summary = of(&[
            line(0, boot(0)),
            at(WRAP - 1296, 100),
            at(WRAP - 296, 200),
            at(WRAP, 300),
            // Queued before the wrap, logged after it.
            line((WRAP + 1) * 1000, Event::Limit { bits: 1, tick: u32::MAX }),
            line((WRAP + 9) * 1000, Event::Limit { bits: 0, tick: 9 }),
            at(WRAP + 1000, 400),
            at(WRAP + WRAP / 3, 500),
            at(WRAP + WRAP / 3 * 2, 500),
            at(2 * WRAP + 500, 500),
        ]);
        assert_eq!((summary.boots.len(), summary.boots_not_seen), (1, 0));
        assert_eq!((summary.ticks, summary.overruns), (2 * WRAP + 500, Some(5)));
        assert_eq!((summary.limited_ticks, summary.limited_s), (Some(500), Some(0.5)));
    }

    #[test]
    fn a_restart_just_before_the_wrap_is_a_restart() {
        for times_us in [[Some(u64::from(u32::MAX) * 1000), Some(1_000_000)], [None, None]] {
            let ticks = [(u32::MAX - 295, 5, 200), (1000, 1, 10)];
            let lines = ticks.map(|(tick, overruns, limited)| once_a_second(tick, overruns, limited));
            let items: Vec<_> = times_us.into_iter().zip(lines).map(|(time_us, event)| line(time_us, event)).collect();
            let summary = of(&items);
            assert_eq!((summary.boots_not_seen, summary.ticks), (1, u64::from(u32::MAX - 295) + 1000));
            assert_eq!((summary.overruns, summary.limited_ticks), (Some(6), Some(210)));
        }
    }

    /// A log that begins after many days.
    #[test]
    fn the_first_tick_of_a_log_may_be_large() {
        let summary = of(&[line(3_000_000_000_000, once_a_second(3_000_000_000, 5, 200))]);
        assert_eq!((summary.boots_not_seen, summary.ticks), (0, 3_000_000_000));
    }

    #[test]
    fn faults_that_stand_over_a_restart_count_once() {
        let counts = |summary: Summary| summary.faults.iter().map(|it| (it.code, it.count)).collect::<Vec<_>>();
        let state = |from: &str, to: &str| line(1, Event::State { from: from.into(), to: to.into() });
        let first = [line(0, boot(0)), line(1, fault(4, 100)), line(1, fault(3, 200)), line(2, fault(1, 300))];
        let again = [line(0, boot(1)), line(1, fault(1, 1)), line(1, fault(3, 1)), line(1, fault(4, 1))];
        assert_eq!(counts(of(&[&first[..], &again].concat())), [(4, 1), (3, 1), (1, 1)]);
        // Acknowledged, then the same fault again.
        let acknowledged = [state("faulted", "disarmed"), line(9, fault(4, 900))];
        assert_eq!(counts(of(&[&first[..], &again, &acknowledged].concat())), [(4, 2), (3, 1), (1, 1)]);
        let restarted = [state("faulted", "disarmed"), line(0, boot(4)), line(1, fault(4, 1))];
        assert_eq!(counts(of(&[&first[..], &restarted].concat())), [(4, 2), (3, 1), (1, 1)]);
    }
}
