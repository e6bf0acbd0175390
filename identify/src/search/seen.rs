//! Every structure that was judged, and what it is worth.

use std::collections::{HashMap, HashSet};

use crate::effects::contains;
use crate::effects::effect::Location;
use crate::effects::model::{Block, Model};
use crate::fit::engine::Fit;
use crate::search::Scored;
use crate::search::judge::Judge;

/// A block in the same stage as another may mend the other's form rather than be one more cause: so many times what it leaves
/// is charged beside.
const ALIKE: f64 = 15.0;
/// A fit that is likelier by so many nats than the one that was judged is judged anew.
const ANEW: f64 = 1.0;

/// Structures with their scores, under one caution.
#[derive(Debug)]
pub(super) struct Seen {
    scored: HashMap<Vec<Block>, Scored>,
    /// What prices are multiplied by: noise whose memory is longer than its law can say makes chance finds look better.
    pub(super) caution: f64,
    /// The least that any structure has left, in V: what a misfit has to show against, whoever is charged for it.
    floor_v: f64,
}

impl Default for Seen {
    fn default() -> Self {
        Self { scored: HashMap::new(), caution: 1.0, floor_v: f64::INFINITY }
    }
}

impl Seen {
    /// What a fit's blocks cost, in nats.
    pub(super) fn price(&self, judge: &impl Judge, fit: &Fit) -> f64 {
        let blocks = &fit.model.blocks;
        let further = blocks.len().saturating_sub(1) as f64;
        let stages: HashSet<Location> = blocks.iter().map(|(block, _)| block.effect().location()).collect();
        let times = further + ALIKE * (blocks.len() - stages.len()) as f64;
        let misfit = if times > 0.0 { judge.misfit(fit, times, self.floor_v) } else { 0.0 };
        misfit + self.caution * blocks.iter().map(|(block, _)| judge.price(block)).sum::<f64>()
    }

    /// Charges everything anew: what was judged first did not know the floor.
    pub(super) fn charge(&mut self, judge: &impl Judge, caution: f64) {
        self.caution = caution;
        let mut scored = std::mem::take(&mut self.scored);
        scored.values_mut().for_each(|it| it.score = it.held_out - self.price(judge, &it.fit));
        self.scored = scored;
    }

    /// A structure's score; it is fitted the first time that it is asked for.
    pub(super) fn judge(&mut self, judge: &mut impl Judge, model: Model) -> Scored {
        if let Some(seen) = self.scored.get(&model.structure()) {
            return seen.clone();
        }
        let fit = judge.fit(model);
        self.scored(judge, fit)
    }

    /// The same, from a point that may be better than the one that was judged: the other blocks were fitted since.
    pub(super) fn judge_from(&mut self, judge: &mut impl Judge, model: Model) -> Scored {
        if !self.scored.contains_key(&model.structure()) {
            return self.judge(judge, model);
        }
        let here = judge.at(model);
        self.judge_anew(judge, here)
    }

    /// The same, from a first fit that may be better than the one that was judged.
    pub(super) fn judge_anew(&mut self, judge: &mut impl Judge, first: Fit) -> Scored {
        match self.scored.get(&first.model.structure()).cloned() {
            Some(seen) if seen.fit.log_likelihood + ANEW < first.log_likelihood => {
                let fit = judge.fit_again(first);
                let again = self.scored(judge, fit);
                if seen.score > again.score {
                    self.scored.insert(seen.fit.model.structure(), seen.clone());
                    return seen;
                }
                again
            }
            Some(seen) => seen,
            None => {
                let fit = judge.fit_again(first);
                self.scored(judge, fit)
            }
        }
    }

    fn scored(&mut self, judge: &mut impl Judge, fit: Fit) -> Scored {
        let held_out = judge.held_out(&fit);
        self.floor_v = self.floor_v.min(fit.noise.floor_v());
        let score = held_out - self.price(judge, &fit);
        let scored = Scored { fit, held_out, score };
        self.scored.insert(scored.fit.model.structure(), scored.clone());
        scored
    }

    /// The best structure of each set of effects, the best set first.
    pub(super) fn ranked(&self) -> Vec<&Scored> {
        let mut ranked: Vec<&Scored> = self.scored.values().collect();
        let key = |scored: &Scored| scored.fit.model.structure();
        ranked.sort_by(|a, b| b.score.total_cmp(&a.score).then_with(|| key(a).cmp(&key(b))));
        let mut sets = HashSet::new();
        ranked.retain(|scored| sets.insert(effects(&scored.fit.model)));
        ranked
    }

    /// The best of all structures that do without an effect, and without a cause that contains it.
    pub(super) fn best_without(&self, effect: usize) -> Option<Scored> {
        let has = |model: &Model| effects(model).into_iter().any(|other| other == effect || contains(other, effect));
        let without = self.scored.values().filter(|scored| !has(&scored.fit.model));
        without.max_by(|a, b| a.score.total_cmp(&b.score)).cloned()
    }
}

/// The effects of a model, in the chain's order.
pub fn effects(model: &Model) -> Vec<usize> {
    model.blocks.iter().map(|(block, _)| block.effect).collect()
}
