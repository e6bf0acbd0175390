//! What is true about the variable-stiffness spring, its amplifier and its control, in fixed point.
//!
//! No heap, no `unsafe`, no hardware, and no floating point once a [`Config`] is built: the same bits on a host and on
//! the MCU. One tick is [`Config::tick`], a pure function of the configuration, the state and the input, and data goes
//! through it one way:
//!
//! ```text
//! target [V] -> pre-compensator -> amplifier limits -> DAC code
//!      ^               ^                     |
//!      |               +---- estimator <-----+   (runs on the voltage really applied)
//!      +-- correction <------+
//!               ^ measured stiffness, if there is a sensor
//! ```
//!
//! A desired stiffness in Pa or N/m becomes a target in volts off the hot path, in [`stiffness`].
//!
//! | module | what it is |
//! | --- | --- |
//! | [`stiffness`] | Young's modulus against voltage, spring constant of the cantilever, both ways |
//! | [`estimator`] | the spring's relaxation, run on the applied voltage |
//! | [`extended`] | the same for a spring with hysteresis, a static law, leakage and several relaxations |
//! | [`pre_compensator`] | proportional-integral drive past the target and back |
//! | [`time_optimal`] | the same, as fast as the amplifier allows |
//! | [`feedback`] | a stiffness sensor that corrects the estimate, and when it is not believed |
//! | [`amplifier`] | range, slew, rounding to a DAC code, and back to volts |
//! | [`controller`] | the four in one tick; settings in SI, checked once |
//! | [`supervisor`] | whether a voltage may leave at all |
//! | [`units`], [`coefficient`] | the number formats |
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod amplifier;
pub mod coefficient;
pub mod controller;
pub mod error;
pub mod estimator;
pub mod extended;
#[cfg_attr(not(feature = "feedback"), path = "absent/feedback.rs")]
pub mod feedback;
pub mod pre_compensator;
pub mod stiffness;
pub mod supervisor;
#[cfg_attr(not(feature = "time-optimal"), path = "absent/time_optimal.rs")]
pub mod time_optimal;
pub mod units;

pub use amplifier::{Amplifier, Limits};
pub use controller::{Compensation, Config, Input, Output, Settings, State};
pub use error::OutOfRange;
pub use estimator::Plant;
pub use extended::ExtendedPlant;
pub use feedback::{Feedback, Reading, Sensor};
pub use pre_compensator::Gains;
pub use stiffness::Spring;
pub use time_optimal::Approach;
pub use units::{DacCode, SampleTime, ScaledStiffness, Volts};
