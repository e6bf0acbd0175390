//! Small generators of random numbers for tests and test scripts, which give the same sequence on every machine.
//!
//! The expectations of many tests hold for one sequence of numbers. Generators of other crates may change theirs with a release; these
//! do not. They need no memory but their state, so that they run on the MCU as well.
//!
//! | generator | state | where it comes from |
//! | --- | --- | --- |
//! | [`Lcg32`] | 32 bits | linear congruential, *Numerical Recipes* |
//! | [`Lcg64`] | 64 bits | linear congruential, Knuth's MMIX |
//! | [`SplitMix64`] | 64 bits | Steele, Lea and Flood, 2014 |
//! | [`Xorshift32`] | 32 bits | Marsaglia, 2003, with shifts of 13, 17 and 5 |
//! | [`Xorshift64`] | 64 bits | Marsaglia, 2003, with shifts of 13, 7 and 17 |
#![no_std]
#![forbid(unsafe_code)]

mod lcg32;
mod lcg64;
mod splitmix64;
mod xorshift32;
mod xorshift64;

pub use lcg32::Lcg32;
pub use lcg64::Lcg64;
pub use splitmix64::SplitMix64;
pub use xorshift32::Xorshift32;
pub use xorshift64::Xorshift64;

/// Returns the upper 53 bits of a number as a number from 0 to less than 1.
const fn uniform(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns a nearly normal number of mean 0 and variance 1, -6 to 6: the sum of twelve uniform numbers from 0 to 1, less 6.
fn normal(mut uniform: impl FnMut() -> f64) -> f64 {
    (0..12).map(|_| uniform() - 0.5).sum()
}
