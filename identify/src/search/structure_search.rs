//! The search for the structure with the largest score.

use std::collections::{HashMap, HashSet};

use crate::effects::EFFECTS;
use crate::effects::model::{Block, Model};
use crate::fit::engine::Fit;
use crate::search::evaluated::Evaluated;
use crate::search::evaluator::{Evaluator, Forms};
use crate::search::scored::{Scored, effects};
use crate::search::warm_start::WarmStart;
use crate::stats::thresholds::empirical::NATS_TO_LOSE_IN_BEAM;

/// Models in a warm start.
const MODELS_IN_WARM_START: usize = 3;
/// Structures in the beam.
const BEAM: usize = 3;
/// Largest number of blocks in a model.
pub(super) const MOST_BLOCKS: usize = 6;
/// Rounds in which each block is exchanged for every other.
const EXCHANGES: usize = 3;

/// A search, with all that it has evaluated.
pub struct Search<'e, E> {
    pub(super) evaluator: &'e mut E,
    pub(super) evaluated: Evaluated,
    /// Evaluated extensions of each structure, the best first.
    pub(super) extended: HashMap<Vec<Block>, Vec<Scored>>,
    /// First fits of the extensions of a structure, whatever their price.
    pub(super) first_fits: HashMap<Vec<Block>, Vec<FirstFits>>,
    /// True if first fits are kept for another pass.
    pub(super) keeps_first_fits: bool,
    /// True if effects are tried, too, that the noise's autocorrelation may hide.
    pub(super) exhaustive: bool,
    /// True if the forms that are seldom needed are tried as well.
    pub(super) tries_rare_forms: bool,
}

/// First fits of a model's extensions.
pub(super) struct FirstFits {
    /// The model that is extended, with its parameters.
    pub(super) of: Model,
    /// The effect that is added, or `None` for all.
    pub(super) by: Option<usize>,
    /// The forms of it.
    pub(super) forms: Forms,
    /// The fits.
    pub(super) fits: Vec<Fit>,
}

impl<'e, E: Evaluator> Search<'e, E> {
    /// An exhaustive search that asks `evaluator`.
    pub fn new(evaluator: &'e mut E) -> Self {
        let (extended, first_fits) = (HashMap::new(), HashMap::new());
        Self {
            evaluator,
            evaluated: Evaluated::default(),
            extended,
            first_fits,
            keeps_first_fits: true,
            exhaustive: true,
            tries_rare_forms: false,
        }
    }

    /// The evaluator that the search asks.
    pub fn evaluator(&mut self) -> &mut E {
        self.evaluator
    }

    /// Searches from the simulation as it is given and returns the best structure; `progress` receives each structure that
    /// becomes the best. A search whose work ends before it has found all of what it was finding goes on with more, from the beginning, with
    /// what it has evaluated.
    pub fn run(&mut self, mut progress: impl FnMut(&Scored)) -> Scored {
        let best = self.run_once(&mut progress);
        if !self.evaluator.leaves_structure(&best.fit) || !self.evaluator.go_on(&best.fit) {
            return best;
        }
        self.extended.clear();
        self.evaluated.reprice(self.evaluator, 1.0);
        self.run_once(progress)
    }

    /// Searches from the simulation as it is given, with the work that was granted, and returns the best structure.
    pub fn run_once(&mut self, mut progress: impl FnMut(&Scored)) -> Scored {
        self.evaluator.reserve_for_rare_forms();
        for model in self.evaluator.late_models() {
            self.evaluated.evaluate_from(self.evaluator, model);
        }
        loop {
            let best = self.pass(&mut progress);
            let penalty_factor = self.evaluator.penalty_factor(&best.fit);
            if penalty_factor <= self.evaluated.penalty_factor
                || best.fit.model.blocks.is_empty()
                || self.evaluator.is_over()
            {
                self.evaluated.penalty_factor = penalty_factor.max(self.evaluated.penalty_factor);
                let best = self.repriced(&best, &mut progress);
                let best = self.with_rare_forms(best, &mut progress);
                return self.as_independent(best, &mut progress);
            }
            self.extended.clear();
            self.evaluated.reprice(self.evaluator, penalty_factor);
        }
    }

    /// Searches again with the forms that are seldom needed as well, one structure at a time, with the work that was kept for them; for a
    /// structure that leaves something, or for several effects, whose common forms may stand in for a rare one. A structure that leaves
    /// nothing but noise is replaced by a simpler one only; what was found remains its rival.
    fn with_rare_forms(&mut self, best: Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        let leaves_structure = self.evaluator.leaves_structure(&best.fit);
        let blocks = best.fit.model.blocks.len();
        if !leaves_structure && blocks < 2 {
            return best;
        }
        self.evaluator.begin_rare_forms();
        self.try_rare_forms(true);
        let other = self.beam_search(1, &mut |_| ());
        self.try_rare_forms(false);
        if other.score <= best.score || !leaves_structure && other.fit.model.blocks.len() >= blocks {
            return best;
        }
        progress(&other);
        let best = self.settled(other);
        self.extended_greedily(best, progress)
    }

    /// Extends structures by the forms that are seldom needed as well from here on, or by the common ones alone.
    fn try_rare_forms(&mut self, tries: bool) {
        self.tries_rare_forms = tries;
        self.extended.clear();
    }

    /// Searches from the models of a warm start, which are evaluated and then extended, and returns the best structure.
    pub fn run_from(
        &mut self,
        WarmStart { models, penalty_factor }: WarmStart,
        mut progress: impl FnMut(&Scored),
    ) -> Scored {
        self.exhaustive = false;
        // On all rows of a long record they would take much memory.
        self.keeps_first_fits = false;
        self.evaluated.penalty_factor = penalty_factor;
        let root = self.root();
        for (place, model) in models.into_iter().enumerate() {
            if place > 0 && self.evaluator.is_over() {
                break;
            }
            self.evaluated.evaluate(self.evaluator, model);
        }
        // All rows may show autocorrelation that a part of them, far apart, could not.
        let penalty_factor = penalty_factor.max(self.evaluator.penalty_factor(&self.best_or(&root).fit));
        self.evaluated.reprice(self.evaluator, penalty_factor);
        let best = self.best_or(&root);
        progress(&best);
        let best = self.extended_greedily(best, &mut progress);
        if self.evaluator.is_over() || !self.evaluator.doubts(&best.fit) {
            return best;
        }
        // An effect too quick for a part of the rows may be hidden by the noise's autocorrelation.
        self.exhaustive = true;
        self.extended.clear();
        self.extended_greedily(best, &mut progress)
    }

    /// The best structure after all were priced with the same noise floor; extended further unless it is the one found before.
    fn repriced(&mut self, found: &Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        self.evaluated.reprice(self.evaluator, self.evaluated.penalty_factor);
        let best = self.best_or(found);
        if best.fit.model.structure() == found.fit.model.structure() {
            return best;
        }
        progress(&best);
        self.extended.clear();
        self.extended_greedily(best, progress)
    }

    /// Adds the best block while that raises the score, then removes blocks while that does.
    fn extended_greedily(&mut self, mut best: Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        for _ in 0..MOST_BLOCKS {
            if self.evaluator.is_over() {
                return best;
            }
            let better = self.children(&best).into_iter().next().filter(|child| child.score > best.score);
            let Some(better) = better else { break };
            best = better;
            progress(&best);
        }
        self.pruned(best)
    }

    /// The best models, for another search.
    pub fn warm_start(&self) -> WarmStart {
        let models =
            self.ranked().into_iter().take(MODELS_IN_WARM_START).map(|scored| scored.fit.model.clone()).collect();
        WarmStart { models, penalty_factor: self.evaluated.penalty_factor }
    }

    /// The simulation as it is given, without any block.
    pub fn root(&mut self) -> Scored {
        let simulation = self.evaluator.simulation();
        self.evaluated.evaluate(self.evaluator, simulation)
    }

    /// The best of the simulation as it is given and of the evaluator's initial models.
    pub(super) fn start(&mut self) -> Scored {
        let root = self.root();
        let models = self.evaluator.initial_models();
        let others: Vec<Scored> =
            models.into_iter().map(|model| self.evaluated.evaluate_from(self.evaluator, model)).collect();
        others.into_iter().fold(root, |best, other| if other.score > best.score { other } else { best })
    }

    /// The structure without one of its effects, the other blocks fitted again.
    pub fn left_out(&mut self, scored: &Scored, effect: usize) -> Scored {
        self.evaluated.evaluate_from(self.evaluator, scored.fit.model.without(effect))
    }

    /// The best structure that was evaluated; `other` if none has a finite score.
    pub(super) fn best_or(&self, other: &Scored) -> Scored {
        (*self.ranked().first().unwrap_or(&other)).clone()
    }

    /// The best structure of each set of effects, the best set first.
    pub fn ranked(&self) -> Vec<&Scored> {
        self.evaluated.ranked()
    }

    /// The score by which a structure is compared with another explanation of the same readings, in nats.
    pub fn compared(&self, scored: &Scored) -> f64 {
        self.evaluated.compared(self.evaluator, scored)
    }

    /// The best structure of each set of effects whose compared score is less than `nats` below that of another, the best set first.
    pub fn near(&self, scored: &Scored, nats: f64) -> Vec<&Scored> {
        let least = self.compared(scored) - nats;
        let compared = self.ranked().into_iter().map(|other| (self.compared(other), other));
        let mut near: Vec<(f64, &Scored)> = compared.filter(|(score, _)| *score > least).collect();
        near.sort_by(|a, b| b.0.total_cmp(&a.0));
        near.into_iter().map(|(_, other)| other).collect()
    }

    /// The best of all evaluated structures, as they are compared, without an effect and without every effect that contains it as a special
    /// case.
    pub fn best_without(&self, effect: usize) -> Scored {
        self.evaluated.best_without(self.evaluator, effect).expect("the search starts from no effect at all")
    }

    /// One search at the present penalty factor.
    fn pass(&mut self, progress: &mut impl FnMut(&Scored)) -> Scored {
        let best = self.beam_search(BEAM, progress);
        self.settled(best)
    }

    /// Extends the `width` best structures, and the likeliest of the others under independent noise, as long as that may raise the score.
    fn beam_search(&mut self, width: usize, progress: &mut impl FnMut(&Scored)) -> Scored {
        let mut best = self.start();
        let mut beam = vec![best.clone()];
        let mut waited = 0;
        for _ in 0..MOST_BLOCKS {
            if self.evaluator.is_over() {
                break;
            }
            // A structure that leaves nothing but noise is the only one that is extended: no other can be much likelier.
            let doubts = self.evaluator.doubts(&best.fit);
            if !doubts {
                if !best.fit.model.blocks.is_empty() {
                    self.evaluator.found_adequate();
                }
                // What is left of scarce work is for exchanges, which find a simpler block than the first that fits.
                if self.evaluator.is_scarce() && !best.fit.model.blocks.is_empty() {
                    break;
                }
                beam = vec![best.clone()];
            }
            let mut next = self.next(&beam, width);
            // Structures that may lose score for a while are left as they are: pruning would only undo them.
            next = next.into_iter().map(|it| if it.score > best.score { self.pruned(it) } else { it }).collect();
            if let Some(first) = next.first().cloned()
                && first.score > best.score
            {
                next[0] = self.reformed(first);
            }
            distinct(&mut next);
            let Some(first) = next.iter().max_by(|a, b| a.score.total_cmp(&b.score)) else { break };
            if first.score > best.score {
                best = first.clone();
                waited = 0;
                progress(&best);
            } else {
                waited += 1;
                if waited > 1 || best.fit.noise.autocorrelation.is_white() || !doubts {
                    break;
                }
            }
            beam = next;
        }
        best
    }

    /// The next beam: the `width` best structures with one block more, and the likeliest of the others under independent noise.
    fn next(&mut self, beam: &[Scored], width: usize) -> Vec<Scored> {
        let mut next: Vec<Scored> = Vec::new();
        for node in beam {
            if self.evaluator.is_over() {
                break;
            }
            // Two blocks may gain only together, so that the first may lose score while the noise is autocorrelated.
            let may_lose = |child: &Scored| {
                let gain = child.score - node.score;
                gain > -NATS_TO_LOSE_IN_BEAM.get()
                    || child.fit.white_noise_log_likelihood
                        > node.fit.white_noise_log_likelihood + NATS_TO_LOSE_IN_BEAM.get()
            };
            let independent = node.fit.noise.autocorrelation.is_white();
            let children = self.children(node).into_iter();
            next.extend(children.filter(|child| child.score > node.score || !independent && may_lose(child)));
        }
        next.sort_by(|a, b| b.score.total_cmp(&a.score));
        distinct(&mut next);
        let width = if self.evaluator.is_scarce() { 1 } else { width };
        let rest = next.split_off(width.min(next.len()));
        next.extend(
            rest.into_iter()
                .max_by(|a, b| a.fit.white_noise_log_likelihood.total_cmp(&b.fit.white_noise_log_likelihood)),
        );
        next
    }

    /// Exchanges each block for every other while that raises the score.
    pub(super) fn settled(&mut self, mut best: Scored) -> Scored {
        for _ in 0..EXCHANGES {
            let before = best.score;
            for effect in effects(&best.fit.model) {
                if self.evaluator.is_over() {
                    return best;
                }
                let without = self.left_out(&best, effect);
                let children = self.children(&without).into_iter().next();
                let other = self.exchanged(&best, effect).into_iter().chain(children);
                let other = other.max_by(|a, b| a.score.total_cmp(&b.score));
                if let Some(other) = other.filter(|other| other.score > best.score) {
                    best = self.pruned(other);
                }
            }
            if best.score <= before {
                break;
            }
        }
        best
    }

    /// The best structure with another effect in place of `effect`, the other blocks kept at their parameters: fitted without
    /// either, they may suit neither.
    fn exchanged(&mut self, scored: &Scored, effect: usize) -> Option<Scored> {
        let rest = scored.fit.model.without(effect);
        if rest.blocks.is_empty() {
            return None;
        }
        let node = self.evaluator.at(rest);
        let first_fits = self.first_fits(&node, None);
        self.evaluated_best(&node, first_fits).into_iter().max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// Fits each block again in every form and from every start, the others kept at their parameters: the form and the start
    /// that were found first may have stood in for a block that was found later.
    pub(super) fn reformed(&mut self, mut scored: Scored) -> Scored {
        let alone = scored.fit.model.blocks.len() == 1;
        for effect in effects(&scored.fit.model) {
            if alone && EFFECTS[effect].forms() < 2 || self.evaluator.is_over() {
                continue;
            }
            let rest = self.evaluator.at(scored.fit.model.without(effect));
            let first_fits = self.first_fits(&rest, Some(effect));
            for other in self.evaluated_best(&rest, first_fits) {
                if other.score > scored.score {
                    scored = other;
                }
            }
        }
        scored
    }

    /// Removes blocks, or replaces them by simpler ones, while that raises the score.
    pub(super) fn pruned(&mut self, mut scored: Scored) -> Scored {
        loop {
            if self.evaluator.is_over() {
                return scored;
            }
            let without = effects(&scored.fit.model).into_iter().map(|effect| scored.fit.model.without(effect));
            let models: Vec<Model> = without.chain(self.evaluator.simpler(&scored.fit.model)).collect();
            let shorter = models.into_iter().map(|model| self.evaluated.evaluate_from(self.evaluator, model));
            match shorter.max_by(|a, b| a.score.total_cmp(&b.score)) {
                Some(shorter) if shorter.score > scored.score => scored = shorter,
                _ => return scored,
            }
        }
    }
}

/// Keeps the first structure of each set of effects.
fn distinct(scored: &mut Vec<Scored>) {
    let mut known = HashSet::new();
    scored.retain(|scored| known.insert(effects(&scored.fit.model)));
}
