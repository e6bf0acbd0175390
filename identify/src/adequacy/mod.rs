//! A fit in, what is left that no effect explains out.

pub mod absorbed_by_noise;
pub mod in_step;
pub mod informative;
pub mod localisation;
pub mod spikes;
pub mod standstill;
pub mod unmodelled;
