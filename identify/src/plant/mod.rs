//! The chain from command to stiffness: a plant file in, states and stiffness out.

pub mod base;
pub mod chain;
pub mod initial_state;
pub mod knots;
pub mod law;
pub mod leakage;
pub mod play_bank;
pub mod relaxation;
