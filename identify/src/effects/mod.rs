//! The effects that may explain a difference between simulation and readings, one file each, but one for those that are found in the
//! readings themselves: bounds and initial points go out, and each effect modifies the chain, the stiffness or the readings.
//!
//! - *Cause*: the name of an effect in reports, e.g. `gain-error`.
//! - *Form*: one of several laws of the same cause.
//! - *Block*: an effect in one form; *point*: the values of its coordinates.
//! - *Model*: a set of blocks, applied to the chain of a plant file.

mod amplifier_limit;
mod amplifier_slew;
mod boundary;
mod catalogue;
mod charge_leakage;
mod delay;
mod drift;
mod drive;
pub mod effect;
mod gain_error;
mod hum;
mod hum_envelope;
mod hysteresis;
pub mod identified;
mod instantaneous_share;
pub mod model;
mod of_the_readings;
mod offset_levels;
mod passing_shift;
mod reading_offset;
mod resonance;
mod second_relaxation;
mod sensor_saturation;
mod series_lag;
mod static_nonlinearity;
mod time_constant;
mod voltage_dependent_time_constant;

pub use catalogue::{EFFECTS, contains, index_of};
