//! The extended spring: hysteresis, a static law, leakage and several relaxations, run one after the other in each
//! tick.
//!
//! Important terms:
//!
//! - *memory*: rate-independent hysteresis, a bank of play operators ([`Memory`]).
//! - *law*: the static sensitivity of the stiffness to the voltage ([`Law`]).
//! - *leakage*: loss of charge, which lets the stiffness fall while the voltage stays ([`Leakage`]).
//! - *relaxation*: a feedthrough and up to four first-order lags ([`Relaxation`]).
//! - *inverse*: the way back from a change of the stiffness to a voltage ([`Inverse`]).
//!
//! ```text
//! applied voltage v -> memory -> law -> leakage -> relaxation -> stiffness
//!                        p        f        q            y
//! ```
//!
//! All blocks but the relaxation may be absent, which costs one well-predicted branch. All states are zero at rest.
//!
//! Signals saturate at the ends of their format, +-2048 V. The tick is exact for a held voltage up to rounding, with
//! two exceptions whose bounds are stated where they are made: the lags see the mean of a leaking input ([`leakage`]),
//! and the rate of a time constant that depends on the voltage is approximated ([`varying_rate`]).

pub mod inverse;
pub mod lags;
pub mod law;
pub mod leakage;
pub mod memory;
mod plant;
pub mod varying_rate;

pub use inverse::Inverse;
pub use lags::Relaxation;
pub use law::Law;
pub use leakage::Leakage;
pub use memory::Memory;
pub use plant::ExtendedPlant;

use crate::error::OutOfRange;
use crate::estimator::{Estimator, Invertible, Model, OperatingPoint, Prediction, StepGain};
use crate::units::{SampleTime, ScaledStiffness, Signal, Volts};
use crate::validated::{Validate, Validated};

/// Lowest stiffness of an operating point, so that the pre-compensator's error fits in a signal.
const LOWEST: Signal = Signal::const_from_int(-1000);

/// The extended spring for one sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    memory: Option<memory::Config>,
    law: Option<law::Config>,
    leakage: Option<leakage::Config>,
    lags: lags::Config,
}

/// State of the extended spring; the default is a spring at rest at 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// The last voltage, `v`.
    voltage: Signal,
    /// Output of the memory, `p`.
    after_memory: Signal,
    /// Output of the law, `f`.
    after_law: Signal,
    memory: memory::State,
    leakage: leakage::State,
    lags: lags::State,
}

impl Model for ExtendedPlant<'_> {
    type Config = Config;

    fn quantize(plant: Validated<'_, Self>) -> Config {
        let Self { memory, law, leakage, relaxation } = plant.settings();
        Config {
            memory: memory.as_ref().map(|memory| plant.part(memory).quantize()),
            law: law.as_ref().map(|law| plant.part(law).quantize()),
            leakage: leakage.as_ref().map(|leakage| plant.part(leakage).quantize()),
            lags: plant.part(relaxation).quantize(),
        }
    }

    fn largest_step_gain(&self, sample_time: SampleTime) -> StepGain {
        let memory = self.memory.map_or(1.0, |memory| memory.largest_slope());
        let slope = memory * self.law.map_or(1.0, |law| law.largest_slope());
        let StepGain { feedthrough, in_one_tick, relaxation } = self.relaxation.largest_step_gain(sample_time);
        StepGain { feedthrough: slope * feedthrough, in_one_tick: slope * in_one_tick, relaxation }
    }

    fn smallest_step_gain(&self, sample_time: SampleTime) -> StepGain {
        let memory = self.memory.map_or(1.0, |memory| memory.slope_at_turn());
        let slope = memory * self.law.map_or(1.0, |law| law.smallest_slope());
        let StepGain { feedthrough, in_one_tick, relaxation } = self.relaxation.smallest_step_gain(sample_time);
        let (lost, lost_in_mean) = self.leakage.map_or((0.0, 0.0), |leakage| leakage.loss_in_one_tick(sample_time));
        StepGain {
            feedthrough: slope * feedthrough * (1.0 - lost),
            in_one_tick: slope * in_one_tick * (1.0 - lost_in_mean),
            relaxation,
        }
    }

    fn check_inverse(&self) -> Result<(), OutOfRange> {
        inverse::check(self)
    }

    fn check_differing(&self, factors: (f64, f64), sample_time: SampleTime) -> Result<(), OutOfRange> {
        self.relaxation.times(factors, |relaxation| relaxation.check(sample_time))
    }

    fn differing(plant: Validated<'_, Self>, factors: (f64, f64), resolution_v: f64) -> Invertible<Config> {
        let spring = plant.settings();
        spring.relaxation.times(factors, |&relaxation| {
            let differing = ExtendedPlant { relaxation, ..*spring };
            Invertible::new(Validated::new(&differing, plant.sample_time()), resolution_v)
        })
    }

    fn inverse(plant: Validated<'_, Self>, config: &Config, resolution_v: f64) -> Inverse {
        Inverse::new(plant.settings(), config.memory.as_ref(), plant.sample_time(), resolution_v)
    }
}

impl Config {
    /// Returns the input of the relaxation, `q`, for the law's output `after_law`.
    #[inline(always)]
    fn charge(&self, state: &State, after_law: Signal) -> Signal {
        match &self.leakage {
            None => after_law,
            Some(leakage) => leakage.charge(&state.leakage, after_law),
        }
    }

    /// Advances leakage and relaxation by one sample time with the last voltage held; `charge` is `q` at its start.
    #[inline(always)]
    fn relax(&self, state: &mut State, charge: Signal) {
        let mean = match &self.leakage {
            None => charge,
            Some(leakage) => leakage.advance(&mut state.leakage, state.after_law, charge),
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
        let after_memory = match &self.memory {
            None => voltage,
            Some(memory) => memory.run(&mut state.memory, voltage),
        };
        let after_law = match &self.law {
            None => after_memory,
            Some(law) => law.at(after_memory),
        };
        (state.voltage, state.after_memory, state.after_law) = (voltage, after_memory, after_law);
        let charge = self.charge(state, after_law);
        let stiffness = self.lags.stiffness(&state.lags, charge);
        self.relax(state, charge);
        ScaledStiffness(stiffness)
    }

    /// Returns the last voltage and the stiffness that it would give now.
    #[inline(always)]
    fn operating_point(&self, state: &State) -> OperatingPoint {
        let stiffness = self.lags.stiffness(&state.lags, self.charge(state, state.after_law));
        OperatingPoint { voltage: state.voltage, stiffness: stiffness.max(LOWEST) }
    }

    #[inline(always)]
    fn predict(&self, state: &State, _: Volts) -> Prediction {
        let charge = self.charge(state, state.after_law);
        let mut next = *state;
        self.relax(&mut next, charge);
        let end = self.lags.stiffness(&next.lags, self.charge(&next, state.after_law));
        Prediction { now: self.lags.stiffness(&state.lags, charge), end }
    }

    #[inline(always)]
    fn voltage_for(&self, state: &State, inverse: &Inverse, _: Volts, change: Signal) -> Volts {
        let after_law = state.after_law.saturating_add(inverse.change_of_law(state.voltage, change));
        let after_memory = match &self.law {
            None => after_law,
            Some(law) => inverse.law.at(law, after_law),
        };
        Volts(match &self.memory {
            None => after_memory,
            Some(memory) => {
                let change = after_memory.saturating_sub(state.after_memory);
                inverse.memory.voltage(memory, &state.memory, state.voltage, change)
            }
        })
    }
}

#[cfg(test)]
mod tests;
