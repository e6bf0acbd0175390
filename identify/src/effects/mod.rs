//! The effects, one file each, in the order in which they act.

mod amplifier_limit;
mod amplifier_slew;
mod catalogue;
mod charge_leakage;
mod delay;
mod drift;
pub mod effect;
mod gain_error;
mod hum;
mod hysteresis;
mod instantaneous_share;
pub mod model;
mod outliers;
mod quantisation;
mod reading_offset;
mod resonance;
mod second_relaxation;
mod sensor_saturation;
mod static_nonlinearity;
mod time_constant;
mod voltage_dependent_time_constant;

pub use catalogue::{EFFECTS, contains, index_of};
