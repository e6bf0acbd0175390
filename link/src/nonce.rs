//! The number of a session, which distinguishes it from every other one.
//!
//! The MCU offers a new one with its reply to each `Hello`, and every further request of the session carries it. A frame
//! that was recorded in an earlier session carries another one, and has no effect.
//!
//! A nonce is no secret and no signature: whoever reads the line knows it. It protects against frames that are old, not
//! against a host that lies.

use serde::{Deserialize, Serialize};

use crate::sequence::Sequence;

/// Number of a session; 0 stands for none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Nonce(pub u32);

impl Nonce {
    /// No session: the nonce of a `Hello`, and of a reply before the first session.
    pub const NONE: Self = Self(0);

    /// The stamp of message number `sequence` of this session.
    pub const fn stamp(self, sequence: Sequence) -> Stamp {
        Stamp { session: self, sequence }
    }
}

/// Session and number of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Session of the message.
    pub session: Nonce,
    /// Number of the request, or of the telemetry sample.
    pub sequence: Sequence,
}

/// The stamp of a message outside of a session.
impl From<Sequence> for Stamp {
    fn from(sequence: Sequence) -> Self {
        Nonce::NONE.stamp(sequence)
    }
}

/// Source of the nonces of one start: 2^32 - 1 of them before one repeats, in an order that the seed determines.
#[derive(Clone, Copy, Debug)]
pub struct Nonces(u32);

impl Nonces {
    /// The nonces of a start with this `seed`, which has to differ from start to start.
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }

    /// The next nonce.
    pub fn draw(&mut self) -> Nonce {
        loop {
            self.0 = self.0.wrapping_add(1);
            // The result 0 comes once in 2^32.
            if let nonce @ 1.. = mixed(self.0) {
                return Nonce(nonce);
            }
        }
    }
}

/// A bijection of 32 bits in which each bit of the argument changes half of the result's (Wellons, hash prospector, 2018).
const fn mixed(mut bits: u32) -> u32 {
    bits ^= bits >> 16;
    bits = bits.wrapping_mul(0x7feb_352d);
    bits ^= bits >> 15;
    bits = bits.wrapping_mul(0x846c_a68b);
    bits ^ bits >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn no_nonce_repeats_and_none_is_zero() {
        for seed in [0, 7, u32::MAX, u32::MAX - 1000] {
            let mut nonces = Nonces::new(seed);
            let drawn: BTreeSet<u32> = (0..100_000).map(|_| nonces.draw().0).collect();
            assert!(drawn.len() == 100_000 && !drawn.contains(&0), "{seed}");
        }
        assert_eq!(mixed(0), 0);
        assert_ne!(Nonces::new(u32::MAX).draw(), Nonce::NONE, "the one that would be 0 is left out");
    }

    /// Over many seeds every bit of the nonce changes in half of them, whichever bit of the seed does.
    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn each_bit_of_a_seed_changes_each_bit_of_the_nonce_in_half_of_all_seeds() {
        const SEEDS: u32 = 1000;
        for bit in 0..32 {
            let mut changed = [0; 32];
            for seed in (0..SEEDS).map(|index| index.wrapping_mul(0x9e37_79b9)) {
                let differ = mixed(seed) ^ mixed(seed ^ 1 << bit);
                changed.iter_mut().enumerate().for_each(|(at, count)| *count += differ >> at & 1);
            }
            // 6 standard deviations of a fair coin, and as much for the function's own bias.
            let fair = SEEDS * 3 / 10..=SEEDS * 7 / 10;
            assert!(changed.iter().all(|count| fair.contains(count)), "bit {bit}: {changed:?}");
        }
    }

    #[test]
    fn seeds_that_differ_by_little_give_other_nonces() {
        let first = |seed| Nonces::new(seed).draw().0;
        for bit in 0..32 {
            let differ = (first(12_345) ^ first(12_345 ^ 1 << bit)).count_ones();
            assert!((6..=26).contains(&differ), "bit {bit} changes {differ} bits");
        }
    }
}
