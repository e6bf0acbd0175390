//! Configuration and state for both kinds of springs. A plain spring has the faster tick.

use model::estimator::Estimator;
use model::{Config, Input, OutOfRange, Output, Reading, Settings, State, Volts, extended};

use crate::settings::All;

/// A quantized configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "there is no heap")]
pub enum AnyConfig {
    /// Configuration for a plain spring.
    Plain(Config),
    /// Configuration for an extended spring.
    Extended(Config<extended::Config>),
}

/// What changes from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnyState {
    /// State of a plain spring.
    Plain(State),
    /// State of an extended spring.
    Extended(State<extended::State>),
}

impl AnyConfig {
    /// Validates and quantizes settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range.
    pub fn new(settings: &All) -> Result<Self, OutOfRange> {
        let Settings { rate_hz, plant, compensation, amplifier, feedback } = settings.settings()?;
        Ok(match plant.plain() {
            Some(plant) => {
                let settings = Settings { rate_hz, plant, compensation, amplifier, feedback };
                Self::Plain(settings.validate()?.quantize())
            }
            None => {
                let settings = Settings { rate_hz, plant, compensation, amplifier, feedback };
                Self::Extended(settings.validate()?.quantize())
            }
        })
    }

    /// The state of a spring at rest at 0 V.
    pub fn start(&self) -> AnyState {
        match self {
            Self::Plain(_) => AnyState::Plain(State::default()),
            Self::Extended(_) => AnyState::Extended(State::default()),
        }
    }

    /// One tick; `None` if the state belongs to the other kind of spring.
    pub fn tick(&self, state: &mut AnyState, input: Input) -> Option<Output> {
        match (self, state) {
            (Self::Plain(config), AnyState::Plain(state)) => Some(tick(config, state, input)),
            (Self::Extended(config), AnyState::Extended(state)) => Some(tick(config, state, input)),
            _ => None,
        }
    }

    /// One tick with the amplifier off; `None` if the state belongs to the other kind of spring.
    pub fn off(&self, state: &mut AnyState, measured: Option<Reading>) -> Option<Output> {
        match (self, state) {
            (Self::Plain(config), AnyState::Plain(state)) => Some(config.rest(state, measured)),
            (Self::Extended(config), AnyState::Extended(state)) => Some(config.rest(state, measured)),
            _ => None,
        }
    }

    /// Takes over a running state without moving the voltage; `None` if the state belongs to the other kind of spring.
    pub fn transfer(&self, state: &mut AnyState, target: Volts) -> Option<()> {
        match (self, state) {
            (Self::Plain(config), AnyState::Plain(state)) => config.bumpless_transfer(state, target),
            (Self::Extended(config), AnyState::Extended(state)) => config.bumpless_transfer(state, target),
            _ => return None,
        }
        Some(())
    }

    /// The lowest and the highest voltage that is put out.
    pub fn range(&self) -> (Volts, Volts) {
        match self {
            Self::Plain(config) => config.range(),
            Self::Extended(config) => config.range(),
        }
    }
}

/// Not inlined: the two together exceed the range of a branch instruction of a Cortex-M.
#[inline(never)]
fn tick<E: Estimator>(config: &Config<E>, state: &mut State<E::State>, input: Input) -> Output {
    config.tick(state, input)
}
