//! An open connection to the MCU, and what the subcommands of `vsj link` share.

use std::sync::atomic::{AtomicI32, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use host_sim::link::{AdaptationRow, Client, IsolationRow, StatusReport, heartbeat, not_disarmed};
use host_sim::output::terminal::{json, print, remark};
use host_sim::signals::{end, on_signal};
use link::adaptation::Adaptation;
use link::isolation::Isolation;
use link::{BrownOut, IsolationReport, Request, Status, WireVolts};
use serde::Serialize;
use simulation::bad_input;
use simulation::bad_input::number;

/// The state of the MCU after a request, and its target.
pub(super) type Answer = (link::State, WireVolts);

/// The answer of `set`, `arm`, `disarm` and `acknowledge` with `--json`.
#[derive(Serialize)]
struct Done {
    state: &'static str,
    target_v: f64,
}

/// A connection to an MCU with its latest status.
pub(super) struct Session {
    pub(super) client: Client,
    pub(super) status: Status,
    pub(super) json: bool,
    /// Level of the brown-out reset, an option of the chip that stays what it is; `None` until it was asked for.
    pub(super) brown_out: Option<Option<BrownOut>>,
}

impl Session {
    /// Makes the first signal end what runs, as soon as [`stopped`] is seen, and what waits for an answer; a second one ends the program.
    pub(super) fn stop_on_signal(&mut self) {
        on_signal(|signal| SIGNAL.store(signal, Ordering::Relaxed));
        self.client.interrupt_when(stopped);
    }

    /// Returns what was `done`, unless a signal has ended it: then disables the output and ends the program as the signal would. Where
    /// Ctrl-C is the usual end, it is no failure.
    pub(super) fn finish(mut self, done: Result<()>, ctrl_c_is_usual: bool) -> Result<()> {
        let signal = SIGNAL.load(Ordering::Relaxed);
        if signal == 0 || signal == CTRL_C && ctrl_c_is_usual && done.is_ok() {
            return done;
        }
        if let Err(error) = done {
            remark(&format!("{error:#}"));
        }
        let name = self.client.name().to_owned();
        remark(&match self.client.leave() {
            Ok(()) => format!("{name}: ended by a signal; the output is disabled"),
            Err(failure) => not_disarmed(&name, &failure.to_string(), &self.status),
        });
        drop(self);
        end(signal)
    }

    /// Sends a request. A stiffness out of reach is bad input; any other error is a failure.
    pub(super) fn order(&mut self, request: Request) -> Result<Answer> {
        self.client.command(request)
    }

    pub(super) fn refresh(&mut self) -> Result<Status> {
        self.status = self.client.status().with_context(|| self.client.name().to_owned())?;
        Ok(self.status)
    }

    /// Names on stderr the faults that the MCU has reported since the last call, which this program has confirmed or is about to.
    pub(super) fn show_reports(&mut self) {
        self.reports().for_each(|report| remark(&report));
    }

    /// The faults that the MCU has reported since the last call, a line each.
    pub(super) fn reports(&mut self) -> impl Iterator<Item = String> {
        let reports = self.client.reports();
        let name = self.client.name();
        reports.into_iter().map(move |report| {
            let standing: Vec<String> = report.faults().map(|fault| fault.to_string()).collect();
            let standing = if standing.is_empty() { "none".to_owned() } else { standing.join(", ") };
            let monitors = match report.mismatch.name() {
                "none" => String::new(),
                mismatch => format!(", monitors: {mismatch}"),
            };
            format!("{name}: fault {} at tick {}{monitors}; standing: {standing}", report.fault, report.tick)
        })
    }

    /// What the isolation bank says; `None` if the MCU's program does not know the request.
    pub(super) fn isolation(&mut self, request: Isolation) -> Result<Option<IsolationReport>> {
        self.client.isolation(request).with_context(|| self.client.name().to_owned())
    }

    /// The latest status, with what the isolation bank says, what the adaptation does, and the level of the brown-out reset.
    pub(super) fn report(&mut self) -> Result<StatusReport> {
        let isolation = self.isolation(Isolation::Read)?;
        let adaptation = self.client.adaptation(Adaptation::Read).with_context(|| self.client.name().to_owned())?;
        let brown_out = match self.brown_out {
            Some(known) => known,
            None => self.client.brown_out().with_context(|| self.client.name().to_owned())?,
        };
        self.brown_out = Some(brown_out);
        Ok(StatusReport::new(&self.status, isolation.as_ref(), adaptation.as_ref(), brown_out))
    }

    /// Switches the adaptation if the request demands it, and shows what it does.
    pub(super) fn show_adaptation(&mut self, request: Adaptation) -> Result<()> {
        let name = self.client.name().to_owned();
        let Some(report) = self.client.adaptation(request).with_context(|| name.clone())? else {
            bail!("{name}: the MCU's program does not know the adaptation");
        };
        let row = AdaptationRow::new(&report, self.status.rate_hz);
        if let (Some(_), Some(why)) = (request.switch(), row.why) {
            bail!("{name}: nothing can adapt: {why}");
        }
        print(&if self.json { json(&row)? } else { row.text() + "\n" })
    }

    pub(super) fn show_isolation(&mut self, request: Isolation) -> Result<()> {
        let Some(report) = self.isolation(request)? else {
            bail!("{}: the MCU's program does not know the isolation bank", self.client.name());
        };
        let row = IsolationRow::new(&report, self.status.rate_hz);
        print(&if self.json { json(&row)? } else { row.text() + "\n" })
    }

    pub(super) fn show_status(&mut self) -> Result<()> {
        let report = self.report()?;
        print(&if self.json { json(&report)? } else { report.text() })
    }

    /// Prints the answer, and stays connected for `time` even if it cannot be printed: lost output decides nothing about an
    /// armed MCU.
    pub(super) fn show_and_keep(&mut self, done: Answer, time: Option<Duration>) -> Result<()> {
        let shown = self.show(done);
        self.keep(time)?;
        shown
    }

    pub(super) fn show(&self, (state, target): Answer) -> Result<()> {
        let done = Done { state: state.name(), target_v: target.to_f64() };
        let text = format!("{}, target {:.3} V\n", done.state, done.target_v);
        print(&if self.json { json(&done)? } else { text })
    }

    /// Returns an error unless the MCU is armed. Ramping is accepted: the frame that reported it has ended it.
    pub(super) fn still_armed(&mut self, state: link::State) -> Result<()> {
        if !matches!(state, link::State::Armed | link::State::Ramping) {
            self.refresh()?;
            bail!("{}: no longer armed: {state}, fault {}", self.client.name(), self.status.fault);
        }
        Ok(())
    }

    /// Returns an error if the MCU has a fault, which has disabled an output that was armed.
    pub(super) fn not_faulted(&mut self) -> Result<()> {
        match self.refresh()?.sample.state {
            state @ link::State::Faulted => self.still_armed(state),
            _ => Ok(()),
        }
    }

    /// Stays connected for `time`; returns an error if the MCU is no longer armed.
    fn keep(&mut self, time: Option<Duration>) -> Result<()> {
        let Some(time) = time else { return Ok(()) };
        let (start, pause) = (Instant::now(), heartbeat(&self.status));
        while start.elapsed() < time && !stopped() {
            // The answer takes its time as well.
            let next = Instant::now() + pause;
            let (state, _) = self.order(Request::Heartbeat)?;
            self.still_armed(state)?;
            let pause = next.saturating_duration_since(Instant::now());
            std::thread::sleep(pause.min(time.saturating_sub(start.elapsed())));
        }
        Ok(())
    }
}

impl Drop for Session {
    /// The MCU repeats no report that this program has received, so none ends with a request that was refused.
    fn drop(&mut self) {
        self.show_reports();
    }
}

/// Number of Ctrl-C's signal.
const CTRL_C: i32 = 2;
/// Number of the signal that has come, 0 for none.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

pub(super) fn stopped() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// Checks a time in s that must be positive and at most `most`; an infinite one becomes the longest `Duration`.
pub(crate) fn seconds(option: &str, value: f64, most: f64) -> Result<Duration> {
    if !(value > 0.0 && value <= most) {
        bad_input!("{option} {}: expected a positive number of seconds", number(value));
    }
    Ok(Duration::try_from_secs_f64(value).unwrap_or(Duration::MAX))
}
