//! The supervisor: it alone decides whether a voltage may leave.
//!
//! Two steps in each tick. [`Supervisor::decide`], before the controller, takes the command and everything that speaks
//! against a voltage and says what the controller is to do. [`Supervisor::release`], after it, turns the controller's
//! output into a [`Drive`], and nobody else can make a `Drive` that is not zero. A board's amplifier port takes only that.
//!
//! ```text
//!             arm (interlock closed, host heard)
//!   Disarmed -----------------------------------> Armed --+ host silent: target ramps to zero, then disarmed
//!      ^  ^                                       |  |    |
//!      |  +------------------- disarm ------------+  |<---+ host heard again: its target counts again
//!      |                                             | any fault
//!      +--- disarm (the acknowledgement) --- Faulted <+
//! ```
//!
//! Zero volts and a disabled amplifier in every state but `Armed`. The first fault stays until a disarm acknowledges it;
//! arming again is a command of its own. In one tick a fault wins over every command, and disarm over arm. An amplifier
//! that holds a voltage all the same is a fault in every state; while it does, nothing is armed or acknowledged.
//!
//! No heap, no float, no panic in a tick; times are counted in ticks.

mod fault;
mod inputs;
mod monitors;
mod settings;

pub use fault::Fault;
pub use inputs::{Command, Inputs};
pub use monitors::Monitors;
pub use settings::{Config, Settings};

use monitors::Watch;

use crate::amplifier::Limits;
use crate::controller::Output;
use crate::units::{Accumulator, DacCode, Signal, Volts};

/// Whether a voltage may leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Zero volts; may be armed.
    Disarmed,
    /// The controller drives the amplifier.
    Armed,
    /// Zero volts until a disarm acknowledges the fault.
    Faulted(Fault),
}

/// Why a command was not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// A fault waits for its acknowledgement.
    Faulted = 1,
    /// The interlock is open.
    InterlockOpen = 2,
    /// No frame from the host within its time.
    HostSilent = 3,
    /// The amplifier's monitors do not read zero.
    Live = 4,
}

/// What the controller is to do in this tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Zero volts: let the estimate follow a spring without voltage.
    Rest,
    /// The first tick with voltage: take over from rest, then pursue.
    Start(Volts),
    /// Pursue this target.
    Pursue(Volts),
}

/// A code that may be written to the DAC, with the amplifier's enable. Only [`Supervisor::release`] makes one with voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    code: DacCode,
    enabled: bool,
}

impl Drive {
    /// Zero volts, amplifier off.
    pub const SAFE: Self = Self { code: DacCode(0), enabled: false };

    /// For the DAC.
    pub const fn code(self) -> DacCode {
        self.code
    }

    /// For the enable output.
    pub const fn enabled(self) -> bool {
        self.enabled
    }
}

/// The state machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supervisor {
    config: Config,
    state: State,
    /// The host is silent and the target on its way down; 64 bits so that the slowest ramp moves.
    ramp: Option<Accumulator>,
    pursued: Volts,
    misses: u32,
    watch: Watch,
    refusal: Option<Refusal>,
}

impl Supervisor {
    /// Disarmed, or after a reset by a fault still faulted, so that somebody has to acknowledge it.
    pub const fn new(config: Config, last_fault: Option<Fault>) -> Self {
        let state = match last_fault {
            None => State::Disarmed,
            Some(fault) => State::Faulted(fault),
        };
        Self { config, state, ramp: None, pursued: Volts::ZERO, misses: 0, watch: Watch::NEW, refusal: None }
    }

    /// The state after the last tick.
    pub const fn state(&self) -> State {
        self.state
    }

    /// The target is on its way down because the host is silent.
    pub const fn ramping(&self) -> bool {
        self.ramp.is_some()
    }

    /// Why the last tick's command was not followed.
    pub const fn refusal(&self) -> Option<Refusal> {
        self.refusal
    }

    /// First half of a tick.
    #[inline]
    pub fn decide(&mut self, inputs: &Inputs) -> Decision {
        self.refusal = None;
        let was_armed = self.state == State::Armed;
        // Misses are counted in every state, so that none while disarmed is held against a new start.
        let overrun = self.too_many_misses(inputs.missed_ticks);
        let disagreement = self.watch.look(&self.config, inputs.monitors);
        if let Some(fault) = inputs.fault {
            self.fail(fault);
        }
        if self.state == State::Armed && !inputs.interlock_closed {
            self.fail(Fault::Interlock);
        }
        if disagreement {
            self.fail(Fault::Monitor);
        }
        if self.state == State::Armed && overrun {
            self.fail(Fault::Overrun);
        }
        // A fault of this very tick is not acknowledged by a command that was given before anybody could know of it.
        if self.state == State::Armed || !was_armed {
            match inputs.command {
                Some(Command::Disarm) if inputs.fault.is_none() => self.disarm(),
                Some(Command::Arm) => self.arm(inputs),
                _ => {}
            }
        }
        let target = if self.state == State::Armed { self.follow(inputs) } else { None };
        let Some(target) = target else {
            self.ramp = None;
            self.pursued = Volts::ZERO;
            return Decision::Rest;
        };
        self.pursued = target;
        if was_armed { Decision::Pursue(target) } else { Decision::Start(target) }
    }

    /// Second half of a tick: what may leave of the controller's `output`.
    #[inline]
    pub fn release(&mut self, output: &Output) -> Drive {
        if self.state != State::Armed {
            self.watch.expect(None);
            return Drive::SAFE;
        }
        self.watch.expect(Some(output.applied));
        Drive { code: output.code, enabled: true }
    }

    /// Limits as a log shows them: those of a resting controller are of no interest.
    pub fn limits(&self, output: &Output) -> Limits {
        if self.state == State::Armed { output.limits } else { Limits::NONE }
    }

    /// Takes the voltage away; the first fault stays.
    pub fn fail(&mut self, fault: Fault) {
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
            State::Disarmed if self.watch.disagrees() => Some(Refusal::Live),
            State::Disarmed => {
                self.state = State::Armed;
                self.misses = 0;
                None
            }
        };
    }

    fn disarm(&mut self) {
        match self.state {
            State::Faulted(_) if self.watch.disagrees() => self.refusal = Some(Refusal::Live),
            _ => self.state = State::Disarmed,
        }
    }

    fn silent(&self, inputs: &Inputs) -> bool {
        inputs.ticks_since_host > self.config.host_timeout
    }

    /// The target while armed; `None` once the ramp of a silent host has come down, which disarms.
    fn follow(&mut self, inputs: &Inputs) -> Option<Volts> {
        if !self.silent(inputs) {
            self.ramp = None;
            return Some(inputs.target);
        }
        let start = self.ramp.unwrap_or(Accumulator::from_bits(i64::from(self.pursued.0.to_bits()) << 32));
        let next = start.saturating_sub(self.config.ramp_step);
        if next <= Accumulator::ZERO {
            self.state = State::Disarmed;
            return None;
        }
        self.ramp = Some(next);
        Some(Volts(Signal::from_bits((next.to_bits() >> 32) as i32)))
    }

    fn too_many_misses(&mut self, missed: u32) -> bool {
        self.misses = self.misses.saturating_sub(1).saturating_add(missed.saturating_mul(self.config.miss_cost));
        self.misses > self.config.miss_limit
    }
}

#[cfg(test)]
mod tests;
