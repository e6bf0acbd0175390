//! The list of all effects, in the order of the signal chain.

use crate::effects::effect::Effect;
use crate::effects::of_the_readings::{OUTLIERS, QUANTISATION, STUCK_SENSOR};
use crate::effects::{
    amplifier_limit, amplifier_slew, charge_leakage, delay, drift, gain_error, hum, hysteresis, instantaneous_share,
    reading_offset, resonance, second_relaxation, sensor_saturation, series_lag, static_nonlinearity, time_constant,
    voltage_dependent_time_constant,
};

/// Every effect, in the order of the chain: each acts on the result of those before it.
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
    &series_lag::SeriesLag,
    &drift::Drift,
    &hum::Hum,
    &reading_offset::ReadingOffset,
    &sensor_saturation::SensorSaturation,
    &QUANTISATION,
    &STUCK_SENSOR,
    &OUTLIERS,
];

/// Returns the index of a cause in [`EFFECTS`]; `None` for an unknown name.
pub fn index_of(cause: &str) -> Option<usize> {
    EFFECTS.iter().position(|effect| effect.cause() == cause)
}

/// Returns true if the effect `other` is a special case of `effect`.
pub fn contains(effect: usize, other: usize) -> bool {
    EFFECTS[other].special_case_of().contains(&EFFECTS[effect].cause())
}
