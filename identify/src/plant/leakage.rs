//! Charge that leaks away: what follows the charge with a time constant of its own is lost. Some of the loss may show at
//! once, the rest as the spring relaxes:
//!
//! ```text
//! q = f - (1 - at_once) share lag(tau; f)        y = relaxation(q) - at_once share lag(tau; f)
//! ```
//!
//! Behind a relaxation with one time constant, a loss that shows at once is seen from outside as one that passes the
//! relaxation, with another gain and another part that comes at once ([`Loss::passed`]). So a plant file can hold it.

use crate::plant::initial_state::InitialState;
use crate::plant::relaxation::Relaxation;
use crate::record::signal::{Lag, Signal};
use simulation::plant_file::Leakage;

/// A loss of charge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Part that is lost in the end.
    pub share: f64,
    /// Its time constant, in s.
    pub tau_s: f64,
    /// Part of the loss that does not pass the relaxation.
    pub instantaneous: f64,
}

/// What shows at once: before the first piece, and at start and end of each.
#[derive(Debug, Default)]
pub struct InstantaneousLoss {
    before: f64,
    pieces: Vec<(f64, f64)>,
}

impl Loss {
    /// Of a plant file: all of it passes the relaxation.
    pub fn of(&Leakage { share, tau_s }: &Leakage) -> Self {
        Self { share, tau_s, instantaneous: 0.0 }
    }

    /// Takes off the charge what passes the relaxation, and adds to `lost` what does not.
    pub fn take(&self, signal: &mut Signal, start: &mut InitialState, lost: &mut InstantaneousLoss) {
        let (passes, instantaneous) = (self.share * (1.0 - self.instantaneous), self.share * self.instantaneous);
        let mut lag = Lag::at(self.tau_s, signal.before + start.next_offset_v());
        lost.before += instantaneous * signal.before;
        signal.before *= 1.0 - passes;
        let mut number = 0;
        signal.pass(|piece| {
            let (start, end) = lag.pass(piece);
            if instantaneous != 0.0 {
                if number == lost.pieces.len() {
                    lost.pieces.push((0.0, 0.0));
                }
                let (from, to) = &mut lost.pieces[number];
                (*from, *to) = (*from + instantaneous * start, *to + instantaneous * end);
                number += 1;
            }
            (piece.from - passes * start, piece.to - passes * end)
        });
    }

    /// The loss that passes a plain relaxation and looks the same behind it, the relaxation's new share, and a gain before both;
    /// none if there is no such loss.
    ///
    /// ```text
    /// in front of its parts, 1, lag(relaxation) and lag(loss), both have the same factors:
    /// gain share' = a      h (1 + loss k) = b      loss (a + h (1 + k)) = c      k = tau_r / (tau - tau_r),  h = gain (1 - share')
    /// ```
    pub fn equivalent_leakage(&self, relaxation: &Relaxation) -> Option<(f64, f64, Leakage)> {
        if relaxation.parts().next().is_some() || relaxation.varies() {
            return None;
        }
        let (share, passes) = (relaxation.share, self.share * (1.0 - self.instantaneous));
        let k = relaxation.tau_s / (self.tau_s - relaxation.tau_s);
        let (a, b) = (share, (1.0 - share) * (1.0 + passes * k));
        let c = passes * (share + (1.0 - share) * (1.0 + k)) + self.share * self.instantaneous;
        // a k loss^2 + (a + b (1 + k) - c k) loss = c
        let middle = a + b * (1.0 + k) - c * k;
        let loss = 2.0 * c / (middle + (middle * middle + 4.0 * a * k * c).sqrt());
        let gain = a + b / (1.0 + loss * k);
        let leakage = Leakage { share: loss, tau_s: self.tau_s };
        ((0.0..1.0).contains(&loss) && gain > 0.0).then_some((gain, a / gain, leakage))
    }
}

impl InstantaneousLoss {
    /// Takes it off what has passed the relaxation.
    pub fn off(&self, signal: &mut Signal) {
        signal.before -= self.before;
        let mut lost = self.pieces.iter();
        signal.pass(|piece| {
            let (from, to) = lost.next().copied().unwrap_or_default();
            (piece.from - from, piece.to - to)
        });
    }

    /// True if nothing is.
    pub fn is_none(&self) -> bool {
        self.pieces.is_empty()
    }
}
