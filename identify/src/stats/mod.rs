//! Medians, sums, scales, a periodogram: numbers in, numbers out.

pub mod median;
pub mod periodogram;
pub mod scale;
pub mod sums;
