//! Fits: a model and a record come in; the most likely parameters, their intervals and held-out predictions go out.
//!
//! - *Coordinate*: a number that the fit moves; *parameter*: a quantity of the report, a function of the coordinates.
//! - *Log-likelihood*: the logarithm of the readings' probability density, in nats (natural logarithm).
//! - *Cost*: the reduction of the log-likelihood for fitted numbers (Schwarz's criterion), in nats.
//! - *Held-out residual*: reading minus prediction by a fit that did not use the reading, in V.

pub mod budget;
pub mod engine;
pub mod held_out;
pub mod interval;
pub mod known;
mod known_held_out;
pub mod leave_one_out;
pub mod normal_equations;
mod reading_map;
pub mod simulator;
mod start;
pub mod stop;
