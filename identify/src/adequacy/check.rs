//! The interface of every check, what it receives and what it returns.

use crate::adequacy::unidentifiable::Unidentifiable;
use crate::fit::engine::{Engine, Fit};

/// A test of whether a fit leaves nothing but noise, on a record that can identify a spring.
pub trait Check: Sync {
    /// Name of the check in [`CHECKS`](crate::adequacy::CHECKS): that of its file.
    fn name(&self) -> &'static str;

    /// Returns what makes the candidate inadequate, or `None` if the check finds nothing.
    fn test(&self, engine: &mut Engine, candidate: &Candidate) -> Option<Inadequacy>;
}

/// A fit that is to be checked.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<'f> {
    /// Model, residual and noise of the fit.
    pub fit: &'f Fit,
    /// Log-likelihood less the price of the model's blocks, in nats.
    pub score: f64,
}

impl<'f> Candidate<'f> {
    /// A fit whose score is its log-likelihood: no price is charged for its blocks.
    pub fn unpriced(fit: &'f Fit) -> Self {
        Self { fit, score: fit.log_likelihood }
    }
}

/// What a check finds.
#[derive(Clone, Debug, PartialEq)]
pub enum Inadequacy {
    /// The record identifies no spring, so that no cause is reported.
    Unidentifiable(Unidentifiable),
    /// The residual holds structure that no effect of the model explains.
    Unmodelled(UnmodelledDynamics),
}

/// Structure in a residual that no effect of the model explains.
#[derive(Clone, Debug, PartialEq)]
pub struct UnmodelledDynamics {
    /// Where the structure is, in words that follow "it shows".
    pub place: String,
    /// Fraction of the tested residual's mean square that the structure explains, 0 to 1.
    pub share: f64,
    /// Root mean square of the structure, in V.
    pub rms: f64,
    /// True if the tested residual is whitened: what one reading adds to those before it.
    pub whitened: bool,
    /// True if noise alone reaches the check's statistic too often to rule it out, but the search should go on: in one of
    /// fifteen records, and in every record that is too short for the regression.
    pub doubtful: bool,
    /// True if noise alone reaches the check's statistic in at most one of ten thousand records (one of a hundred where the
    /// record is too short for the regression).
    pub significant: bool,
}

impl UnmodelledDynamics {
    /// Structure that is certain: doubtful and significant.
    pub(crate) fn certain(place: String, share: f64, rms: f64) -> Self {
        Self { place, share, rms, whitened: false, doubtful: true, significant: true }
    }

    /// Structure in a whitened residual that is certain: doubtful and significant.
    pub(crate) fn certain_in_whitened(place: String, share: f64, rms: f64) -> Self {
        Self { whitened: true, ..Self::certain(place, share, rms) }
    }
}

impl From<UnmodelledDynamics> for Inadequacy {
    fn from(found: UnmodelledDynamics) -> Self {
        Self::Unmodelled(found)
    }
}

impl From<Unidentifiable> for Inadequacy {
    fn from(reason: Unidentifiable) -> Self {
        Self::Unidentifiable(reason)
    }
}
