//! Sets of blocks that explain a residual only together: of all pairs and triples of blocks, those whose changes of the prediction,
//! linearised, explain most of it under independent noise (best subset regression).
//!
//! Causes may hide each other: a gain that is too large and a second relaxation that is slow remove each other's error, so that none of
//! three causes explains much by itself, nor a pair of them. One inner product for each pair of changes is enough to compare all sets.

use std::collections::HashMap;

use crate::effects::effect::FitContext;
use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, contains};
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::search::predicted_gain::GainPredictor;
use crate::stats::scale::robust_scale;
use crate::stats::sums::dot;

/// Cosine of two changes of one effect above which they are taken for the same.
const ALIKE: f64 = 0.97;
/// Largest number of changes of one effect, those kept that explain most.
const OF_EFFECT: usize = 12;
/// Squared sine below which a change is a combination of others.
const DEPENDENT: f64 = 1e-4;
/// Work of the prediction of a change, of an inner product and of a set, each in units of one piece of the voltage through one lag: for
/// each row, for four rows, for each set.
const PREDICTION: u64 = 5;
const ROWS_OF_PRODUCT: u64 = 4;
const SET: u64 = 10;

/// A block at a start with the change that it makes.
struct Change {
    block: Block,
    point: Vec<f64>,
    price: f64,
    /// Unit vector of the whitened change.
    direction: Vec<f64>,
    /// The residual along it.
    along: f64,
}

/// The best blocks of each set of effects: what they promise less their prices, in nats, and their places among the changes.
type BestOfEffects = HashMap<Vec<usize>, (f64, Vec<usize>)>;

/// Returns the models that extend a fit by a pair or a triple of blocks, of effects that are `wanted`: the `most` pairs and the `most`
/// triples that promise most after their blocks' prices, in nats, one for each set of effects.
pub(super) fn joint_extensions(
    engine: &mut Engine,
    fit: &Fit,
    wanted: &dyn Fn(usize) -> bool,
    price: fn(&Engine, &Block) -> f64,
    most: usize,
) -> Vec<Model> {
    let (changes, total) = changes(engine, fit, wanted, price);
    let rows = fit.residual.len();
    let count = changes.len();
    engine.budget().spend((count * count / 2 * rows) as u64 / ROWS_OF_PRODUCT);
    let products: Vec<Vec<f64>> = (0..count)
        .map(|one| (0..count).map(|other| dot(&changes[one].direction, &changes[other].direction)).collect())
        .collect();
    let apart = |one: usize, other: usize| {
        let (one, other) = (changes[one].block.effect, changes[other].block.effect);
        one != other && !contains(one, other) && !contains(other, one)
    };
    let mut sets: [BestOfEffects; 2] = [HashMap::new(), HashMap::new()];
    let mut note = |places: &[usize], explained: f64| {
        let price: f64 = places.iter().map(|&place| changes[place].price).sum();
        let part = (explained / total.max(1e-300)).clamp(0.0, 1.0 - 1e-9);
        let worth = -0.5 * rows as f64 * (1.0 - part).ln() - price;
        let mut effects: Vec<usize> = places.iter().map(|&place| changes[place].block.effect).collect();
        effects.sort_unstable();
        let best = sets[places.len() - 2].entry(effects).or_insert((f64::NEG_INFINITY, Vec::new()));
        if worth > best.0 {
            *best = (worth, places.to_vec());
        }
    };
    let mut compared = 0;
    for one in 0..count {
        for two in (one + 1)..count {
            if !apart(one, two) {
                continue;
            }
            let cosine = products[one][two];
            let squared_sine = 1.0 - cosine * cosine;
            if squared_sine < DEPENDENT {
                continue;
            }
            let (a, b) = (changes[one].along, changes[two].along);
            let (of_one, of_two) = ((a - cosine * b) / squared_sine, (b - cosine * a) / squared_sine);
            compared += (count - two) as u64;
            if of_one > 0.0 && of_two > 0.0 {
                note(&[one, two], of_one * a + of_two * b);
            }
            for three in (two + 1)..count {
                if !apart(one, three) || !apart(two, three) {
                    continue;
                }
                let (p, q, c) = (products[one][three], products[two][three], changes[three].along);
                // The part of the third that the first two cannot make.
                let (on_one, on_two) = ((p - cosine * q) / squared_sine, (q - cosine * p) / squared_sine);
                let left = 1.0 - on_one * p - on_two * q;
                if left < DEPENDENT {
                    continue;
                }
                let of_three = (c - on_one * a - on_two * b) / left;
                let (with_one, with_two) = (of_one - of_three * on_one, of_two - of_three * on_two);
                if with_one > 0.0 && with_two > 0.0 && of_three > 0.0 {
                    note(&[one, two, three], with_one * a + with_two * b + of_three * c);
                }
            }
        }
    }
    engine.budget().spend(SET * compared);
    let mut models = Vec::new();
    for of_size in sets {
        let mut best: Vec<(f64, Vec<usize>)> = of_size.into_values().collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
        let extended = |places: Vec<usize>| {
            let add = |model: Model, place: usize| model.with(changes[place].block, changes[place].point.clone());
            places.into_iter().fold(fit.model.clone(), add)
        };
        models.extend(best.into_iter().take(most).map(|(_, places)| extended(places)));
    }
    models
}

/// The changes that blocks make at their starts, without those that are alike, and the sum of squares of the whitened residual.
fn changes(
    engine: &mut Engine,
    fit: &Fit,
    wanted: &dyn Fn(usize) -> bool,
    price: fn(&Engine, &Block) -> f64,
) -> (Vec<Change>, f64) {
    let known = engine.observed.known(&fit.residual);
    let predictor = GainPredictor::new(engine, fit, Noise::robust(&known));
    let from_rest = engine.residual_from_rest(&fit.model);
    let residual = engine.observed.outside(&fit.residual);
    let sigma = robust_scale(&engine.observed.known(&fit.residual));
    let mut all = Vec::new();
    for (effect, of) in EFFECTS.iter().enumerate().filter(|(effect, _)| wanted(*effect)) {
        if !engine.allows(of.cause()) {
            continue;
        }
        let mut found: Vec<Change> = Vec::new();
        for form in 0..of.common_forms() {
            let block = Block { effect, form };
            let price = price(engine, &block);
            let points = of.initial_points(form, &FitContext { data: engine.data, residual: &residual, sigma });
            for point in points {
                if engine.budget().is_over() {
                    return (Vec::new(), 1.0);
                }
                let there = engine.residual_from_rest(&fit.model.with(block, point.clone()));
                engine.budget().spend(PREDICTION * there.len() as u64);
                let change: Vec<f64> = from_rest.iter().zip(&there).map(|(a, b)| a - b).collect();
                let Some((direction, along)) = predictor.direction(&change) else { continue };
                if found.iter().all(|other| dot(&other.direction, &direction) < ALIKE) {
                    found.push(Change { block, point, price, direction, along });
                }
            }
        }
        found.sort_by(|a, b| b.along.total_cmp(&a.along));
        found.truncate(OF_EFFECT);
        all.extend(found);
    }
    (all, predictor.total())
}
