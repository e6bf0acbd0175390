//! One control tick: the supervisor decides, the model computes, the supervisor enables the output.
//!
//! The tick is a pure function of its inputs and its state, without clock, pins and log: host and MCU compute the same bits.

use link::{Command, Telemetry, View, WireModel};
use model::estimator::{Estimator, Model};
use model::supervisor::{self, Decision, Drive, Fault, Faults, Inputs, Monitors, Supervisor};
use model::{
    Config, ExtendedPlant, Input, OutOfRange, Output, ScaledStiffness, Settings, State, Validated, Volts, estimator,
    extended,
};

use crate::adaptation::Scale;
use crate::isolation::News;

/// Inputs of one tick from the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensors {
    /// True if the safety circuit is closed.
    pub interlock_closed: bool,
    /// Number of ticks missed just before this one.
    pub missed_ticks: u32,
    /// Readings of the amplifier's monitors; `None` without monitors.
    pub monitors: Option<Monitors>,
    /// Faults detected outside of the tick, for example by the task watchdog, whose causes are there in this tick.
    pub faults: Faults,
    /// Reading of the stiffness sensor, as equivalent static voltage, sampled after the output of the last tick; `None` without
    /// a new reading.
    pub measured: Option<Volts>,
}

/// Result of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Output to the amplifier.
    pub drive: Drive,
    /// Output of the controller; 0 V while the output is disabled.
    pub output: Output,
    /// The sensor reading that the tick has used.
    pub measured: Option<Volts>,
}

impl Tick {
    /// What the host sees of this tick, the one with this `number`, whose `supervisor` this is, after so many `overruns`.
    pub fn view(&self, number: u64, supervisor: &Supervisor, overruns: u32) -> View {
        let output = &self.output;
        let sample = Telemetry {
            tick: number,
            state: supervisor.into(),
            target: output.target.into(),
            applied: output.applied.into(),
            estimate: output.stiffness.into(),
            measured: self.measured.map(Into::into),
            code: self.drive.code().0,
            limits: supervisor.limits(output).bits(),
            mismatch: supervisor.mismatch().into(),
            sensor: output.sensor.into(),
        };
        let (state, standing, refusal) = (supervisor.state(), supervisor.standing(), supervisor.refusal());
        View { sample, state, standing, refusal, overruns }
    }
}

/// Measures the duration of the model's tick.
pub trait Stopwatch {
    /// Called before the model's tick.
    fn start(&mut self);
    /// Called after the model's tick.
    fn stop(&mut self);
}

/// A stopwatch that measures nothing.
#[derive(Clone, Copy, Debug)]
pub struct Untimed;

impl Stopwatch for Untimed {
    #[inline(always)]
    fn start(&mut self) {}
    #[inline(always)]
    fn stop(&mut self) {}
}

/// Source of the host's commands for the control task.
pub trait Source {
    /// Command for tick number `tick`, counted from 0 at the start; `None` ends the control task.
    fn command(&mut self, tick: u64) -> Option<Command>;

    /// Called after each tick with its result and the number of ticks missed so far.
    fn done(&mut self, _tick: &Tick, _control: &Control, _overruns: u32) {}

    /// True once after the host has acknowledged the alarm of the isolation bank.
    fn take_acknowledged(&mut self) -> bool {
        false
    }

    /// Called after [`Source::done`] of a tick in which what the isolation bank says has changed.
    fn isolated(&mut self, _news: &News) {}
}

/// Controller and supervisor, with configuration and state.
#[derive(Clone, Debug)]
pub struct Control {
    spring: Spring,
    scale: Scale,
    supervisor: Supervisor,
    /// Faults whose causes the start has found; they are there until the next start.
    causes: Faults,
    target: Volts,
    ticks_since_host: u32,
}

/// Controller for a plain or an extended spring; the plain one has the faster tick.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is no heap, and only one")]
enum Spring {
    Plain(Loop<estimator::Config>),
    Extended(Loop<extended::Config>),
}

#[derive(Clone, Debug)]
struct Loop<E: Estimator> {
    config: Config<E>,
    state: State<E::State>,
}

impl Control {
    /// A controller at rest, in the disarmed state, or in the faulted state with `last_fault`.
    ///
    /// # Errors
    /// [`OutOfRange`] names the invalid setting.
    pub fn new(
        settings: &Settings,
        supervision: &supervisor::Settings,
        last_fault: Option<Fault>,
    ) -> Result<Self, OutOfRange> {
        let settings = settings.validate()?;
        let supervision = supervision.validate(settings.sample_time())?;
        let supervisor = Supervisor::new(supervision.quantize(), last_fault);
        let spring = Spring::Plain(Loop::new(settings));
        let (causes, target) = (Faults::NONE, Volts::ZERO);
        Ok(Self { spring, scale: Default::default(), supervisor, causes, target, ticks_since_host: u32::MAX })
    }

    /// Replaces the spring of `settings` by the identified `model`, and the amplifier's limits by its own where those are
    /// stricter. Call it before the first tick.
    ///
    /// # Errors
    /// [`OutOfRange`] names the invalid field of the model; the spring is not changed.
    pub fn use_model(&mut self, settings: &Settings, model: &WireModel) -> Result<(), OutOfRange> {
        let settings = Identified::new(settings, model);
        self.spring = match &settings {
            Identified::Plain(settings) => Spring::Plain(Loop::new(settings.validate()?)),
            Identified::Extended(settings) => Spring::Extended(Loop::new(settings.validate()?)),
        };
        Ok(())
    }

    /// Validates an identified `model` without using it.
    ///
    /// # Errors
    /// [`OutOfRange`] names the invalid field of the model.
    pub fn check(settings: &Settings, model: &WireModel) -> Result<(), OutOfRange> {
        Identified::new(settings, model).check()
    }

    /// Enters the faulted state with `fault`. Call it before the first tick.
    pub fn fault(&mut self, fault: Fault) {
        self.supervisor.fail(fault);
    }

    /// Enters the faulted state with `fault`, whose cause is there until the next start: it cannot be acknowledged. Call it
    /// before the first tick.
    pub fn cause(&mut self, fault: Fault) {
        self.causes = self.causes.with(fault);
        self.fault(fault);
    }

    /// The supervisor, for the log and the replies to the host.
    pub fn supervisor(&self) -> &Supervisor {
        &self.supervisor
    }

    /// The model's stiffness just after the voltage of the last tick, whose `output` this is, without the sensor's correction and without
    /// the gain that has been adapted.
    pub fn uncorrected(&self, output: &Output) -> ScaledStiffness {
        let correction = match &self.spring {
            Spring::Plain(spring) => spring.state.correction(),
            Spring::Extended(spring) => spring.state.correction(),
        };
        ScaledStiffness(self.scale.inward(output.stiffness).0.saturating_sub(correction.0))
    }

    /// A reading without the gain that has been adapted.
    pub fn inward(&self, reading: ScaledStiffness) -> ScaledStiffness {
        self.scale.inward(reading)
    }

    /// Exchanges the controller of a plain spring between two ticks, without a bump of voltage and estimate. `target` is that of the last
    /// tick.
    #[cfg(feature = "adaptation")]
    pub fn exchange(&mut self, variant: &model::adaptation::Variant, target: Volts) {
        if let Spring::Plain(spring) = &mut self.spring {
            variant.take_over(&mut spring.state, (&spring.config, &self.scale), target);
            (spring.config, self.scale) = (variant.control, variant.scale);
        }
    }

    /// Executes one tick. Not inlined, so that the audit of the image finds it and verifies that it cannot panic.
    #[inline(never)]
    pub fn tick(&mut self, command: &Command, sensors: &Sensors, stopwatch: &mut impl Stopwatch) -> Tick {
        self.ticks_since_host = if command.heard { 0 } else { self.ticks_since_host.saturating_add(1) };
        self.target = command.target.unwrap_or(self.target);
        let decision = self.supervisor.decide(&Inputs {
            command: command.arming,
            target: self.target,
            ticks_since_host: self.ticks_since_host,
            interlock_closed: sensors.interlock_closed,
            missed_ticks: sensors.missed_ticks,
            monitors: sensors.monitors,
            faults: self.causes.and(sensors.faults),
        });
        let target = match decision {
            Decision::Rest => Volts::ZERO,
            Decision::Start(target) | Decision::Pursue(target) => target,
        };
        let input = self.scale.input(target, sensors.measured.map(|volts| ScaledStiffness(volts.0)));
        let output = match &mut self.spring {
            Spring::Plain(spring) => spring.step(decision, input, stopwatch),
            Spring::Extended(spring) => spring.step(decision, input, stopwatch),
        };
        let output = self.scale.output(output);
        Tick { drive: self.supervisor.release(&output), output, measured: sensors.measured }
    }
}

/// Settings with an identified model instead of their own spring.
enum Identified<'a> {
    Plain(Settings),
    Extended(Settings<ExtendedPlant<'a>>),
}

impl<'a> Identified<'a> {
    fn new(settings: &Settings, model: &'a WireModel) -> Self {
        let Settings { rate_hz, compensation, feedback, .. } = *settings;
        let (plant, amplifier) = (model.plant(), model.behind(settings.amplifier));
        match plant.plain() {
            Some(plant) => Self::Plain(Settings { rate_hz, plant, compensation, amplifier, feedback }),
            None => Self::Extended(Settings { rate_hz, plant, compensation, amplifier, feedback }),
        }
    }

    fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Plain(settings) => settings.validate().map(drop),
            Self::Extended(settings) => settings.validate().map(drop),
        }
    }
}

impl<E: Estimator> Loop<E> {
    /// The controller at rest.
    fn new<P: Model<Config = E>>(settings: Validated<'_, Settings<P>>) -> Self {
        Self { config: settings.quantize(), state: State::default() }
    }

    #[inline(always)]
    fn step(&mut self, decision: Decision, input: Input, stopwatch: &mut impl Stopwatch) -> Output {
        match decision {
            Decision::Rest => self.config.rest(&mut self.state, input.measured),
            Decision::Start(_) => {
                // The initial condition is the steady state at a target of 0 V.
                self.config.bumpless_transfer(&mut self.state, Volts::ZERO);
                self.timed(input, stopwatch)
            }
            Decision::Pursue(_) => self.timed(input, stopwatch),
        }
    }

    #[inline(always)]
    fn timed(&mut self, input: Input, stopwatch: &mut impl Stopwatch) -> Output {
        stopwatch.start();
        let output = whole_tick(&self.config, &mut self.state, input);
        stopwatch.stop();
        output
    }
}

/// The model's tick as a function of its own, so that its instructions are counted including the call.
#[inline(never)]
pub fn whole_tick<E: Estimator>(config: &Config<E>, state: &mut State<E::State>, input: Input) -> Output {
    config.tick(state, input)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{SETTINGS, SUPERVISION};
    use model::Amplifier;

    /// If NaN meant no limit, the amplifier would apply 700 V to a spring with a lower limit.
    #[test]
    fn a_nan_limit_is_rejected() {
        let slow = Settings { amplifier: Amplifier { slew_v_per_s: Some(5000.0), ..SETTINGS.amplifier }, ..SETTINGS };
        let model = |limit_v, slew_v_per_s| {
            let time_constants_s = [5.5].into_iter().collect();
            WireModel { share: 0.1, time_constants_s, limit_v, slew_v_per_s, ..WireModel::default() }
        };
        let check = |limit_v, slew| Control::check(&slow, &model(limit_v, slew)).map_err(|error| error.field);
        assert_eq!(check(Some(650.0), Some(2000.0)), Ok(()));
        assert_eq!(check(Some(f64::NAN), None), Err("max_v"));
        assert_eq!(check(None, Some(f64::NAN)), Err("slew_v_per_s"));
    }

    #[test]
    fn a_host_that_has_been_silent_for_weeks_is_still_silent() {
        let mut control = Control::new(&SETTINGS, &SUPERVISION, None).unwrap();
        control.ticks_since_host = u32::MAX - 1;
        let arm = Command { heard: false, arming: Some(supervisor::Command::Arm), target: None };
        let sensors = Sensors { interlock_closed: true, ..Sensors::default() };
        for _ in 0..3 {
            control.tick(&arm, &sensors, &mut Untimed);
            assert_eq!(control.supervisor().refusal(), Some(supervisor::Refusal::HostSilent));
        }
        control.tick(&Command { heard: true, ..arm }, &sensors, &mut Untimed);
        assert_eq!(control.supervisor().state(), supervisor::State::Armed);
    }
}
