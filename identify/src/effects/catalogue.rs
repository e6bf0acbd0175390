//! The list of all effects, in the order of the signal chain.

use crate::effects::effect::Effect;
use crate::effects::{
    amplifier_limit, amplifier_slew, charge_leakage, delay, drift, gain_error, hum, hysteresis, instantaneous_share,
    outliers, quantisation, reading_offset, resonance, second_relaxation, sensor_saturation, static_nonlinearity,
    time_constant, voltage_dependent_time_constant,
};

/// Every effect, in the order of the chain: each acts on what the ones before it have made.
pub static EFFECTS: &[&dyn Effect] = &[
    &amplifier_limit::AmplifierLimit,
    &amplifier_slew::AmplifierSlew,
    &delay::Delay,
    &hysteresis::Hysteresis,
    &gain_error::GainError,
    &static_nonlinearity::StaticNonlinearity,
    &charge_leakage::ChargeLeakage,
    &instantaneous_share::InstantaneousShare,
    &time_constant::TimeConstant,
    &second_relaxation::SecondRelaxation,
    &voltage_dependent_time_constant::VoltageDependentTimeConstant,
    &resonance::Resonance,
    &drift::Drift,
    &hum::Hum,
    &reading_offset::ReadingOffset,
    &sensor_saturation::SensorSaturation,
    &quantisation::Quantisation,
    &outliers::Outliers,
];

/// The place of a cause in [`EFFECTS`].
pub fn index_of(cause: &str) -> Option<usize> {
    EFFECTS.iter().position(|effect| effect.cause() == cause)
}

/// True if a cause contains another, as its special case.
pub fn contains(effect: usize, other: usize) -> bool {
    EFFECTS[other].special_case_of().contains(&EFFECTS[effect].cause())
}
