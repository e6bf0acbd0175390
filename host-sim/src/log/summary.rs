//! What a whole log says.

use model::Limits;
use serde::Serialize;

use crate::log::Item;
use crate::log::event::{Boot, Done, Event};
use crate::log::line::{Level, Line};

/// All the lines of a log, added up. The firmware counts from its start, so each start is added to those before.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Frames that could be read.
    pub lines: u64,
    /// Lines of level error.
    pub errors: u64,
    /// Lines of level warn.
    pub warnings: u64,
    /// Starts of the firmware.
    pub boots: Vec<Boot>,
    /// Starts whose boot line is missing: counts went back without it.
    pub boots_not_seen: u64,
    /// Ticks, as far as a line tells.
    pub ticks: u64,
    /// Ticks that were missed; none if no line tells, as in the next three. As of each start's last summary line.
    pub overruns: Option<u64>,
    /// How late the latest tick came.
    pub worst_lateness_us: Option<u32>,
    /// Ticks in which a limit acted.
    pub limited_ticks: Option<u64>,
    /// The same as a time; none if a start's rate is not known.
    pub limited_s: Option<f64>,
    /// How many limit lines name each limit.
    pub limit_lines: LimitLines,
    /// In the order of their first. One that is told again after the restart it led to counts once.
    pub faults: Vec<Fault>,
    /// Times that the program stopped itself.
    pub panics: u64,
    /// Lines that the firmware says it did not send.
    pub dropped: u64,
    /// The end of an emulated run, if the log has it.
    pub done: Option<Done>,
    /// Stretches that are no frame.
    pub damaged_frames: u64,
    /// Their bytes.
    pub damaged_bytes: u64,
    /// Place of the first of them in the log.
    pub first_damage: Option<u64>,
    /// Bytes of a last frame that is not whole.
    pub cut_off_bytes: u64,
    #[serde(skip)]
    start: Start,
    #[serde(skip)]
    before: Start,
}

/// One kind of fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Number of the fault.
    pub code: u8,
    /// Its name.
    pub name: String,
    /// How many.
    pub count: u64,
}

/// How many limit lines name each limit; a line can name several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "as in model::Limits")]
pub struct LimitLines {
    pub upper: u64,
    pub lower: u64,
    pub slew: u64,
    pub target: u64,
}

/// Counts since one start, or of all the starts before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Start {
    rate_hz: Option<u32>,
    ticks: u64,
    /// Tick of the newest summary line.
    last_summary: u32,
    /// Code of the newest fault line.
    last_fault: Option<u8>,
    /// Code of a fault that the start before told already.
    told: Option<u8>,
    overruns: u64,
    limited_ticks: u64,
    /// Of the starts before.
    limited_s: f64,
    /// A limited tick of a start before has no known length.
    unknown_rate: bool,
}

impl Start {
    /// None if ticks of unknown length are in it.
    fn limited_s(&self) -> Option<f64> {
        match self.rate_hz {
            _ if self.limited_ticks == 0 => Some(0.0),
            Some(rate) if rate > 0 => Some(self.limited_ticks as f64 / f64::from(rate)),
            _ => None,
        }
    }
}

impl Summary {
    /// Adds the next item of the log.
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

    /// True if nothing of the log is missing, as far as can be told.
    pub fn is_whole(&self) -> bool {
        self.damaged_frames == 0 && self.cut_off_bytes == 0
    }

    fn line(&mut self, line: &Line) {
        self.lines += 1;
        self.errors += u64::from(line.level == Some(Level::Error));
        self.warnings += u64::from(line.level == Some(Level::Warn));
        match &line.event {
            Event::Boot(boot) => {
                // The fault that led here is told once more; its first line may have got lost in the crash.
                let told = self.start.last_fault.filter(|code| *code == boot.last_fault);
                self.next_start();
                self.start.rate_hz = Some(boot.rate_hz);
                self.start.told = told;
                self.boots.push(boot.clone());
            }
            Event::Fault { code, name, tick } => {
                self.tick(*tick);
                self.start.last_fault = Some(*code);
                if self.start.told.take() == Some(*code) {
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
                // Only summaries are sure to come in order.
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

    /// So many were missed since the start.
    fn missed(&mut self, ticks: u32) {
        self.start.overruns = self.start.overruns.max(ticks.into());
        self.overruns = Some(0);
    }

    /// So many ticks since the start.
    fn tick(&mut self, tick: u32) {
        self.start.ticks = self.start.ticks.max(tick.into());
    }

    /// What was counted since the last start is final.
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
