//! Charge leakage: a fraction of the response is lost with a time constant of its own. A part of the loss may be
//! instantaneous, the rest passes the relaxation:
//!
//! ```text
//! q = f - (1 - instantaneous) share lag(tau; f)        y = relaxation(q) - instantaneous share lag(tau; f)
//! ```
//!
//! Behind a relaxation with one time constant, a loss with an instantaneous part has the same response as a loss that
//! passes the relaxation as a whole, with another gain and another feedthrough ([`Loss::equivalent_leakage`]). So a
//! plant file can hold it.

use crate::plant::initial_state::InitialState;
use crate::plant::relaxation::Relaxation;
use crate::record::signal::{Lag, Signal};
use simulation::plant_file::Leakage;

/// A loss of charge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Fraction of the settled stiffness that is lost finally, 0 to 1.
    pub share: f64,
    /// Time constant of the loss, in s.
    pub tau_s: f64,
    /// Fraction of the loss that does not pass the relaxation, 0 to 1.
    pub instantaneous: f64,
}

/// The instantaneous part of the losses, in V: before the first piece, and at start and end of each piece.
#[derive(Debug, Default)]
pub struct InstantaneousLoss {
    before: f64,
    pieces: Vec<(f64, f64)>,
}

impl Loss {
    /// Returns the loss of a plant file, all of which passes the relaxation.
    pub fn of(&Leakage { share, tau_s }: &Leakage) -> Self {
        Self { share, tau_s, instantaneous: 0.0 }
    }

    /// Subtracts from the signal the part of the loss that passes the relaxation, and adds the rest to `lost`.
    pub fn apply(&self, signal: &mut Signal, start: &mut InitialState, lost: &mut InstantaneousLoss) {
        let (passes, instantaneous) = (self.share * (1.0 - self.instantaneous), self.share * self.instantaneous);
        let mut lag = Lag::at(self.tau_s, signal.before + start.next_offset_v());
        lost.before += instantaneous * signal.before;
        signal.before *= 1.0 - passes;
        if lag.value() == 0.0 && signal.is_zero() {
            return;
        }
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

    /// Returns a gain, a feedthrough and a leakage whose losses all pass the relaxation and which have the same
    /// response as this loss with the given relaxation; `None` if there are none.
    ///
    /// ```text
    /// The coefficients of the three terms 1, lag(relaxation) and lag(loss) are equal:
    /// gain share' = a      h (1 + loss k) = b      loss (a + h (1 + k)) = c      k = tau_r / (tau - tau_r),  h = gain (1 - share')
    /// ```
    pub fn equivalent_leakage(&self, relaxation: &Relaxation) -> Option<(f64, f64, Leakage)> {
        if relaxation.parts().next().is_some() || !relaxation.is_linear() {
            return None;
        }
        let (share, passes) = (relaxation.share, self.share * (1.0 - self.instantaneous));
        let k = relaxation.tau_s / (self.tau_s - relaxation.tau_s);
        let (a, b) = (share, (1.0 - share) * (1.0 + passes * k));
        let c = passes * (share + (1.0 - share) * (1.0 + k)) + self.share * self.instantaneous;
        // The equation of the new loss is a k loss^2 + (a + b (1 + k) - c k) loss = c.
        let middle = a + b * (1.0 + k) - c * k;
        let loss = 2.0 * c / (middle + (middle * middle + 4.0 * a * k * c).sqrt());
        let gain = a + b / (1.0 + loss * k);
        let leakage = Leakage { share: loss, tau_s: self.tau_s };
        ((0.0..1.0).contains(&loss) && gain > 0.0).then_some((gain, a / gain, leakage))
    }
}

impl InstantaneousLoss {
    /// Subtracts the instantaneous part from a signal that has passed the relaxation.
    pub fn subtract_from(&self, signal: &mut Signal) {
        signal.before -= self.before;
        let mut lost = self.pieces.iter();
        signal.pass(|piece| {
            let (from, to) = lost.next().copied().unwrap_or_default();
            (piece.from - from, piece.to - to)
        });
    }

    /// Returns true if no loss has an instantaneous part.
    pub fn is_none(&self) -> bool {
        self.pieces.is_empty()
    }
}
