//! One control tick: the supervisor decides, the model computes, the supervisor releases.
//!
//! Pure: no clock, no pin, no log. The same bits on the host and on the MCU.

use model::supervisor::{self, Command, Decision, Drive, Fault, Inputs, Monitors, Supervisor};
use model::{Compensation, Config, Input, OutOfRange, Output, SampleTime, Settings, State, Volts};

/// What the host ordered since the last tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// At least one valid frame came in.
    pub heard: bool,
    /// Arm or disarm.
    pub command: Option<Command>,
    /// A new static voltage of the desired stiffness; the last one stays without.
    pub target: Option<Volts>,
}

/// What the board saw since the last tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Senses {
    /// The safety circuit is closed.
    pub interlock_closed: bool,
    /// Ticks left out just before this one.
    pub missed_ticks: u32,
    /// The amplifier's readings.
    pub monitors: Option<Monitors>,
    /// A fault that somebody else found.
    pub fault: Option<Fault>,
}

/// What a tick says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// For the amplifier.
    pub drive: Drive,
    /// The controller's view, zero volts while nothing may leave.
    pub output: Output,
}

/// Looks at a clock before and after the model's tick.
pub trait Stopwatch {
    /// The tick begins.
    fn start(&mut self);
    /// The tick is over.
    fn stop(&mut self);
}

/// Looks at no clock.
#[derive(Clone, Copy, Debug)]
pub struct Untimed;

impl Stopwatch for Untimed {
    #[inline(always)]
    fn start(&mut self) {}
    #[inline(always)]
    fn stop(&mut self) {}
}

/// Controller and supervisor with all that they remember.
#[derive(Clone, Debug)]
pub struct Control {
    config: Config,
    /// The same spring at zero volts at once, whatever slew and range: the amplifier is off.
    rest: Config,
    state: State,
    supervisor: Supervisor,
    target: Volts,
    ticks_since_host: u32,
}

impl Control {
    /// At rest and disarmed; faulted if `last_fault` reset the chip.
    ///
    /// # Errors
    /// [`OutOfRange`] names the setting.
    pub fn new(
        settings: &Settings,
        supervision: &supervisor::Settings,
        last_fault: Option<Fault>,
    ) -> Result<Self, OutOfRange> {
        let amplifier = model::Amplifier { min_v: 0.0, slew_v_per_s: None, ..settings.amplifier };
        let rest = Settings { compensation: Compensation::None, amplifier, ..*settings };
        Ok(Self {
            config: settings.check()?,
            rest: rest.check()?,
            state: State::default(),
            supervisor: Supervisor::new(supervision.check(SampleTime::from_rate(settings.rate_hz)?)?, last_fault),
            target: Volts::ZERO,
            ticks_since_host: u32::MAX,
        })
    }

    /// The supervisor, for logs and answers to the host.
    pub fn supervisor(&self) -> &Supervisor {
        &self.supervisor
    }

    /// One tick. Not inlined, so that it can be found in the image and searched for ways into a panic.
    #[inline(never)]
    pub fn tick(&mut self, orders: &Orders, senses: &Senses, stopwatch: &mut impl Stopwatch) -> Tick {
        self.ticks_since_host = if orders.heard { 0 } else { self.ticks_since_host.saturating_add(1) };
        self.target = orders.target.unwrap_or(self.target);
        let decision = self.supervisor.decide(&Inputs {
            command: orders.command,
            target: self.target,
            ticks_since_host: self.ticks_since_host,
            interlock_closed: senses.interlock_closed,
            missed_ticks: senses.missed_ticks,
            monitors: senses.monitors,
            fault: senses.fault,
        });
        let output = match decision {
            Decision::Rest => whole_tick(&self.rest, &mut self.state, Volts::ZERO),
            Decision::Start(target) => {
                // From zero volts, as if zero had been asked for until now.
                self.config.adopt(&mut self.state, Volts::ZERO);
                self.timed(target, stopwatch)
            }
            Decision::Pursue(target) => self.timed(target, stopwatch),
        };
        Tick { drive: self.supervisor.release(&output), output }
    }

    #[inline(always)]
    fn timed(&mut self, target: Volts, stopwatch: &mut impl Stopwatch) -> Output {
        stopwatch.start();
        let output = whole_tick(&self.config, &mut self.state, target);
        stopwatch.stop();
        output
    }
}

/// The model's tick as one function: it is counted as it would be called.
#[inline(never)]
fn whole_tick(config: &Config, state: &mut State, target: Volts) -> Output {
    config.tick(state, Input { target, ..Input::default() })
}
