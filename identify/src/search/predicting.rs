//! The choice between the structures that a search ends with by what they predict.

use crate::fit::engine::Fit;
use crate::search::evaluator::Evaluator;
use crate::search::scored::{Scored, effects};
use crate::search::structure_search::Search;

/// Structures of each number of causes that are compared where the likeliest does not predict: the likeliest of all numbers may all
/// contain the cause that does not.
const COMPARED_OF_EACH: usize = 2;

impl<E: Evaluator> Search<'_, E> {
    /// The structure `best` if its `held_out` error is at most that of the simulation as it is given, else the one of the likeliest that
    /// predicts best: a search that was cut may end with causes that do not predict. None whose error `is_larger` than allowed.
    pub fn predicting(
        &mut self,
        best: Scored,
        is_larger: impl Fn(&Fit) -> bool,
        held_out: impl Fn(&mut E, &Fit) -> f64,
    ) -> Scored {
        let root = self.root();
        let known = held_out(self.evaluator(), &root.fit);
        if !is_larger(&best.fit) && held_out(self.evaluator(), &best.fit) <= known {
            return best;
        }
        let mut ranked = self.ranked();
        ranked.retain(|other| !is_larger(&other.fit));
        ranked.sort_by_key(|other| effects(&other.fit.model).len());
        let of_each = ranked.chunk_by(|a, b| effects(&a.fit.model).len() == effects(&b.fit.model).len());
        let likeliest: Vec<Scored> =
            of_each.flat_map(|sets| sets.iter().take(COMPARED_OF_EACH)).map(|set| (*set).clone()).collect();
        let compared = likeliest.into_iter().map(|other| (held_out(self.evaluator(), &other.fit), other));
        let least = compared.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(error, _)| *error < known);
        least.map_or(root, |(_, other)| other)
    }
}
