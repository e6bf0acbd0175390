//! Which effects: blocks are added while data that no fit has seen supports them, and removed when it does not.
//!
//! A structure's score is its held-out log-likelihood less the price of each block. The price is what a block found by
//! chance among all that were tried would gain. From each of the best structures (a beam, for a wrong first block may
//! stand in for two right ones) every effect is tried in every form; then blocks are taken out, and changed for others,
//! until nothing is better.

use std::collections::{HashMap, HashSet};

use super::effect::Scene;
use super::effects::EFFECTS;
use super::fit::{Engine, Fit, Jacobian};
use super::model::{Block, Model};
use super::noise::{Noise, Term};

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

/// What a block costs, in nats, beside its places and forms: so many are tried.
const PRICE: f64 = 4.3;
/// And each of its coordinates, beyond what held-out rows charge: a wider block must not take a narrower one's place.
const PRICE_OF_COORDINATE: f64 = 1.8;
/// Structures that are carried on.
const BEAM: usize = 3;
/// Extensions of each that are judged on held-out rows.
const JUDGED: usize = 5;
/// And as many more by their plain error, where the noise seems to have a memory.
const JUDGED_PLAIN: usize = 3;
/// Most blocks in a model.
const MOST_BLOCKS: usize = 6;
/// What a block may lose for a while, in nats, where the noise seems to have a memory.
const PATIENCE: f64 = 30.0;
/// How many times its start an effect may be, in the hope of a promise.
const FARTHEST: f64 = 6.0;
/// A fit that is likelier by so many nats than the one that was judged is judged anew.
const ANEW: f64 = 1.0;
/// An effect that promises less in all its forms, in nats, is not fitted.
const PROMISE: f64 = 2.5;

/// The search and all that it has seen.
pub struct Search<'e, 'a> {
    engine: &'e mut Engine<'a>,
    seen: HashMap<Vec<Block>, Scored>,
    /// Extensions of each structure, best first.
    extended: HashMap<Vec<Block>, Vec<Scored>>,
    /// What prices are multiplied by: noise whose memory is longer than its law can say makes chance finds look better.
    caution: f64,
}

/// What a search on a part of the rows hands on.
#[derive(Clone, Debug)]
pub struct Lead {
    /// Its best models.
    pub models: Vec<Model>,
    /// What it multiplied prices by.
    pub caution: f64,
}

/// A block that could be added, from one start.
struct Extension {
    block: Block,
    point: Vec<f64>,
    promise: f64,
}

/// What a block costs, in nats.
pub fn price(block: &Block, engine: &Engine) -> f64 {
    let effect = block.effect();
    let fitted = block.coordinates(engine.data).iter().filter(|coordinate| coordinate.fitted).count();
    PRICE + PRICE_OF_COORDINATE * fitted as f64 + effect.places(engine.data) + (effect.forms() as f64).ln()
}

impl<'e, 'a> Search<'e, 'a> {
    /// With an engine for one record.
    pub fn new(engine: &'e mut Engine<'a>) -> Self {
        Self { engine, seen: HashMap::new(), extended: HashMap::new(), caution: 1.0 }
    }

    /// The best structure; `progress` hears of each structure that becomes the best.
    pub fn run(&mut self, mut progress: impl FnMut(&Scored)) -> Scored {
        loop {
            let best = self.pass(&mut progress);
            let caution = long_memory(&self.engine.terms(&best.fit.noise, &best.fit.residual));
            if caution <= self.caution || best.fit.model.blocks.is_empty() {
                return best;
            }
            self.caution = caution;
            self.extended.clear();
            let keys: Vec<Vec<Block>> = self.seen.keys().cloned().collect();
            for key in keys {
                let score = self.seen[&key].held_out - self.prices(&self.seen[&key].fit.model);
                if let Some(scored) = self.seen.get_mut(&key) {
                    scored.score = score;
                }
            }
        }
    }

    /// The best structure when others, found on a part of the rows, are given: those are judged, and extended once more.
    pub fn from(&mut self, Lead { models, caution }: Lead, mut progress: impl FnMut(&Scored)) -> Scored {
        self.caution = caution;
        let mut best = self.root();
        for model in models {
            let scored = self.judge(model);
            if scored.score > best.score {
                best = scored;
                progress(&best);
            }
        }
        for _ in 0..MOST_BLOCKS {
            let better = self.children(&best).into_iter().next().filter(|child| child.score > best.score);
            let Some(better) = better else { break };
            best = better;
            progress(&best);
        }
        self.pruned(best)
    }

    /// The best models, for a search on more rows.
    pub fn lead(&self, count: usize) -> Lead {
        let models = self.ranked().into_iter().take(count).map(|scored| scored.fit.model.clone()).collect();
        Lead { models, caution: self.caution }
    }

    /// The simulation as it was.
    pub fn root(&mut self) -> Scored {
        self.judge(Model::default())
    }

    /// The best structure of each set of effects, the best set first.
    pub fn ranked(&self) -> Vec<&Scored> {
        let mut ranked: Vec<&Scored> = self.seen.values().collect();
        let key = |scored: &Scored| scored.fit.model.structure();
        ranked.sort_by(|a, b| b.score.total_cmp(&a.score).then_with(|| key(a).cmp(&key(b))));
        let mut sets = HashSet::new();
        ranked.retain(|scored| sets.insert(effects(&scored.fit.model)));
        ranked
    }

    /// One search at the present caution.
    fn pass(&mut self, progress: &mut impl FnMut(&Scored)) -> Scored {
        let root = self.root();
        let mut best = root.clone();
        let mut beam = vec![root];
        let mut waited = 0;
        for _ in 0..MOST_BLOCKS {
            let mut next: Vec<Scored> = Vec::new();
            for node in &beam {
                // Blocks that are only good together: while the noise seems to have a memory, one may make a loss.
                let patient = |child: &Scored| {
                    let gain = child.score - node.score;
                    gain > -PATIENCE || child.fit.plain > node.fit.plain + PATIENCE
                };
                let alone = node.fit.noise.memory.is_none();
                let children = self.children(node).into_iter();
                let children = children.filter(|child| child.score > node.score || !alone && patient(child));
                next.extend(children);
            }
            next.sort_by(|a, b| b.score.total_cmp(&a.score));
            distinct(&mut next);
            let rest = next.split_off(BEAM.min(next.len()));
            next.extend(rest.into_iter().max_by(|a, b| a.fit.plain.total_cmp(&b.fit.plain)));
            // One that makes a loss for a while would only be taken back.
            let prune = |scored: Scored| if scored.score > best.score { self.pruned(scored) } else { scored };
            let mut next: Vec<Scored> = next.into_iter().map(prune).collect();
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
                if waited > 1 || best.fit.noise.memory.is_none() {
                    break;
                }
            }
            beam = next;
        }
        self.settled(best)
    }

    /// Each block changed for every other that might do better, until none does.
    fn settled(&mut self, mut best: Scored) -> Scored {
        for _ in 0..3 {
            let before = best.score;
            for effect in effects(&best.fit.model) {
                if let Some(other) = self.best_instead_of(&best, effect)
                    && other.score > best.score
                {
                    best = self.pruned(other);
                }
            }
            if best.score <= before {
                break;
            }
        }
        best
    }

    /// The best structure with another block, or another form, in place of an effect.
    pub fn best_instead_of(&mut self, scored: &Scored, effect: usize) -> Option<Scored> {
        let model = &scored.fit.model;
        let without = self.judge(model.without(effect));
        self.children(&without).into_iter().next()
    }

    /// The structure without one of its effects, the rest fitted again.
    pub fn left_out(&mut self, scored: &Scored, effect: usize) -> Scored {
        self.judge(scored.fit.model.without(effect))
    }

    /// Each block in the form that suits the others best.
    fn reformed(&mut self, mut scored: Scored) -> Scored {
        for effect in effects(&scored.fit.model) {
            if EFFECTS[effect].forms() < 2 {
                continue;
            }
            let without = self.judge(scored.fit.model.without(effect));
            let forms = self.extensions(&without, |other| other == effect);
            for other in self.fitted(&without, forms) {
                if other.score > scored.score {
                    scored = other;
                }
            }
        }
        scored
    }

    /// The best of all judged structures that do without an effect, and without a cause that contains it.
    pub fn best_without(&self, effect: usize) -> Scored {
        let wider = EFFECTS[effect].special_case_of();
        let has = |model: &Model| {
            effects(model).into_iter().any(|other| other == effect || wider.contains(&EFFECTS[other].cause()))
        };
        let without = self.seen.values().filter(|scored| !has(&scored.fit.model));
        without.max_by(|a, b| a.score.total_cmp(&b.score)).cloned().expect("the search starts from no effect at all")
    }

    /// Removes blocks while that raises the score.
    fn pruned(&mut self, mut scored: Scored) -> Scored {
        loop {
            let shorter = effects(&scored.fit.model)
                .into_iter()
                .map(|effect| self.judge(scored.fit.model.without(effect)))
                .max_by(|a, b| a.score.total_cmp(&b.score));
            match shorter {
                Some(shorter) if shorter.score > scored.score => scored = shorter,
                _ => return scored,
            }
        }
    }

    /// The most promising extensions, fitted and judged.
    fn children(&mut self, node: &Scored) -> Vec<Scored> {
        let key = node.fit.model.structure();
        if let Some(children) = self.extended.get(&key) {
            return children.clone();
        }
        let extensions = self.extensions(node, |_| true);
        let mut children = self.fitted(node, extensions);
        children.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.extended.insert(key, children.clone());
        children
    }

    /// The best of some extensions, judged.
    fn fitted(&mut self, node: &Scored, extensions: Vec<Extension>) -> Vec<Scored> {
        let law = Noise::first_look();
        let mut fits: Vec<(f64, Fit)> = Vec::new();
        for Extension { block, point, .. } in extensions {
            let fit = self.engine.fit(node.fit.model.with(block, point), &law);
            let score = fit.log_likelihood - self.prices(&fit.model) - fit.model.points().len() as f64;
            fits.push((score, fit));
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
        let mut plain: Vec<(f64, Fit)> = rest.into_iter().filter(|(_, fit)| fit.plain > node.fit.plain).collect();
        plain.sort_by(|a, b| b.1.plain.total_cmp(&a.1.plain));
        if !node.fit.noise.memory.is_none() {
            fits.extend(plain.into_iter().take(JUDGED_PLAIN));
        }
        fits.into_iter().map(|(_, fit)| self.judge_anew(fit)).collect()
    }

    /// Blocks that might be added, the most promising first.
    fn extensions(&mut self, node: &Scored, wanted: impl Fn(usize) -> bool) -> Vec<Extension> {
        let fit = &node.fit;
        let mut metrics = vec![Metric::new(self.engine, fit, Noise::robust(&fit.residual))];
        if !fit.noise.memory.is_none() {
            metrics.push(Metric::new(self.engine, fit, fit.noise.clone()));
        }
        let sigma = super::noise::scale(&fit.residual);
        let mut found: Vec<Extension> = Vec::new();
        for (index, effect) in EFFECTS.iter().enumerate() {
            if fit.model.has(index) || contained(index, &fit.model) || !wanted(index) {
                continue;
            }
            let mut of_effect: Vec<Extension> = Vec::new();
            for form in 0..effect.forms() {
                let block = Block { effect: index, form };
                let scene = Scene { data: self.engine.data, residual: &fit.residual, sigma };
                let starts = effect.starts(form, &scene).into_iter().map(|point| {
                    let there = self.engine.residual(&fit.model.with(block, point.clone()));
                    let change: Vec<f64> = fit.residual.iter().zip(&there).map(|(a, b)| a - b).collect();
                    let promise = metrics.iter().map(|metric| metric.promise(&change)).fold(0.0, f64::max);
                    Extension { block, point, promise }
                });
                let mut starts: Vec<Extension> = starts.collect();
                starts.sort_by(|a, b| b.promise.total_cmp(&a.promise));
                // A second start where the first may be a lesser peak.
                starts.truncate(1 + usize::from(starts.len() > 4 && effect.forms() == 1));
                of_effect.extend(starts);
            }
            // A promise is a poor judge of a form: if one form is worth fitting, all are.
            if of_effect.iter().any(|extension| extension.promise > PROMISE) {
                found.extend(of_effect);
            }
        }
        found
    }

    /// As [`Search::judge`], from a point that may be better than the one that was judged.
    fn judge_anew(&mut self, fit: Fit) -> Scored {
        let seen = self.seen.get(&fit.model.structure()).cloned();
        match seen {
            Some(seen) if seen.fit.log_likelihood + ANEW < fit.log_likelihood => {
                let again = self.engine.fit_twice(fit.model);
                let again = self.judged(again);
                if seen.score > again.score {
                    self.seen.insert(seen.fit.model.structure(), seen.clone());
                    return seen;
                }
                again
            }
            _ => self.judge(fit.model),
        }
    }

    fn judge(&mut self, model: Model) -> Scored {
        let key = model.structure();
        if let Some(seen) = self.seen.get(&key) {
            return seen.clone();
        }
        let fit = self.engine.fit_twice(model);
        self.judged(fit)
    }

    fn judged(&mut self, fit: Fit) -> Scored {
        let held_out = self.engine.judged_unseen(&fit);
        let score = held_out - self.prices(&fit.model);
        let scored = Scored { fit, held_out, score };
        self.seen.insert(scored.fit.model.structure(), scored.clone());
        scored
    }

    fn prices(&self, model: &Model) -> f64 {
        self.caution * model.blocks.iter().map(|(block, _)| price(block, self.engine)).sum::<f64>()
    }
}

/// The effects of a model, in the chain's order.
pub fn effects(model: &Model) -> Vec<usize> {
    model.blocks.iter().map(|(block, _)| block.effect).collect()
}

/// True if an effect is a special case of one that is there: it could only trade with it.
fn contained(effect: usize, model: &Model) -> bool {
    let wider = EFFECTS[effect].special_case_of();
    let narrower = |other: usize| EFFECTS[other].special_case_of().contains(&EFFECTS[effect].cause());
    effects(model).into_iter().any(|other| wider.contains(&EFFECTS[other].cause()) || narrower(other))
}

/// Keeps the first structure of each set of effects.
fn distinct(scored: &mut Vec<Scored>) {
    let mut seen = HashSet::new();
    scored.retain(|scored| seen.insert(effects(&scored.fit.model)));
}

/// How much a change of the prediction could explain, when the model's own points follow.
struct Metric {
    noise: Noise,
    residual: Vec<f64>,
    /// Square roots of the rows' weights.
    roots: Vec<f64>,
    /// What the model's own points can make, orthonormal.
    own: Vec<Vec<f64>>,
}

impl Metric {
    fn new(engine: &mut Engine, fit: &Fit, noise: Noise) -> Self {
        let terms = engine.terms(&noise, &fit.residual);
        let roots: Vec<f64> = terms.iter().map(|term| term.weight.sqrt()).collect();
        let residual = terms.iter().map(|term| term.weight.sqrt() * term.residual).collect();
        let Jacobian { columns, .. } = engine.jacobian(&fit.model, &noise, &fit.residual);
        let mut own: Vec<Vec<f64>> = Vec::new();
        for column in columns {
            let mut column: Vec<f64> = column.iter().zip(&roots).map(|(value, root)| value * root).collect();
            let size = norm(&column);
            remove(&mut column, &own);
            let left = norm(&column);
            if left > 1e-6 * size {
                column.iter_mut().for_each(|value| *value /= left);
                own.push(column);
            }
        }
        Self { noise, residual, roots, own }
    }

    /// Gain in nats of the best step along `change`, as far as a straight line may be believed.
    fn promise(&self, change: &[f64]) -> f64 {
        let mut change: Vec<f64> =
            self.noise.whitened(change).iter().zip(&self.roots).map(|(value, root)| value * root).collect();
        remove(&mut change, &self.own);
        let size = dot(&change, &change);
        if size < 1e-9 {
            return 0.0;
        }
        let along = dot(&self.residual, &change);
        let step = (along / size).clamp(0.0, FARTHEST);
        let total = dot(&self.residual, &self.residual);
        let part = ((2.0 * along - step * size) * step / total.max(1e-300)).clamp(0.0, 1.0 - 1e-9);
        // The noise's scale would shrink along.
        -0.5 * self.residual.len() as f64 * (1.0 - part).ln()
    }
}

/// How much more the means of the rows' pulls over long stretches vary than independent ones would; 1 unless significant.
///
/// Where the noise's law has no memory for it (rounded readings), or too short a one, slow swings pass for a shift or a
/// drift.
fn long_memory(terms: &[Term]) -> f64 {
    let pulls: Vec<f64> = terms.iter().map(|term| term.weight * term.residual).collect();
    let variance = dot(&pulls, &pulls) / pulls.len().max(1) as f64;
    let mut most = 1.0f64;
    for parts in [5, 10, 20, 40, 80] {
        let length = pulls.len() / parts;
        if length < 5 || variance <= 0.0 {
            continue;
        }
        let squares = pulls.chunks_exact(length).map(|chunk| chunk.iter().sum::<f64>().powi(2) / length as f64);
        let ratio = squares.take(parts).sum::<f64>() / parts as f64 / variance;
        if ratio > 1.0 + 2.0 * (2.0 / parts as f64).sqrt() {
            most = most.max(ratio);
        }
    }
    most
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Takes off what lies along an orthonormal basis.
fn remove(vector: &mut [f64], basis: &[Vec<f64>]) {
    for direction in basis {
        let along = dot(vector, direction);
        vector.iter_mut().zip(direction).for_each(|(value, unit)| *value -= along * unit);
    }
}
