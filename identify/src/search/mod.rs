//! Which effects: blocks are added while data that no fit has seen supports them, and removed when it does not.
//!
//! A structure's score is its held-out log-likelihood less the price of each block. The price is what a block found by
//! chance among all that were tried would gain. From each of the best structures (a beam, for a wrong first block may
//! stand in for two right ones) every effect is tried in every form; then blocks are taken out, and changed for others,
//! until nothing is better.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`judge`] | what a search asks about structures, and how a record answers |
//! | `promise`, `children` | which blocks are worth fitting, and which of those worth judging |
//! | `caution` | how much dearer the noise makes them |
//! | `seen` | what was judged so far |

use std::collections::{HashMap, HashSet};

mod caution;
mod children;
pub mod judge;
mod promise;
mod seen;
#[cfg(test)]
mod tests;

pub use judge::Judge;
pub use seen::effects;

use crate::effects::EFFECTS;
use crate::effects::model::{Block, Model};
use crate::fit::engine::Fit;
use seen::Seen;

/// A structure with its fit and what it is worth.
#[derive(Clone, Debug)]
pub struct Scored {
    /// The fit to all rows.
    pub fit: Fit,
    /// Held-out log-likelihood.
    pub held_out: f64,
    /// The same less the price of the blocks, in nats.
    pub score: f64,
}

/// Sets of causes that one search hands on to another.
const LEADERS: usize = 3;
/// Structures that are carried on.
const BEAM: usize = 3;
/// Most blocks in a model.
const MOST_BLOCKS: usize = 6;
/// What a block may lose for a while, in nats, where the noise seems to have a memory.
const PATIENCE: f64 = 30.0;

/// The search and all that it has seen.
pub struct Search<'j, J> {
    judge: &'j mut J,
    seen: Seen,
    /// Extensions of each structure, best first.
    extended: HashMap<Vec<Block>, Vec<Scored>>,
    /// First fits of the extensions of a model, whatever they cost.
    first_fits: HashMap<Vec<Block>, Vec<FirstFits>>,
    /// Those are kept for another pass.
    keeps: bool,
    /// Also what the noise's memory may hide is tried; once is enough.
    patient: bool,
}

/// First fits of a model's extensions.
struct FirstFits {
    of: Model,
    /// By this effect, or by all.
    by: Option<usize>,
    fits: Vec<Fit>,
}

/// What a search hands on: one on a part of the rows, or one that took the readings otherwise.
#[derive(Clone, Debug)]
pub struct Lead {
    /// Its best models.
    pub models: Vec<Model>,
    /// What it multiplied prices by.
    pub caution: f64,
}

impl<'j, J: Judge> Search<'j, J> {
    /// Asks `judge`.
    pub fn new(judge: &'j mut J) -> Self {
        let (extended, first_fits) = (HashMap::new(), HashMap::new());
        Self { judge, seen: Seen::default(), extended, first_fits, keeps: true, patient: true }
    }

    /// Who is asked.
    pub fn judge(&mut self) -> &mut J {
        self.judge
    }

    /// The best structure; `progress` hears of each structure that becomes the best.
    pub fn run(&mut self, mut progress: impl FnMut(&Scored)) -> Scored {
        loop {
            let best = self.pass(&mut progress);
            let caution = self.judge.caution(&best.fit);
            if caution <= self.seen.caution || best.fit.model.blocks.is_empty() {
                return self.charged_anew(best, &mut progress);
            }
            self.extended.clear();
            self.seen.charge(self.judge, caution);
        }
    }

    /// The best structure when others, found on a part of the rows, are given: those are judged, and extended once more.
    pub fn from(&mut self, Lead { models, caution }: Lead, mut progress: impl FnMut(&Scored)) -> Scored {
        self.patient = false;
        // Of all rows of a long record they are many numbers.
        self.keeps = false;
        self.seen.caution = caution;
        self.root();
        for model in models {
            self.seen.judge(self.judge, model);
        }
        // All rows may show a memory of the noise that a part of them, far apart, could not.
        let caution = caution.max(self.judge.caution(&self.best().fit));
        self.seen.charge(self.judge, caution);
        let best = self.best();
        progress(&best);
        let best = self.carried_on(best, &mut progress);
        if !self.judge.doubts(&best.fit) {
            return best;
        }
        // What is too quick for the part may hide in the noise's memory.
        self.patient = true;
        self.extended.clear();
        self.carried_on(best, &mut progress)
    }

    /// The best when all is charged alike; another one than was found is carried on.
    fn charged_anew(&mut self, found: Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        self.seen.charge(self.judge, self.seen.caution);
        let best = self.best();
        if best.fit.model.structure() == found.fit.model.structure() {
            return best;
        }
        progress(&best);
        self.extended.clear();
        self.carried_on(best, progress)
    }

    /// The structure with one block more while that raises the score, and with none too many.
    fn carried_on(&mut self, mut best: Scored, progress: &mut impl FnMut(&Scored)) -> Scored {
        for _ in 0..MOST_BLOCKS {
            let better = self.children(&best).into_iter().next().filter(|child| child.score > best.score);
            let Some(better) = better else { break };
            best = better;
            progress(&best);
        }
        self.pruned(best)
    }

    /// The best models, for a search on more rows.
    pub fn lead(&self) -> Lead {
        let models = self.ranked().into_iter().take(LEADERS).map(|scored| scored.fit.model.clone()).collect();
        Lead { models, caution: self.seen.caution }
    }

    /// The simulation as it was.
    pub fn root(&mut self) -> Scored {
        self.seen.judge(self.judge, Model::default())
    }

    /// The structure without one of its effects, the rest fitted again.
    pub fn left_out(&mut self, scored: &Scored, effect: usize) -> Scored {
        self.seen.judge_from(self.judge, scored.fit.model.without(effect))
    }

    /// The best structure that was judged.
    fn best(&self) -> Scored {
        let ranked = self.ranked();
        (*ranked.first().expect("the search starts from no effect at all")).clone()
    }

    /// The best structure of each set of effects, the best set first.
    pub fn ranked(&self) -> Vec<&Scored> {
        self.seen.ranked()
    }

    /// The best of all judged structures that do without an effect, and without a cause that contains it.
    pub fn best_without(&self, effect: usize) -> Scored {
        self.seen.best_without(effect).expect("the search starts from no effect at all")
    }

    /// One search at the present caution.
    fn pass(&mut self, progress: &mut impl FnMut(&Scored)) -> Scored {
        let root = self.root();
        let mut best = root.clone();
        let mut beam = vec![root];
        let mut waited = 0;
        for _ in 0..MOST_BLOCKS {
            // What leaves nothing but noise is extended, and no other: none can be much likelier.
            let doubts = self.judge.doubts(&best.fit);
            if !doubts {
                beam = vec![best.clone()];
            }
            let mut next = self.next(&beam);
            // One that makes a loss for a while would only be taken back.
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
        self.settled(best)
    }

    /// The best structures with one block more than those of a beam, and the one of the least plain error.
    fn next(&mut self, beam: &[Scored]) -> Vec<Scored> {
        let mut next: Vec<Scored> = Vec::new();
        for node in beam {
            // Blocks that are only good together: while the noise seems to have a memory, one may make a loss.
            let patient = |child: &Scored| {
                let gain = child.score - node.score;
                gain > -PATIENCE
                    || child.fit.white_noise_log_likelihood > node.fit.white_noise_log_likelihood + PATIENCE
            };
            let alone = node.fit.noise.autocorrelation.is_white();
            let children = self.children(node).into_iter();
            next.extend(children.filter(|child| child.score > node.score || !alone && patient(child)));
        }
        next.sort_by(|a, b| b.score.total_cmp(&a.score));
        distinct(&mut next);
        let rest = next.split_off(BEAM.min(next.len()));
        next.extend(
            rest.into_iter()
                .max_by(|a, b| a.fit.white_noise_log_likelihood.total_cmp(&b.fit.white_noise_log_likelihood)),
        );
        next
    }

    /// Each block changed for every other that might do better, until none does.
    fn settled(&mut self, mut best: Scored) -> Scored {
        for _ in 0..3 {
            let before = best.score;
            for effect in effects(&best.fit.model) {
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

    /// The best with another effect in the place of one, where the rest stays as it suits them both: without either it may
    /// suit neither.
    fn exchanged(&mut self, scored: &Scored, effect: usize) -> Option<Scored> {
        let rest = scored.fit.model.without(effect);
        if rest.blocks.is_empty() {
            return None;
        }
        let node = self.judge.at(rest);
        let first_fits = self.first_fits(&node, None);
        self.judged(&node, first_fits).into_iter().max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// Each block in the form that suits the others best as they are, from the start that does: what was found first may be
    /// where it stood in for them.
    fn reformed(&mut self, mut scored: Scored) -> Scored {
        let alone = scored.fit.model.blocks.len() == 1;
        for effect in effects(&scored.fit.model) {
            if alone && EFFECTS[effect].forms() < 2 {
                continue;
            }
            let rest = self.judge.at(scored.fit.model.without(effect));
            let first_fits = self.first_fits(&rest, Some(effect));
            for other in self.judged(&rest, first_fits) {
                if other.score > scored.score {
                    scored = other;
                }
            }
        }
        scored
    }

    /// Removes blocks while that raises the score.
    fn pruned(&mut self, mut scored: Scored) -> Scored {
        loop {
            let effects = effects(&scored.fit.model).into_iter();
            let shorter = effects.map(|effect| self.left_out(&scored, effect));
            match shorter.max_by(|a, b| a.score.total_cmp(&b.score)) {
                Some(shorter) if shorter.score > scored.score => scored = shorter,
                _ => return scored,
            }
        }
    }
}

/// Keeps the first structure of each set of effects.
fn distinct(scored: &mut Vec<Scored>) {
    let mut seen = HashSet::new();
    scored.retain(|scored| seen.insert(effects(&scored.fit.model)));
}
