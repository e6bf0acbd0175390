//! The range that a signal has covered recently: an upper and a lower envelope, which return to the signal with a time
//! constant of 0.5 s.

use crate::coefficient::{Rate, upper, widened};
use crate::units::{Accumulator, Signal, lag_fraction};

/// Time constant, in s, with which the envelopes return to the signal.
const RETURN_S: f64 = 0.5;

/// Fraction of their distance to the signal that the envelopes return in one interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config(Rate);

/// Upper and lower envelope of a signal, in V; the default is that of a signal that has always been 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Envelope {
    upper: Accumulator,
    lower: Accumulator,
}

impl Config {
    /// Quantizes the envelopes of a signal that is sampled every `interval_s`.
    pub(super) fn new(interval_s: f64) -> Self {
        Self(Rate::new(lag_fraction(interval_s, RETURN_S)))
    }

    /// Advances the envelopes by one interval, at the end of which the signal is `now`.
    #[inline]
    pub(super) fn track(&self, envelope: &mut Envelope, now: Signal) {
        let returned = |from: Accumulator| from.saturating_add(self.0.step(now.saturating_sub(upper(from))));
        let exact = widened(now);
        *envelope = Envelope { upper: returned(envelope.upper).max(exact), lower: returned(envelope.lower).min(exact) };
    }
}

impl Envelope {
    /// Returns how far `now` is above the lower envelope and how far below the upper one, in V.
    #[inline]
    pub(super) fn distances(&self, now: Signal) -> (Signal, Signal) {
        (now.saturating_sub(upper(self.lower)), upper(self.upper).saturating_sub(now))
    }

    /// Returns the distance between the envelopes, in V.
    #[inline]
    pub(super) fn range(&self) -> Signal {
        upper(self.upper).saturating_sub(upper(self.lower))
    }

    /// Returns `least` plus twice the range, in V: the bound beyond which a deviation is not explained by the signal's
    /// movement.
    #[inline]
    pub(super) fn gate(&self, least: Signal) -> Signal {
        let range = self.range();
        least.saturating_add(range).saturating_add(range)
    }
}
