//! The chain from command to stiffness: a plant file in, states and stiffness out.

pub mod bank;
pub mod base;
pub mod chain;
pub mod knots;
pub mod law;
pub mod leakage;
pub mod relaxation;
pub mod start;
