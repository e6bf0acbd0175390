//! The plant: a plant file and a commanded voltage come in; the states of the chain and the stiffness go out.
//!
//! - *Stiffness*: expressed as the equivalent static voltage, in V.
//! - *Feedthrough*: the part of a step of the settled stiffness that is reached without delay.
//! - *Play operator*: the element of rate-independent hysteresis, `z' = clamp(z, u - r, u + r)` with threshold `r`.
//! - *Static law*: the settled stiffness as a function of the voltage.
//! - *Leakage*: loss of charge, which lets the stiffness fall while the voltage is constant.
//! - *Relaxation*: feedthrough and first-order lags, which lead to the settled stiffness.

pub mod base;
pub mod chain;
pub mod initial_state;
pub mod knee;
pub mod knots;
pub mod law;
pub mod leakage;
pub mod load_friction;
pub mod play_bank;
pub mod relaxation;
pub mod restoring;
pub mod visited;
