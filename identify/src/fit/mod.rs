//! A model and a record in, the likeliest parameters, intervals and held-out predictions out.

pub mod engine;
pub mod held_out;
pub mod interval;
pub mod normal_equations;
pub mod simulator;
