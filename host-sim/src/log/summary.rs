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
    /// Its name.
    pub name: String,
    /// Number of occurrences.
    pub count: u64,
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Start {
    rate_hz: Option<u32>,
    ticks: u64,
    /// Tick of the latest summary line.
    last_summary: u32,
    /// Code of the latest fault line.
    last_fault: Option<u8>,
    /// Code of a fault that the previous start has already reported.
    reported: Option<u8>,
    overruns: u64,
    limited_ticks: u64,
    /// Time in limits of the earlier starts, in s.
    limited_s: f64,
    /// True if the rate of an earlier start with limited ticks is unknown.
    unknown_rate: bool,
}

impl Start {
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
                // The fault that caused the restart is reported again; its first line may have been lost in the crash.
                let reported = self.start.last_fault.filter(|code| *code == boot.last_fault);
                self.next_start();
                self.start.rate_hz = Some(boot.rate_hz);
                self.start.reported = reported;
                self.boots.push(boot.clone());
            }
            Event::Fault { code, name, tick } => {
                self.tick(*tick);
                self.start.last_fault = Some(*code);
                if self.start.reported.take() == Some(*code) {
                    return;
                }
                match self.faults.iter_mut().find(|fault| fault.code == *code && fault.name == *name) {
                    Some(fault) => fault.count += 1,
                    None => self.faults.push(Fault { code: *code, name: name.clone(), count: 1 }),
                }
            }
            Event::Limit { bits, tick } => {
                self.tick(*tick);
                let LimitLines { upper, lower, slew, target } = &mut self.limit_lines;
                for (limit, lines) in
                    [(Limits::UPPER, upper), (Limits::LOWER, lower), (Limits::SLEW, slew), (Limits::TARGET, target)]
                {
                    *lines += u64::from(bits & limit.bits() != 0);
                }
            }
            Event::Summary { tick, overruns, worst_lateness_us, limited_ticks, .. } => {
                // Only summary lines are guaranteed to be in order.
                if *tick < self.start.last_summary {
                    self.next_start();
                    self.boots_not_seen += 1;
                }
                self.tick(*tick);
                self.start.last_summary = *tick;
                self.missed(*overruns);
                self.start.limited_ticks = self.start.limited_ticks.max((*limited_ticks).into());
                self.worst_lateness_us = self.worst_lateness_us.max(Some(*worst_lateness_us));
            }
            Event::Done(done) => {
                self.tick(done.ticks);
                self.missed(done.missed);
                self.done = Some(done.clone());
            }
            Event::Dropped { events } => self.dropped += u64::from(*events),
            Event::Panic { .. } => self.panics += 1,
            Event::State { .. } | Event::Text => {}
        }
    }

    /// Updates the number of missed ticks since the start.
    fn missed(&mut self, ticks: u32) {
        self.start.overruns = self.start.overruns.max(ticks.into());
        self.overruns = Some(0);
    }

    /// Updates the number of ticks since the start.
    fn tick(&mut self, tick: u32) {
        self.start.ticks = self.start.ticks.max(tick.into());
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
