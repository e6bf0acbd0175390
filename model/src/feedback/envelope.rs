//! What range a signal has covered of late.

use crate::coefficient::{Rate, upper};
use crate::units::{Accumulator, SampleTime, Signal};

/// Within which time the envelopes come back to the signal, in s.
const MEMORY_S: f64 = 0.5;

/// How fast they come back in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config(Rate);

/// An upper and a lower envelope.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Envelope {
    upper: Accumulator,
    lower: Accumulator,
}

impl Config {
    pub(super) fn new(sample_time: SampleTime) -> Self {
        Self(Rate::new(sample_time.part_of_way(MEMORY_S)))
    }

    /// The signal is at `now` in this tick.
    #[inline]
    pub(super) fn follow(&self, envelope: &mut Envelope, now: Signal) {
        let back = |from: Accumulator| from.saturating_add(self.0.step(now.saturating_sub(upper(from))));
        let exact = Accumulator::from_bits(i64::from(now.to_bits()) << 32);
        *envelope = Envelope { upper: back(envelope.upper).max(exact), lower: back(envelope.lower).min(exact) };
    }
}

impl Envelope {
    /// `least` and twice the range covered.
    #[inline]
    pub(super) fn gate(&self, least: Signal) -> Signal {
        let range = upper(self.upper).saturating_sub(upper(self.lower));
        least.saturating_add(range).saturating_add(range)
    }
}
