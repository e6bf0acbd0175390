//! One control tick: the supervisor decides, the model computes, the supervisor releases.
//!
//! Pure: no clock, no pin, no log. The same bits on the host and on the MCU.

use link::WireModel;
use model::estimator::{Estimator, Model};
use model::supervisor::{self, Command, Decision, Drive, Fault, Inputs, Monitors, Supervisor};
use model::{
    Config, ExtendedPlant, Input, OutOfRange, Output, Reading, ScaledStiffness, Settings, State, Validated, Volts,
    estimator, extended,
};

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
    /// The stiffness sensor's reading, on the scale of volts. Sampled after the last tick's voltage had gone out; an older
    /// one is none.
    pub measured: Option<Volts>,
}

/// What a tick says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// For the amplifier.
    pub drive: Drive,
    /// The controller's view, zero volts while nothing may leave.
    pub output: Output,
    /// The reading that came before it.
    pub measured: Option<Volts>,
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
    spring: Spring,
    supervisor: Supervisor,
    target: Volts,
    ticks_since_host: u32,
}

/// The controller for either kind of spring: the plain one's tick is the leaner.
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
    /// At rest and disarmed; faulted if `last_fault` reset the chip.
    ///
    /// # Errors
    /// [`OutOfRange`] names the setting.
    pub fn new(
        settings: &Settings,
        supervision: &supervisor::Settings,
        last_fault: Option<Fault>,
    ) -> Result<Self, OutOfRange> {
        let settings = settings.validate()?;
        let supervision = supervision.validate(settings.sample_time())?;
        let supervisor = Supervisor::new(supervision.quantize(), last_fault);
        let spring = Spring::Plain(Loop::new(settings));
        Ok(Self { spring, supervisor, target: Volts::ZERO, ticks_since_host: u32::MAX })
    }

    /// Before the first tick: `found` replaces the settings' spring, and what its amplifier cannot do counts.
    ///
    /// # Errors
    /// [`OutOfRange`] names what is wrong with it; then the spring stays.
    pub fn take_on(&mut self, settings: &Settings, found: &WireModel) -> Result<(), OutOfRange> {
        let settings = Found::new(settings, found);
        self.spring = match &settings {
            Found::Plain(settings) => Spring::Plain(Loop::new(settings.validate()?)),
            Found::Extended(settings) => Spring::Extended(Loop::new(settings.validate()?)),
        };
        Ok(())
    }

    /// Whether a controller can be built for this model.
    ///
    /// # Errors
    /// [`OutOfRange`] names what is wrong with it.
    pub fn check(settings: &Settings, found: &WireModel) -> Result<(), OutOfRange> {
        Found::new(settings, found).check()
    }

    /// Before the first tick: nothing may leave until this is acknowledged.
    pub fn fault(&mut self, fault: Fault) {
        self.supervisor.fail(fault);
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
        let measured = senses.measured.and_then(|volts| Reading::fresh(ScaledStiffness(volts.0)));
        let output = match &mut self.spring {
            Spring::Plain(spring) => spring.follow(decision, measured, stopwatch),
            Spring::Extended(spring) => spring.follow(decision, measured, stopwatch),
        };
        Tick { drive: self.supervisor.release(&output), output, measured: senses.measured }
    }
}

/// Settings with a model that was found in the place of their spring.
enum Found<'a> {
    Plain(Settings),
    Extended(Settings<ExtendedPlant<'a>>),
}

impl<'a> Found<'a> {
    fn new(settings: &Settings, found: &'a WireModel) -> Self {
        let Settings { rate_hz, compensation, feedback, .. } = *settings;
        let (plant, amplifier) = (found.plant(), found.behind(settings.amplifier));
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
    /// At rest.
    fn new<P: Model<Config = E>>(settings: Validated<'_, Settings<P>>) -> Self {
        Self { config: settings.quantize(), state: State::default() }
    }

    #[inline(always)]
    fn follow(&mut self, decision: Decision, measured: Option<Reading>, stopwatch: &mut impl Stopwatch) -> Output {
        match decision {
            Decision::Rest => self.config.rest(&mut self.state, measured),
            Decision::Start(target) => {
                // From zero volts, as if zero had been asked for until now.
                self.config.bumpless_transfer(&mut self.state, Volts::ZERO);
                self.timed(Input { target, measured }, stopwatch)
            }
            Decision::Pursue(target) => self.timed(Input { target, measured }, stopwatch),
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

/// The model's tick as one function: it is counted as it would be called.
#[inline(never)]
pub(crate) fn whole_tick<E: Estimator>(config: &Config<E>, state: &mut State<E::State>, input: Input) -> Output {
    config.tick(state, input)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SETTINGS;
    use model::Amplifier;

    /// Taken for no limit it would put 700 V on a spring that asks for protection.
    #[test]
    fn a_limit_that_is_no_number_is_refused() {
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
}
