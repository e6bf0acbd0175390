//! What may follow a structure: the most promising of those with one block more.

use std::collections::HashMap;

use crate::effects::contains;
use crate::effects::model::Model;
use crate::fit::engine::Fit;
use crate::search::{FirstFits, Judge, Scored, Search, effects};

/// What an extension may be behind its node at first, in nats, to be judged at all; for the patient, anything.
const HOPELESS: f64 = 10.0;
/// Extensions that are judged on held-out rows.
const JUDGED: usize = 5;
/// And as many more by their plain error, where the noise seems to have a memory.
const JUDGED_PLAIN: usize = 3;

impl<J: Judge> Search<'_, J> {
    /// The most promising extensions, fitted and judged, the best first.
    pub(super) fn children(&mut self, node: &Scored) -> Vec<Scored> {
        let key = node.fit.model.structure();
        if let Some(children) = self.extended.get(&key) {
            return children.clone();
        }
        let first_fits = self.first_fits(&node.fit, None);
        let mut children = self.judged(&node.fit, first_fits);
        children.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.extended.insert(key, children.clone());
        children
    }

    /// First fits of all extensions, or of those by one effect. Another pass, which charges other prices, finds the same.
    pub(super) fn first_fits(&mut self, node: &Fit, wanted: Option<usize>) -> Vec<Fit> {
        let model = &node.model;
        let mut kept = self.first_fits.get(&model.structure()).into_iter().flatten();
        if let Some(kept) = kept.find(|kept| kept.of == *model && kept.by == wanted) {
            return kept.fits.clone();
        }
        let new =
            |effect| wanted.is_none_or(|wanted| wanted == effect) && !model.has(effect) && !contained(effect, model);
        let fits = self.judge.extended(node, self.patient, &new);
        if self.keeps {
            self.first_fits.entry(model.structure()).or_default().push(FirstFits {
                of: model.clone(),
                by: wanted,
                fits: fits.clone(),
            });
        }
        fits
    }

    /// The best of first fits, judged.
    pub(super) fn judged(&mut self, node: &Fit, first_fits: Vec<Fit>) -> Vec<Scored> {
        let first_score =
            |fit: &Fit| fit.log_likelihood - self.seen.price(self.judge, fit) - fit.model.points().len() as f64;
        let mut fits: Vec<(f64, Fit)> = first_fits.into_iter().map(|fit| (first_score(&fit), fit)).collect();
        if !self.patient {
            let lost = first_score(node) - HOPELESS;
            fits.retain(|(score, _)| *score > lost);
        }
        fits.sort_by(|a, b| b.0.total_cmp(&a.0));
        fits.dedup_by_key(|(_, fit)| fit.model.structure());
        // The best two forms of a cause, so that no cause takes all places.
        let mut taken: HashMap<Vec<usize>, usize> = HashMap::new();
        fits.retain(|(_, fit)| {
            let count = taken.entry(effects(&fit.model)).or_default();
            *count += 1;
            *count <= 2
        });
        // What a memory of the noise hides while much is still wrong shows in the plain error.
        let rest = fits.split_off(JUDGED.min(fits.len()));
        let mut plain: Vec<(f64, Fit)> = rest
            .into_iter()
            .filter(|(_, fit)| fit.white_noise_log_likelihood > node.white_noise_log_likelihood)
            .collect();
        plain.sort_by(|a, b| b.1.white_noise_log_likelihood.total_cmp(&a.1.white_noise_log_likelihood));
        if self.patient && !node.noise.autocorrelation.is_white() {
            fits.extend(plain.into_iter().take(JUDGED_PLAIN));
        }
        fits.into_iter().map(|(_, fit)| self.seen.judge_anew(self.judge, fit)).collect()
    }
}

/// True if an effect is a special case of one that is there: it could only trade with it.
fn contained(effect: usize, model: &Model) -> bool {
    effects(model).into_iter().any(|other| contains(other, effect) || contains(effect, other))
}
