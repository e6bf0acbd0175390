//! A structure with its fit and its score.

use crate::effects::model::Model;
use crate::fit::engine::Fit;

/// A structure with its fit and its score.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The fit to all rows.
    pub fit: Fit,
    /// Held-out log-likelihood, in nats.
    pub held_out: f64,
    /// Held-out log-likelihood less the price of the blocks, in nats.
    pub score: f64,
}

/// Indices of a model's effects in [`EFFECTS`](crate::effects::EFFECTS), ascending.
pub fn effects(model: &Model) -> Vec<usize> {
    model.blocks.iter().map(|(block, _)| block.effect).collect()
}
