//! The extensions of a structure: which of those with one block more are fitted, and which of these are evaluated.

use std::collections::HashMap;

use crate::effects::contains;
use crate::effects::model::Model;
use crate::fit::engine::Fit;
use crate::search::evaluator::{Breadth, Evaluator, Forms};
use crate::search::scored::{Scored, effects};
use crate::search::structure_search::{FirstFits, Search};
use crate::stats::thresholds::empirical::NATS_TO_LOSE_AT_FIRST;

/// Extensions that are evaluated on held-out rows.
const EVALUATED: usize = 5;
/// Further extensions that are evaluated, by their likelihood under independent noise, where the noise is autocorrelated.
const EVALUATED_AS_INDEPENDENT: usize = 3;
/// Forms of one set of effects that are evaluated, so that no effect takes all places.
const FORMS: usize = 2;

impl<E: Evaluator> Search<'_, E> {
    /// The evaluated extensions of a structure, the best first.
    pub(super) fn children(&mut self, node: &Scored) -> Vec<Scored> {
        let key = node.fit.model.structure();
        if let Some(children) = self.extended.get(&key) {
            return children.clone();
        }
        let first_fits = self.first_fits(&node.fit, None);
        let mut children = self.evaluated_best(&node.fit, first_fits);
        children.sort_by(|a, b| b.score.total_cmp(&a.score));
        if self.evaluator.is_over() {
            return children;
        }
        self.extended.insert(key, children.clone());
        children
    }

    /// First fits of all extensions, or of those by the effect `wanted`.
    pub(super) fn first_fits(&mut self, node: &Fit, wanted: Option<usize>) -> Vec<Fit> {
        let mut fits = self.first_fits_of(Forms::Common, node, wanted);
        if self.tries_rare_forms {
            fits.extend(self.first_fits_of(Forms::Rare, node, wanted));
        }
        fits
    }

    /// First fits of all extensions in some forms, or of those by the effect `wanted`; kept for the next pass, which
    /// differs in prices, or tries further forms, only.
    fn first_fits_of(&mut self, forms: Forms, node: &Fit, wanted: Option<usize>) -> Vec<Fit> {
        let model = &node.model;
        let mut kept = self.first_fits.get(&model.structure()).into_iter().flatten();
        if let Some(kept) = kept.find(|kept| kept.of == *model && kept.by == wanted && kept.forms == forms) {
            return kept.fits.clone();
        }
        let new =
            |effect| wanted.is_none_or(|wanted| wanted == effect) && !model.has(effect) && !contained(effect, model);
        let fits = self.evaluator.extended(node, Breadth { exhaustive: self.exhaustive, forms }, &new);
        if self.keeps_first_fits {
            self.first_fits.entry(model.structure()).or_default().push(FirstFits {
                of: model.clone(),
                by: wanted,
                forms,
                fits: fits.clone(),
            });
        }
        fits
    }

    /// Evaluates the best of the first fits.
    pub(super) fn evaluated_best(&mut self, node: &Fit, first_fits: Vec<Fit>) -> Vec<Scored> {
        let first_score = |fit: &Fit| {
            fit.log_likelihood - self.evaluated.price(self.evaluator, fit) - fit.model.points().len() as f64
        };
        let mut fits: Vec<(f64, Fit)> = first_fits.into_iter().map(|fit| (first_score(&fit), fit)).collect();
        if !self.exhaustive {
            let lost = first_score(node) - NATS_TO_LOSE_AT_FIRST.get();
            fits.retain(|(score, _)| *score > lost);
        }
        fits.sort_by(|a, b| b.0.total_cmp(&a.0));
        fits.dedup_by_key(|(_, fit)| fit.model.structure());
        let mut taken: HashMap<Vec<usize>, usize> = HashMap::new();
        fits.retain(|(_, fit)| {
            let count = taken.entry(effects(&fit.model)).or_default();
            *count += 1;
            *count <= FORMS
        });
        // While large errors remain, autocorrelation hides effects that independent noise shows.
        let (evaluated, as_independent) = match self.evaluator.is_scarce() {
            true => (EVALUATED.div_ceil(2), EVALUATED_AS_INDEPENDENT.div_ceil(2)),
            false => (EVALUATED, EVALUATED_AS_INDEPENDENT),
        };
        let rest = fits.split_off(evaluated.min(fits.len()));
        let mut plain: Vec<(f64, Fit)> = rest
            .into_iter()
            .filter(|(_, fit)| fit.white_noise_log_likelihood > node.white_noise_log_likelihood)
            .collect();
        plain.sort_by(|a, b| b.1.white_noise_log_likelihood.total_cmp(&a.1.white_noise_log_likelihood));
        if self.exhaustive && !node.noise.autocorrelation.is_white() {
            fits.extend(plain.into_iter().take(as_independent));
        }
        let mut evaluated = Vec::new();
        for (_, fit) in fits {
            if self.evaluator.is_over() {
                break;
            }
            evaluated.push(self.evaluated.evaluate_again(self.evaluator, fit));
        }
        evaluated
    }
}

/// True if an effect is a special case of one in the model, or contains one: the two would not be identifiable together.
pub(super) fn contained(effect: usize, model: &Model) -> bool {
    effects(model).into_iter().any(|other| contains(other, effect) || contains(effect, other))
}
