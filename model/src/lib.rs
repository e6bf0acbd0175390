//! The variable-stiffness spring, its amplifier and its control, in fixed point.
//!
//! Important terms:
//!
//! - *spring* or *plant*: a piezo cantilever whose stiffness follows the voltage across it: a part instantaneously, the
//!   rest with a relaxation of seconds.
//! - *scaled stiffness*: stiffness expressed as the equivalent static voltage, in V.
//! - *target*: the desired scaled stiffness, in V.
//! - *estimator*: the model of the spring, run on the voltage that was really applied.
//! - *pre-compensator*: shapes the voltage, with deliberate overshoot, so that the stiffness reaches the target sooner.
//! - *supervisor*: decides whether the output is enabled.
//! - *settings*, *config*, *state*: SI units and floats as a person writes them; the same validated and quantized to
//!   fixed point; what changes from tick to tick.
//!
//! One tick is [`Config::tick`], a pure function of configuration, state and input. Data goes through it one way:
//!
//! ```text
//! target [V] -> pre-compensator -> amplifier limits -> DAC code
//!      ^               ^                     |
//!      |               +---- estimator <-----+   (runs on the voltage really applied)
//!      +-- correction <------+
//!               ^ measured stiffness, if there is a sensor
//! ```
//!
//! No heap, no `unsafe`, no hardware, and no floating point once a [`Config`] is built: the same bits on a host and on
//! the MCU. A desired stiffness in Pa or N/m becomes a target off the hot path, by [`Spring::target`].
//!
//! | module | content |
//! | --- | --- |
//! | [`stiffness`] | Young's modulus and spring constant over voltage, and the inverse |
//! | [`estimator`] | the plain spring: feedthrough and one relaxation |
//! | [`extended`] | a spring with hysteresis, a static law, leakage and several relaxations |
//! | [`pre_compensator`] | the proportional-integral pre-compensator |
//! | [`time_optimal`] | the pre-compensator that is as fast as the amplifier allows |
//! | [`robust`] | the pre-compensator that is as fast as a spring allows that is known to within errors |
//! | [`feedback`] | correction of the estimate by a stiffness sensor, and detection of the sensor's faults |
//! | [`isolation`] | which fault explains that sensor and model differ |
//! | [`adaptation`] | parameters that it has named, taken over by the running model |
//! | [`amplifier`] | slew, range, rounding to a DAC code |
//! | [`controller`] | all of these in one tick |
//! | [`supervisor`] | whether the output is enabled |
//! | [`device`] | settings of a controller on an MCU |
//! | [`validated`] | settings are validated before they are quantized |
//! | [`units`], [`coefficient`] | number formats |
//!
//! `examples/timer_loop.rs` is the loop of a firmware's timer interrupt, to be copied:
//!
//! ```
//! use model::{Config, Input, OutOfRange, Settings, State, Volts};
//!
//! fn main() -> Result<(), OutOfRange> {
//!     let config: Config = Settings::PAPER.validate()?.quantize();
//!     let mut state = State::default();
//!     let output = config.tick(&mut state, Input { target: Volts::new(100.0)?, ..Input::default() });
//!     // 4 times the error, divided by 1 + 4/11 for the feedthrough; written to a 12-bit DAC of 700 V.
//!     assert_eq!(output.voltage.to_f64().round(), 293.0);
//!     assert_eq!(output.code.0, 1716);
//!     Ok(())
//! }
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod adaptation;
pub mod amplifier;
pub mod coefficient;
pub mod controller;
pub mod device;
pub mod error;
pub mod estimator;
pub mod extended;
pub mod feedback;
pub mod isolation;
pub mod pre_compensator;
pub mod robust;
pub mod stiffness;
pub mod supervisor;
pub mod time_optimal;
pub mod units;
pub mod validated;

pub use amplifier::{Amplifier, Limits};
pub use controller::{Compensation, Config, Input, Output, Settings, State};
pub use error::OutOfRange;
pub use estimator::Plant;
pub use extended::ExtendedPlant;
pub use feedback::{Feedback, Reading, SENSOR_NAMES, Sensor};
pub use pre_compensator::Gains;
pub use robust::Margin;
pub use stiffness::Spring;
pub use time_optimal::Approach;
pub use units::{DacCode, SampleTime, ScaledStiffness, Volts};
pub use validated::{Validate, Validated};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
