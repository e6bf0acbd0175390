//! An effect of the best structure with the structures that lack it.

use crate::search::Scored;

/// An effect of the best structure.
pub(crate) struct Cause {
    /// Index of the effect.
    pub(crate) effect: usize,
    /// The best of all structures without the effect.
    pub(crate) without: Scored,
    /// Odds against that one, in nats.
    pub(crate) odds: f64,
    /// The best structure with the effect removed and nothing in its place.
    pub(crate) left_out: Scored,
}
