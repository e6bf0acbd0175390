//! The extended spring: everything that identification can find, one tick after the other in the order of the physics.
//!
//! ```text
//! applied voltage v -> memory -> law -> leakage -> relaxation -> stiffness
//!                        p        f        q            y
//! ```
//!
//! Each block is a file: [`memory`], [`law`], [`leakage`], [`lags`] with [`varying_rate`]. All but the relaxation may be
//! absent, which costs one branch that is always taken alike. All states are zero at rest.
//!
//! Signals saturate at the ends of their format, +-2048 V. The tick is exact for a held voltage up to rounding, with two
//! exceptions whose bounds are stated where they are made: the lags see the mean of a leaking input ([`leakage`]), and
//! the rate of a time constant that depends on the voltage is approximated ([`varying_rate`]).

pub mod inverse;
pub mod lags;
pub mod law;
pub mod leakage;
pub mod memory;
pub mod varying_rate;

pub use inverse::Inverse;
pub use lags::Relaxation;
pub use law::Law;
pub use leakage::Leakage;
pub use memory::Memory;

use crate::error::OutOfRange;
use crate::estimator::{Estimator, Model, Outlook, Pivot, Plant, Promptness};
use crate::units::{SampleTime, ScaledStiffness, Signal, Volts};

/// The lowest stiffness that the pre-compensator is shown, so that its error fits in a signal.
const LOWEST: Signal = Signal::const_from_int(-1000);

/// The spring's response to a voltage, in SI units; lists are borrowed from whoever read them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtendedPlant<'a> {
    /// Hysteresis without rate; `None`: p = v.
    pub memory: Option<Memory<'a>>,
    /// Sensitivity over the voltage; `None`: f = p.
    pub law: Option<Law<'a>>,
    /// Loss of charge; `None`: q = f.
    pub leakage: Option<Leakage>,
    /// What comes at once, and what later.
    pub relaxation: Relaxation<'a>,
}

/// The blocks for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    memory: Option<memory::Config>,
    law: Option<law::Config>,
    leakage: Option<leakage::Config>,
    lags: lags::Config,
}

/// What the blocks remember; the default is a spring at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    voltage: Signal,
    /// The memory's output.
    remembered: Signal,
    /// The law's answer to it.
    answer: Signal,
    memory: memory::State,
    leakage: leakage::State,
    lags: lags::State,
}

impl ExtendedPlant<'_> {
    /// The plain spring that this is, if nothing is extended.
    pub fn plain(&self) -> Option<Plant> {
        let Self { memory: None, law: None, leakage: None, relaxation } = *self else { return None };
        match relaxation {
            Relaxation { share, time_constants_s: &[time_constant_s], weights: [], time_constant_high_s: None } => {
                Some(Plant { share, time_constant_s })
            }
            _ => None,
        }
    }
}

impl Model for ExtendedPlant<'_> {
    type Config = Config;

    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        let Self { memory, law, leakage, relaxation } = self;
        memory.as_ref().map_or(Ok(()), Memory::check)?;
        law.as_ref().map_or(Ok(()), Law::check)?;
        leakage.as_ref().map_or(Ok(()), |leakage| leakage.check(sample_time))?;
        relaxation.check(sample_time)
    }

    fn scaled(&self, sample_time: SampleTime) -> Config {
        Config {
            memory: self.memory.as_ref().map(memory::Config::new),
            law: self.law.as_ref().map(law::Config::new),
            leakage: self.leakage.as_ref().map(|leakage| leakage::Config::new(leakage, sample_time)),
            lags: lags::Config::new(&self.relaxation, sample_time),
        }
    }

    fn promptness(&self, sample_time: SampleTime) -> Promptness {
        let memory = self.memory.map_or(1.0, |memory| memory.steepest());
        let steepness = memory * self.law.map_or(1.0, |law| law.steepest());
        let Promptness { at_once, in_a_tick, relaxed } = self.relaxation.promptness(sample_time);
        Promptness { at_once: steepness * at_once, in_a_tick: steepness * in_a_tick, relaxed }
    }

    fn least_promptness(&self, sample_time: SampleTime) -> Promptness {
        let memory = self.memory.map_or(1.0, |memory| memory.turning());
        let steepness = memory * self.law.map_or(1.0, |law| law.flattest());
        let Promptness { at_once, in_a_tick, relaxed } = self.relaxation.least_promptness(sample_time);
        let (lost, lost_in_mean) = self.leakage.map_or((0.0, 0.0), |leakage| leakage.lost_in_a_tick(sample_time));
        Promptness {
            at_once: steepness * at_once * (1.0 - lost),
            in_a_tick: steepness * in_a_tick * (1.0 - lost_in_mean),
            relaxed,
        }
    }

    fn check_inverse(&self) -> Result<(), OutOfRange> {
        inverse::check(self)
    }

    fn inverse(&self, config: &Config, sample_time: SampleTime, resolution_v: f64) -> Inverse {
        Inverse::new(self, config, sample_time, resolution_v)
    }
}

impl Config {
    /// What takes part in the relaxation, when the law answers `answer`.
    #[inline(always)]
    fn charge(&self, state: &State, answer: Signal) -> Signal {
        match &self.leakage {
            None => answer,
            Some(leakage) => leakage.charge(&state.leakage, answer),
        }
    }

    /// One sample time passes with the last voltage held; `charge` takes part in the relaxation at first.
    #[inline(always)]
    fn relax(&self, state: &mut State, charge: Signal) {
        let mean = match &self.leakage {
            None => charge,
            Some(leakage) => leakage.advance(&mut state.leakage, state.answer, charge),
        };
        self.lags.advance(&mut state.lags, mean, state.voltage);
    }
}

impl Estimator for Config {
    type State = State;
    type Inverse = Inverse;

    #[inline(always)]
    fn run(&self, state: &mut State, applied: Volts) -> ScaledStiffness {
        let voltage = applied.0;
        let remembered = match &self.memory {
            None => voltage,
            Some(memory) => memory.run(&mut state.memory, voltage),
        };
        let answer = match &self.law {
            None => remembered,
            Some(law) => law.at(remembered),
        };
        (state.voltage, state.remembered, state.answer) = (voltage, remembered, answer);
        let charge = self.charge(state, answer);
        let stiffness = self.lags.stiffness(&state.lags, charge);
        self.relax(state, charge);
        ScaledStiffness(stiffness)
    }

    #[inline(always)]
    fn pivot(&self, state: &State) -> Pivot {
        let stiffness = self.lags.stiffness(&state.lags, self.charge(state, state.answer));
        Pivot { voltage: state.voltage, stiffness: stiffness.max(LOWEST) }
    }

    #[inline(always)]
    fn outlook(&self, state: &State, _: Volts) -> Outlook {
        let charge = self.charge(state, state.answer);
        let mut next = *state;
        self.relax(&mut next, charge);
        let then = self.lags.stiffness(&next.lags, self.charge(&next, state.answer));
        Outlook { now: self.lags.stiffness(&state.lags, charge), then }
    }

    #[inline(always)]
    fn voltage_for(&self, state: &State, inverse: &Inverse, _: Volts, change: Signal) -> Volts {
        let answer = state.answer.saturating_add(inverse.more(state.voltage, change));
        let remembered = match &self.law {
            None => answer,
            Some(law) => inverse.law.at(law, answer),
        };
        Volts(match &self.memory {
            None => remembered,
            Some(memory) => {
                let more = remembered.saturating_sub(state.remembered);
                inverse.memory.voltage(memory, &state.memory, state.voltage, more)
            }
        })
    }
}
