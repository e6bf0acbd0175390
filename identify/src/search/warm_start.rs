//! What one search passes to another.

use crate::effects::model::Model;

/// The result of a search on a part of the rows, or under another reading of them, from which another search starts.
#[derive(Clone, Debug)]
pub struct WarmStart {
    /// Best models of the search, the best first.
    pub models: Vec<Model>,
    /// Factor by which the search multiplied prices, 1 or more.
    pub penalty_factor: f64,
}
