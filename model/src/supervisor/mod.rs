//! The supervisor: it alone decides whether the output is enabled.
//!
//! Important terms:
//!
//! - *enabled*: the amplifier is on and the controller's code is written to the DAC. Otherwise the amplifier is off at
//!   0 V.
//! - *arm*, *disarm*: the commands that enable and disable the output ([`Command`]).
//! - *interlock*: the external safety circuit; the output is enabled only while it is closed.
//! - *fault*: a reason for which the output was disabled ([`Fault`]).
//! - *cause*: what made it a fault: an open interlock, a task that does not check in, missed ticks, a voltage that
//!   should not be there. The cause of a reset (a panic, a dip of the supply) is gone with the reset.
//! - *standing fault*: one whose cause is not gone, or that nobody has acknowledged ([`Faults`]).
//! - *monitors*: the amplifier's own readings of its voltage and current ([`Monitors`]).
//! - *silent host*: no valid frame came within the host timeout; the target then ramps down to 0 V.
//!
//! Each tick has two steps. [`Supervisor::decide`], before the controller, takes the command and everything that speaks
//! against a voltage, and returns what the controller has to do. [`Supervisor::release`], after it, turns the
//! controller's output into a [`Drive`], and nothing else can make a `Drive` that is not zero. A board's amplifier port
//! accepts only that type.
//!
//! ```text
//!             arm (interlock closed, host heard)
//!   Disarmed -----------------------------------> Armed --+ host silent: target ramps to 0 V, then disarmed
//!      ^  ^                                       |  |    |
//!      |  +------------------- disarm ------------+  |<---+ host heard again: its target is pursued again
//!      |                                             | any fault
//!      +--- last one acknowledged ---------- Faulted <+
//! ```
//!
//! The amplifier is off at 0 V in every state but `Armed`. A fault stands until its cause is gone *and* a disarm has
//! acknowledged it; arming again needs a command of its own. The state shows one standing fault, the first that came;
//! a disarm acknowledges that one alone, and is rejected while its cause is there. In one tick a fault wins over every
//! command, and disarm over arm. An amplifier that holds a voltage although it is off is a fault in every state; while
//! it does, nothing is armed or acknowledged.
//!
//! No heap, no float, no panic in a tick; times are counted in ticks.

mod fault;
mod inputs;
mod monitors;
mod settings;

pub use fault::{Fault, Faults};
pub use inputs::{Command, Inputs};
pub use monitors::{Mismatch, Monitors};
pub use settings::{Config, Settings};

use monitors::MonitorCheck;

use crate::amplifier::Limits;
use crate::coefficient::{upper, widened};
use crate::controller::Output;
use crate::units::{Accumulator, DacCode, Volts};

/// State of the supervisor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// The output is disabled, and may be armed.
    Disarmed,
    /// The output is enabled: the controller drives the amplifier.
    Armed,
    /// The output is disabled until every standing fault is acknowledged; this is the first of them.
    Faulted(Fault),
}

/// Reason for which a command was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// A fault has not been acknowledged.
    Faulted = 1,
    /// The interlock is open.
    InterlockOpen = 2,
    /// No valid frame came from the host within the host timeout.
    HostSilent = 3,
    /// The amplifier is off, but its monitors do not read zero.
    Live = 4,
    /// The cause of the fault to be acknowledged is still there.
    CausePresent = 5,
    /// The supply of the converters is out of its range.
    Reference = 6,
}

/// What the controller has to do in this tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Run [`crate::Config::rest`]: the amplifier is off at 0 V.
    Rest,
    /// The first tick with voltage: run [`crate::Config::bumpless_transfer`] from 0 V, then pursue this target.
    Start(Volts),
    /// Run [`crate::Config::tick`] with this target.
    Pursue(Volts),
}

/// A DAC code and the state of the amplifier's enable output. Only [`Supervisor::release`] makes one that is enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    code: DacCode,
    enabled: bool,
}

impl Drive {
    /// Code 0, amplifier off.
    pub const SAFE: Self = Self { code: DacCode(0), enabled: false };

    /// Returns the code to be written to the DAC.
    pub const fn code(self) -> DacCode {
        self.code
    }

    /// Returns the level of the amplifier's enable output: true is on.
    pub const fn enabled(self) -> bool {
        self.enabled
    }
}

/// The state machine that enables and disables the output.
///
/// ```
/// use model::supervisor::{self, Command, Decision, Inputs, State, Supervisor};
/// use model::{Config, OutOfRange, SampleTime, Settings, Volts};
///
/// fn main() -> Result<(), OutOfRange> {
///     let supervision = supervisor::Settings::DEFAULT;
///     let mut supervisor = Supervisor::new(supervision.validate(SampleTime::from_rate(1000.0)?)?.quantize(), None);
///     let config: Config = Settings::PAPER.validate()?.quantize();
///     let mut controller = model::State::default();
///
///     // The host was heard in this tick, the interlock is closed, and the host orders 300 V.
///     let target = Volts::new(300.0)?;
///     let ready = Inputs { ticks_since_host: 0, interlock_closed: true, target, ..Inputs::default() };
///     assert_eq!(supervisor.decide(&Inputs { command: Some(Command::Arm), ..ready }), Decision::Start(target));
///     config.bumpless_transfer(&mut controller, Volts::ZERO);
///     let output = config.tick(&mut controller, model::Input { target, measured: None });
///     assert!(supervisor.release(&output).enabled());
///
///     // The interlock opens: the output is disabled in the same tick.
///     assert_eq!(supervisor.decide(&Inputs { interlock_closed: false, ..ready }), Decision::Rest);
///     let output = config.rest(&mut controller, None);
///     assert_eq!(supervisor.release(&output), supervisor::Drive::SAFE);
///     assert_eq!(supervisor.state(), State::Faulted(supervisor::Fault::Interlock));
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supervisor {
    config: Config,
    state: State,
    /// The standing faults; empty unless the state is [`State::Faulted`], whose fault is one of them.
    standing: Faults,
    /// Target on the ramp down while the host is silent; 64 bits, so that the slowest ramp moves.
    ramp: Option<Accumulator>,
    /// Target of the last tick with voltage, as the controller has limited it.
    pursued: Volts,
    /// Missed ticks that are not forgotten yet, in ticks until they are; at most one of them while disabled.
    misses: u32,
    monitors: MonitorCheck,
    /// What disagreed when the monitors became a fault.
    found: Option<Mismatch>,
    refusal: Option<Refusal>,
}

impl Supervisor {
    /// Returns a disarmed supervisor, or a faulted one if `last_fault` caused the last reset, so that it has to be
    /// acknowledged.
    pub const fn new(config: Config, last_fault: Option<Fault>) -> Self {
        let (state, standing) = match last_fault {
            None => (State::Disarmed, Faults::NONE),
            Some(fault) => (State::Faulted(fault), Faults::NONE.with(fault)),
        };
        let (ramp, monitors) = (None, MonitorCheck::NEW);
        Self { config, state, standing, ramp, pursued: Volts::ZERO, misses: 0, monitors, found: None, refusal: None }
    }

    /// Returns the state after the last tick.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Returns the standing faults after the last tick.
    pub const fn standing(&self) -> Faults {
        self.standing
    }

    /// Returns true while the target ramps down because the host is silent.
    pub const fn ramping(&self) -> bool {
        self.ramp.is_some()
    }

    /// Returns why the last tick's command was rejected; `None` if it was not, or if there was none.
    pub const fn refusal(&self) -> Option<Refusal> {
        self.refusal
    }

    /// Returns what disagrees with the output: while a monitor fault stands what it was found by, else what disagreed in
    /// the last tick; `None` if the monitors agree.
    pub fn mismatch(&self) -> Option<Mismatch> {
        self.found.or(self.monitors.mismatch())
    }

    /// First half of a tick: takes the inputs and returns what the controller has to do.
    #[inline]
    pub fn decide(&mut self, inputs: &Inputs) -> Decision {
        self.refusal = None;
        let was_armed = self.state == State::Armed;
        let overrun = self.overrun(inputs.missed_ticks);
        let disagreement = self.monitors.update(&self.config, inputs.monitors);
        if let Some(fault) = inputs.faults.first() {
            self.fail(fault);
            self.standing = self.standing.and(inputs.faults);
        }
        if was_armed && !inputs.interlock_closed {
            self.fail(Fault::Interlock);
        }
        if disagreement {
            self.found = self.found.or(self.monitors.mismatch());
            self.fail(Fault::Monitor);
        }
        if overrun {
            self.fail(Fault::Overrun);
        }
        // A command cannot acknowledge the fault that has just disabled the output: it was given before.
        if self.state == State::Armed || !was_armed {
            match inputs.command {
                Some(Command::Disarm) => self.disarm(inputs),
                Some(Command::Arm) => self.arm(inputs),
                None => {}
            }
        }
        let target = if self.state == State::Armed { self.pursue(inputs) } else { None };
        let Some(target) = target else {
            self.ramp = None;
            return Decision::Rest;
        };
        if was_armed { Decision::Pursue(target) } else { Decision::Start(target) }
    }

    /// Second half of a tick: returns what is written to the DAC and the enable output for the controller's `output`.
    #[inline]
    pub fn release(&mut self, output: &Output) -> Drive {
        if self.state != State::Armed {
            self.monitors.expect(None);
            return Drive::SAFE;
        }
        self.pursued = output.target;
        self.monitors.expect(Some(output.applied));
        Drive { code: output.code, enabled: true }
    }

    /// Returns the limits of `output` for logs: none while the output is disabled.
    pub fn limits(&self, output: &Output) -> Limits {
        if self.state == State::Armed { output.limits } else { Limits::NONE }
    }

    /// Disables the output because of `fault`, which stands from here on; the state shows the first fault.
    pub fn fail(&mut self, fault: Fault) {
        self.standing = self.standing.with(fault);
        if !matches!(self.state, State::Faulted(_)) {
            self.state = State::Faulted(fault);
        }
    }

    fn arm(&mut self, inputs: &Inputs) {
        self.refusal = match self.state {
            State::Armed => None,
            State::Faulted(_) => Some(Refusal::Faulted),
            State::Disarmed if !inputs.interlock_closed => Some(Refusal::InterlockOpen),
            State::Disarmed if self.silent(inputs) => Some(Refusal::HostSilent),
            State::Disarmed => self.disagreement(),
        };
        if self.state == State::Disarmed && self.refusal.is_none() {
            self.state = State::Armed;
            self.misses = 0;
        }
    }

    /// Disables the output, or acknowledges the fault that is shown if its cause is gone.
    fn disarm(&mut self, inputs: &Inputs) {
        let State::Faulted(fault) = self.state else {
            self.state = State::Disarmed;
            return;
        };
        self.refusal = self.cause(fault, inputs);
        if self.refusal.is_none() {
            self.standing = self.standing.without(fault);
            if fault == Fault::Monitor {
                self.found = None;
            }
            self.state = self.standing.first().map_or(State::Disarmed, State::Faulted);
        }
    }

    /// Returns what speaks against acknowledging `fault`; `None` if its cause is gone.
    fn cause(&self, fault: Fault, inputs: &Inputs) -> Option<Refusal> {
        if let Some(refusal) = self.disagreement() {
            return Some(refusal);
        }
        let present = match fault {
            Fault::Interlock if !inputs.interlock_closed => return Some(Refusal::InterlockOpen),
            Fault::Overrun => self.misses > 0,
            _ => false,
        };
        (present || inputs.faults.contains(fault)).then_some(Refusal::CausePresent)
    }

    /// Returns what the monitors have against arming and acknowledging.
    fn disagreement(&self) -> Option<Refusal> {
        self.monitors.mismatch().map(|mismatch| match mismatch {
            Mismatch::Reference => Refusal::Reference,
            _ => Refusal::Live,
        })
    }

    /// Returns true if no frame came from the host within the host timeout.
    fn silent(&self, inputs: &Inputs) -> bool {
        inputs.ticks_since_host > self.config.host_timeout
    }

    /// Returns the target while armed; `None` once the ramp of a silent host has reached 0 V, which disarms.
    fn pursue(&mut self, inputs: &Inputs) -> Option<Volts> {
        if !self.silent(inputs) {
            self.ramp = None;
            return Some(inputs.target);
        }
        let start = self.ramp.unwrap_or(widened(self.pursued.0));
        let next = start.saturating_sub(self.config.ramp_step);
        if next <= Accumulator::ZERO {
            self.state = State::Disarmed;
            return None;
        }
        self.ramp = Some(next);
        Some(Volts(upper(next)))
    }

    /// Counts the missed ticks, and returns true if there are too many while armed; the fault uses them up. In the other
    /// states only the last missed tick is remembered, until it is forgotten.
    fn overrun(&mut self, missed: u32) -> bool {
        let misses = self.misses.saturating_sub(1).saturating_add(missed.saturating_mul(self.config.miss_cost));
        let armed = self.state == State::Armed;
        let overrun = armed && misses > self.config.miss_limit;
        self.misses = match (armed, overrun) {
            (true, false) => misses,
            (true, true) => 0,
            (false, _) => misses.min(self.config.miss_cost),
        };
        overrun
    }
}

#[cfg(test)]
mod tests;
