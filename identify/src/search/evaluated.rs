//! All structures that were evaluated so far, and the prices of their blocks.

use std::collections::{HashMap, HashSet};

use crate::effects::contains;
use crate::effects::effect::Location;
use crate::effects::model::{Block, Model};
use crate::fit::engine::Fit;
use crate::search::evaluator::Evaluator;
use crate::search::scored::{Scored, effects};
use crate::stats::thresholds::empirical::{NATS_TO_EVALUATE_AGAIN, SAME_STAGE};

/// Structures with their scores, under one penalty factor.
#[derive(Clone, Debug)]
pub(super) struct Evaluated {
    scored: HashMap<Vec<Block>, Scored>,
    /// Factor by which prices are multiplied, 1 or more.
    pub(super) penalty_factor: f64,
    /// Smallest noise floor of all evaluated fits, in V, with which the misfit of form is compared in every structure.
    floor_v: f64,
}

impl Default for Evaluated {
    fn default() -> Self {
        Self { scored: HashMap::new(), penalty_factor: 1.0, floor_v: f64::INFINITY }
    }
}

impl Evaluated {
    /// Price of a fit's blocks, in nats.
    pub(super) fn price(&self, evaluator: &impl Evaluator, fit: &Fit) -> f64 {
        let blocks = &fit.model.blocks;
        let further = blocks.len().saturating_sub(1) as f64;
        let stages: HashSet<Location> = blocks.iter().map(|(block, point)| evaluator.location(block, point)).collect();
        let times = further + SAME_STAGE.get() * (blocks.len() - stages.len()) as f64;
        let misfit = if times > 0.0 { evaluator.misfit(fit, times, self.floor_v) } else { 0.0 };
        misfit + self.penalty_factor * blocks.iter().map(|(block, _)| evaluator.price(block)).sum::<f64>()
    }

    /// Score of a fit whose held-out log-likelihood is known, in nats; minus infinity if one of its blocks is another cause.
    fn score(&self, evaluator: &impl Evaluator, fit: &Fit, held_out: f64) -> f64 {
        let sigma_v = fit.noise.sigma;
        if fit.model.blocks.iter().any(|(block, point)| evaluator.is_another_cause(block, point, sigma_v)) {
            return f64::NEG_INFINITY;
        }
        held_out - self.price(evaluator, fit)
    }

    /// Recomputes all scores with a penalty factor and with the present noise floor, which the first evaluations lacked.
    pub(super) fn reprice(&mut self, evaluator: &impl Evaluator, penalty_factor: f64) {
        self.penalty_factor = penalty_factor;
        let mut scored = std::mem::take(&mut self.scored);
        scored.values_mut().for_each(|it| it.score = self.score(evaluator, &it.fit, it.held_out));
        self.scored = scored;
    }

    /// Returns a structure with its score; fits it unless it was evaluated before.
    pub(super) fn evaluate(&mut self, evaluator: &mut impl Evaluator, model: Model) -> Scored {
        if let Some(known) = self.scored.get(&model.structure()) {
            return known.clone();
        }
        let fit = evaluator.fit(model);
        self.scored(evaluator, fit)
    }

    /// Returns a structure with its score; fits it again if the model's own point is likelier than the evaluated fit, as it may
    /// be after the other blocks were fitted.
    pub(super) fn evaluate_from(&mut self, evaluator: &mut impl Evaluator, model: Model) -> Scored {
        if !self.scored.contains_key(&model.structure()) {
            return self.evaluate(evaluator, model);
        }
        let here = evaluator.at(model);
        self.evaluate_again(evaluator, here)
    }

    /// Returns a structure with its score; fits it again from `first` if that is likelier than the evaluated fit.
    pub(super) fn evaluate_again(&mut self, evaluator: &mut impl Evaluator, first: Fit) -> Scored {
        match self.scored.get(&first.model.structure()).cloned() {
            Some(known) if known.fit.log_likelihood + NATS_TO_EVALUATE_AGAIN.get() < first.log_likelihood => {
                let fit = evaluator.refit(first);
                let again = self.scored(evaluator, fit);
                if known.score > again.score {
                    self.scored.insert(known.fit.model.structure(), known.clone());
                    return known;
                }
                again
            }
            Some(known) => known,
            None => {
                let fit = evaluator.refit(first);
                self.scored(evaluator, fit)
            }
        }
    }

    /// Scores a fit and stores it under its structure.
    fn scored(&mut self, evaluator: &mut impl Evaluator, fit: Fit) -> Scored {
        let held_out = evaluator.held_out(&fit);
        self.floor_v = self.floor_v.min(fit.noise.floor_v());
        let score = self.score(evaluator, &fit, held_out);
        let scored = Scored { fit, held_out, score };
        self.scored.insert(scored.fit.model.structure(), scored.clone());
        scored
    }

    /// The best structure of each set of effects, the best set first.
    pub(super) fn ranked(&self) -> Vec<&Scored> {
        let mut ranked: Vec<&Scored> = self.scored.values().filter(|scored| scored.score.is_finite()).collect();
        let key = |scored: &Scored| scored.fit.model.structure();
        ranked.sort_by(|a, b| b.score.total_cmp(&a.score).then_with(|| key(a).cmp(&key(b))));
        let mut sets = HashSet::new();
        ranked.retain(|scored| sets.insert(effects(&scored.fit.model)));
        ranked
    }

    /// The structures with the same effects as `best` in other forms, with scores at most `nats` below its score.
    pub(super) fn other_forms(&self, best: &Scored, nats: f64) -> Vec<&Scored> {
        let (structure, set) = (best.fit.model.structure(), effects(&best.fit.model));
        let is_other_form = |other: &&Scored| {
            let model = &other.fit.model;
            other.score > best.score - nats && model.structure() != structure && effects(model) == set
        };
        let mut others: Vec<&Scored> = self.scored.values().filter(is_other_form).collect();
        others.sort_by_key(|other| other.fit.model.structure());
        others
    }

    /// The score by which a structure is compared with another explanation, in nats: without the price of what may belong to the nominal
    /// spring beyond its price there.
    pub(super) fn compared(&self, evaluator: &impl Evaluator, scored: &Scored) -> f64 {
        let blocks = scored.fit.model.blocks.iter();
        scored.score + self.penalty_factor * blocks.map(|(block, _)| evaluator.excess_price(block)).sum::<f64>()
    }

    /// The best of all structures, as they are compared, without an effect and without every effect that contains it as a special case.
    pub(super) fn best_without(&self, evaluator: &impl Evaluator, effect: usize) -> Option<Scored> {
        let has = |model: &Model| effects(model).into_iter().any(|other| other == effect || contains(other, effect));
        let without = self.scored.values().filter(|scored| scored.score.is_finite() && !has(&scored.fit.model));
        let compared = |scored: &Scored| self.compared(evaluator, scored);
        without.max_by(|a, b| compared(a).total_cmp(&compared(b))).cloned()
    }
}
