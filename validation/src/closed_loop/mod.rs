//! The fixed-point controller of `model` in closed loop with a ground-truth spring, with a stiffness sensor and
//! without.
//!
//! In: controller settings, causes, seeds. Out: steady errors, settling times, overshoots and the response to sensor
//! failures, as values and as Markdown.
//!
//! | module | contents |
//! | --- | --- |
//! | [`stair`] | the targets, and the figures of each step response |
//! | [`scenario`] | one run of the loop, tick by tick |
//! | [`effects`] | every effect, with a sensor and without |
//! | [`requirement`] | each step within 0.6 s, or as fast as the spring can be, with little overshoot |
//! | [`bound`] | the time in which any controller with the sensor can make a step |
//! | [`sensor_failure`] | a sensor that fails and recovers |
//! | [`tables`] | results as Markdown |

pub mod bound;
pub mod effects;
pub mod requirement;
pub mod scenario;
pub mod sensor_failure;
pub mod stair;
pub mod tables;
