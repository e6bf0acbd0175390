//! What range a signal has covered of late.

use crate::coefficient::{Rate, upper};
use crate::units::{Accumulator, Signal, part_of_way};

/// Within which time the envelopes come back to the signal, in s.
const MEMORY_S: f64 = 0.5;

/// How fast they come back in one interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config(Rate);

/// An upper and a lower envelope.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Envelope {
    upper: Accumulator,
    lower: Accumulator,
}

impl Config {
    /// For a signal that is heard of every `interval_s`.
    pub(super) fn new(interval_s: f64) -> Self {
        Self(Rate::new(part_of_way(interval_s, MEMORY_S)))
    }

    /// The signal is at `now`.
    #[inline]
    pub(super) fn follow(&self, envelope: &mut Envelope, now: Signal) {
        let back = |from: Accumulator| from.saturating_add(self.0.step(now.saturating_sub(upper(from))));
        let exact = Accumulator::from_bits(i64::from(now.to_bits()) << 32);
        *envelope = Envelope { upper: back(envelope.upper).max(exact), lower: back(envelope.lower).min(exact) };
    }
}

impl Envelope {
    /// How far above the lower and below the upper envelope `now` is.
    #[inline]
    pub(super) fn beside(&self, now: Signal) -> (Signal, Signal) {
        (now.saturating_sub(upper(self.lower)), upper(self.upper).saturating_sub(now))
    }

    /// From one to the other.
    #[inline]
    pub(super) fn range(&self) -> Signal {
        upper(self.upper).saturating_sub(upper(self.lower))
    }

    /// `least` and twice the range covered.
    #[inline]
    pub(super) fn gate(&self, least: Signal) -> Signal {
        let range = self.range();
        least.saturating_add(range).saturating_add(range)
    }
}
