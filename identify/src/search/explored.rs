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

impl Explored {
    /// The structures with the same effects as `best` in other forms, with scores at most `nats` below its score.
    pub fn other_forms(&self, best: &Scored, nats: f64) -> Vec<&Scored> {
        self.evaluated.other_forms(best, nats)
    }
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

    /// The best structure with an effect among those that were evaluated; `None` if none has it.
    pub fn best_with(&self, effect: usize) -> Option<Scored> {
        self.ranked().into_iter().find(|scored| scored.fit.model.has(effect)).cloned()
    }

    /// Evaluates `best` extended by an effect, from one start, unless it was evaluated before or the two cannot be identified together.
    pub fn evaluate_extension(&mut self, best: &Scored, effect: usize) {
        let mut set = effects(&best.fit.model);
        set.push(effect);
        set.sort_unstable();
        let known = self.ranked().iter().any(|scored| effects(&scored.fit.model) == set);
        if known || contained(effect, &best.fit.model) {
            return;
        }
        let kept = self.first_fits.get(&best.fit.model.structure()).into_iter().flatten();
        let of_best = kept.filter(|kept| kept.by.is_none() && kept.of == best.fit.model).flat_map(|kept| &kept.fits);
        let with_effect = of_best.filter(|fit| fit.model.has(effect));
        let likeliest = with_effect.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).cloned();
        if let Some(first) = likeliest.or_else(|| self.evaluator.extended_by(&best.fit, effect)) {
            self.evaluated.evaluate_again(self.evaluator, first);
        }
    }
}
