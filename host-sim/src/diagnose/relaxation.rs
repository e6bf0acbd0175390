//! The relaxation: what comes at once, and the lags that bring the rest.
//!
//! ```text
//! y = share q + (1 - share - creep) lag(tau(q); q) + creep lag(creep_tau; q)
//! ```
//!
//! `q` is the stiffness that would be reached in the end. The paper's plant has `creep = 0` and one `tau`.

use super::signal::{Lag, Piece, Signal};
use crate::plant_file::{self, PlantFile};

/// Parameters of the relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Part that comes at once.
    pub share: f64,
    /// Time constant at 0 V, in s.
    pub tau_s: f64,
    /// Time constant at [`Relaxation::HIGH_V`], in s; equal to `tau_s` where the voltage does not matter.
    pub tau_high_s: f64,
    /// Between the two: geometric if true, else straight.
    pub geometric: bool,
    /// Part that a second lag brings.
    pub creep: f64,
    /// Its time constant, in s.
    pub creep_tau_s: f64,
}

impl Relaxation {
    /// The voltage that `tau_high_s` belongs to.
    pub const HIGH_V: f64 = 500.0;

    /// One share, one time constant.
    pub fn plain(share: f64, tau_s: f64) -> Self {
        Self { share, tau_s, tau_high_s: tau_s, geometric: false, creep: 0.0, creep_tau_s: 10.0 * tau_s }
    }

    /// Time constant at a voltage, in s.
    pub fn tau_at(&self, voltage_v: f64) -> f64 {
        let part = voltage_v.abs() / Self::HIGH_V;
        let tau = if self.geometric {
            self.tau_s * (self.tau_high_s / self.tau_s).powf(part)
        } else {
            self.tau_s + (self.tau_high_s - self.tau_s) * part
        };
        tau.max(0.02 * self.tau_s)
    }

    /// Writes itself into a plant file.
    pub fn extend(&self, file: &mut PlantFile) {
        let main = 1.0 - self.share - self.creep;
        let (tau_s, weights) = match self.creep {
            0.0 => (vec![self.tau_s], Vec::new()),
            creep => (vec![self.tau_s, self.creep_tau_s], vec![main, creep]),
        };
        let tau_high_s = self.varies().then_some(self.tau_high_s);
        file.relaxation = plant_file::Relaxation { share: self.share, tau_s, weights, tau_high_s };
    }

    /// The relaxation of a plant file; `None` for one with more than two time constants.
    pub fn of(file: &plant_file::Relaxation) -> Option<Self> {
        let (&tau_s, rest) = file.tau_s.split_first()?;
        let mut relaxation = Self { tau_high_s: file.tau_high_s.unwrap_or(tau_s), ..Self::plain(file.share, tau_s) };
        match (rest, file.weights.as_slice()) {
            ([], []) => Some(relaxation),
            (&[creep_tau_s], &[_, creep]) => {
                relaxation.creep = creep;
                relaxation.creep_tau_s = creep_tau_s;
                Some(relaxation)
            }
            _ => None,
        }
    }

    /// True if the time constant depends on the voltage.
    pub fn varies(&self) -> bool {
        self.tau_high_s != self.tau_s
    }

    /// What becomes of the static stiffness; `levels_v` is the voltage across the spring in the middle of each piece,
    /// needed only if the time constant varies.
    pub fn pass(&self, signal: &mut Signal, levels_v: &[f64]) {
        let before = signal.before;
        let main = 1.0 - self.share - self.creep;
        let mut lag = Lag::at(self.tau_s, before);
        if self.creep == 0.0 && !self.varies() {
            return signal.pass(|piece| {
                let (start, end) = lag.pass(piece);
                (self.share * piece.from + main * start, self.share * piece.to + main * end)
            });
        }
        let mut slow = Lag::at(self.creep_tau_s, before);
        let mut levels = levels_v.iter().copied().filter(|_| self.varies());
        let mut level = f64::NAN;
        signal.pass(|piece: Piece| {
            if let Some(next) = levels.next()
                && next != level
            {
                level = next;
                lag = lag.with_tau(self.tau_at(level));
            }
            let (start, end) = lag.pass(piece);
            let (mut from, mut to) = (self.share * piece.from + main * start, self.share * piece.to + main * end);
            if self.creep != 0.0 {
                let (start, end) = slow.pass(piece);
                from += self.creep * start;
                to += self.creep * end;
            }
            (from, to)
        });
    }
}
