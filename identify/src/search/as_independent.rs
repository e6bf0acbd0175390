//! A further search as if the noise were independent, where the first one ends with structure in its residual.
//!
//! While several causes are missing, an autoregression follows their errors so closely that one more of them gains little, less than its
//! price, or that another cause, which suits the autoregression, takes its place: each of three causes may be found beside the other
//! two, and none beside none. Under independent noise each gains what it removes of the squared error. The search starts from pairs and
//! triples of blocks, as causes also hide each other, adds blocks, and takes out what others replace. What it comes across is scored like
//! any other structure.

use std::collections::{HashMap, HashSet};

use crate::effects::EFFECTS;
use crate::effects::model::Model;
use crate::fit::engine::Fit;
use crate::search::evaluator::Evaluator;
use crate::search::extend::contained;
use crate::search::scored::{Scored, effects};
use crate::search::structure_search::{MOST_BLOCKS, Search};

/// One part of this many of the work that is left is for these structures. The rest is for the report, and for the equation of a record that
/// no cause explains.
const PART_OF_WORK: u64 = 3;
/// Structures that are extended at a time.
const BEAM: usize = 3;
/// Pairs and triples of blocks that are fitted, of each.
const JOINT: usize = 5;

/// A fit and its log-likelihood under independent noise less the price of its blocks, in nats.
type Worth = (f64, Fit);

impl<E: Evaluator> Search<'_, E> {
    /// The best structure after a search as if the noise were independent, if `best` leaves structure that the noise's autocorrelation
    /// follows; with the work that is left.
    pub(super) fn as_independent(&mut self, best: Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        let follows = !best.fit.noise.autocorrelation.is_white();
        if !follows || self.evaluator.is_over() || !self.evaluator.leaves_structure(&best.fit) {
            return best;
        }
        let before = self.evaluated.clone();
        let left = self.evaluator.work_left();
        let least_left = left - left / PART_OF_WORK;
        // Prices that are higher because structure is left would let no structure explain it.
        self.evaluated.reprice(self.evaluator, 1.0);
        let Some(adequate) = self.adequate_as_independent(&best, least_left) else {
            self.evaluated = before;
            return best;
        };
        // Its own factor is that of the noise.
        let penalty_factor = self.evaluator.penalty_factor(&adequate.fit).min(before.penalty_factor);
        self.evaluated.reprice(self.evaluator, penalty_factor);
        let found = self.best_or(&best);
        if found.fit.model.structure() == best.fit.model.structure() {
            self.evaluated = before;
            return best;
        }
        progress(&found);
        self.extended.clear();
        let found = self.reformed(found);
        let found = self.pruned(found);
        self.settled(found)
    }

    /// Evaluates the structures that are likeliest under independent noise, of each number of blocks; returns the first that leaves
    /// nothing but noise, after which the search ends; it also ends once no more than some work is left.
    fn adequate_as_independent(&mut self, best: &Scored, least_left: u64) -> Option<Scored> {
        let start = self.start().fit;
        let found = self.evaluator.fit_as_independent(best.fit.clone());
        let mut pool = self.joint(&start);
        if found.model.structure() != start.model.structure() {
            pool.extend(self.joint(&found));
            pool.push((self.worth(&found), found));
        }
        pool.push((self.worth(&start), start));
        // The largest worth of each number of blocks.
        let mut known: HashMap<usize, f64> = HashMap::new();
        let mut largest = f64::NEG_INFINITY;
        for _ in 0..MOST_BLOCKS {
            let mut beam = self.best_of(pool);
            if let Some(first) = beam.first_mut() {
                *first = self.in_other_forms(first.clone());
                *first = self.with_less(first.clone(), &known);
            }
            let before = largest;
            beam.retain(|(worth, _)| *worth > before);
            for (worth, fit) in &beam {
                if self.evaluator.work_left() <= least_left {
                    return None;
                }
                let of_size = known.entry(fit.model.blocks.len()).or_insert(f64::NEG_INFINITY);
                *of_size = of_size.max(*worth);
                largest = largest.max(*worth);
                let scored = self.evaluated.evaluate_again(self.evaluator, fit.clone());
                if scored.score > f64::NEG_INFINITY && !self.evaluator.leaves_structure(&scored.fit) {
                    return Some(scored);
                }
            }
            if beam.is_empty() {
                return None;
            }
            pool = Vec::new();
            for (_, node) in beam {
                if self.evaluator.work_left() <= least_left {
                    return None;
                }
                let fits = self.first_fits(&node, None);
                pool.extend(fits.into_iter().map(|fit| (self.worth(&fit), fit)));
            }
            let firsts = self.best_of(pool);
            pool = firsts.into_iter().map(|(_, first)| self.fitted(first)).collect();
        }
        None
    }

    /// A first fit, fitted under independent noise.
    fn fitted(&mut self, first: Fit) -> Worth {
        let fit = self.evaluator.fit_as_independent(first);
        (self.worth(&fit), fit)
    }

    /// The structure with each block in the form that suits the others best.
    fn in_other_forms(&mut self, mut fit: Worth) -> Worth {
        for effect in effects(&fit.1.model) {
            if EFFECTS[effect].forms() < 2 || self.evaluator.is_over() {
                continue;
            }
            let rest = self.evaluator.at(fit.1.model.without(effect));
            let firsts = self.first_fits(&rest, Some(effect));
            let best = firsts.into_iter().map(|first| (self.worth(&first), first)).max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, first)) = best.filter(|best| best.1.model.structure() != fit.1.model.structure()) else {
                continue;
            };
            let other = self.fitted(first);
            if other.0 > fit.0 {
                fit = other;
            }
        }
        fit
    }

    /// Fits of a structure extended by pairs and triples of blocks.
    fn joint(&mut self, of: &Fit) -> Vec<Worth> {
        let model = &of.model;
        let models = self.evaluator.joint(of, &|effect| !model.has(effect) && !contained(effect, model), JOINT);
        let mut found = Vec::new();
        for model in models {
            if self.evaluator.is_over() {
                break;
            }
            let first = self.evaluator.at(model);
            found.push(self.fitted(first));
        }
        found
    }

    /// The best of some fits, each with another set of effects.
    fn best_of(&self, mut pool: Vec<Worth>) -> Vec<Worth> {
        pool.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut sets = HashSet::new();
        pool.retain(|(_, fit)| sets.insert(effects(&fit.model)));
        pool.truncate(if self.evaluator.is_scarce() { 1 } else { BEAM });
        pool
    }

    /// The structure without the blocks that others replace: as long as it is then better than all that are `known` with as many.
    fn with_less(&mut self, mut fit: Worth, known: &HashMap<usize, f64>) -> Worth {
        while fit.1.model.blocks.len() > 1 && !self.evaluator.is_over() {
            let models: Vec<Model> = effects(&fit.1.model).into_iter().map(|of| fit.1.model.without(of)).collect();
            let without = models.into_iter().map(|model| {
                let first = self.evaluator.at(model);
                self.fitted(first)
            });
            let Some(best) = without.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            let least = known.get(&best.1.model.blocks.len()).copied().unwrap_or(fit.0);
            if best.0 <= least.min(fit.0) {
                break;
            }
            fit = best;
        }
        fit
    }

    /// Log-likelihood of a fit under independent noise less the price of its blocks, in nats.
    fn worth(&self, fit: &Fit) -> f64 {
        fit.white_noise_log_likelihood - self.evaluated.price(self.evaluator, fit)
    }
}
