//! What a search has evaluated, kept for questions of the report: how close a set of causes with an effect comes to the best.

use std::collections::HashMap;

use crate::effects::model::Block;
use crate::search::evaluated::Evaluated;
use crate::search::evaluator::Evaluator;
use crate::search::extend::contained;
use crate::search::scored::{Scored, effects};
use crate::search::structure_search::{FirstFits, Search};

/// The structures of a finished search, with their fits.
#[derive(Default)]
pub struct Explored {
    evaluated: Evaluated,
    first_fits: HashMap<Vec<Block>, Vec<FirstFits>>,
}

impl<'e, E: Evaluator> Search<'e, E> {
    /// Ends the search and returns what it has evaluated.
    pub fn into_explored(self) -> Explored {
        Explored { evaluated: self.evaluated, first_fits: self.first_fits }
    }

    /// Continues with what an earlier search of the same record has evaluated, with the same prices; not exhaustive.
    pub fn resumed(evaluator: &'e mut E, explored: Explored) -> Self {
        let Explored { evaluated, first_fits } = explored;
        Self { evaluated, first_fits, exhaustive: false, ..Self::new(evaluator) }
    }

    /// The best structure with an effect that `best` lacks: of those that were evaluated, and of `best` extended by it, which is
    /// fitted from one start if no search has done so. `None` if the effect cannot be identified together with `best`, or if
    /// nothing was fitted.
    pub fn nearest(&mut self, best: &Scored, effect: usize) -> Option<Scored> {
        if contained(effect, &best.fit.model) {
            return None;
        }
        let mut set = effects(&best.fit.model);
        set.push(effect);
        set.sort_unstable();
        let known = self.ranked().iter().any(|other| effects(&other.fit.model) == set);
        if !known && !self.evaluator.is_over() {
            let added = |fits: &FirstFits| fits.by.is_none() && fits.of == best.fit.model;
            let kept =
                self.first_fits.get(&best.fit.model.structure()).into_iter().flatten().filter(|fits| added(fits));
            let kept = kept.flat_map(|fits| &fits.fits).filter(|fit| fit.model.has(effect));
            let likeliest = kept.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).cloned();
            if let Some(first) = likeliest.or_else(|| self.evaluator.extended_by(&best.fit, effect)) {
                self.evaluated.evaluate_again(self.evaluator, first);
            }
        }
        self.ranked().into_iter().find(|other| other.fit.model.has(effect)).cloned()
    }
}
