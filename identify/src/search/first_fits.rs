//! First fits of a structure's extensions: fewer and fewer of them are fitted further and further (successive halving, Jamieson
//! and Talwalkar, *AISTATS* 2016).
//!
//! | which | fit |
//! | --- | --- |
//! | every form from every start that is worth fitting | two rounds, the derivatives of the extended fit kept |
//! | the best of each effect, and those among the best eight | further rounds of the same kind |
//! | the best six of these and of what is left of each effect | a fit with derivatives of its own, across discontinuities |
//! | the others | evaluated where they are |

use std::collections::HashSet;

use crate::effects::model::Block;
use crate::fit::engine::{Approach, Engine, Fit};
use crate::noise::Noise;
use crate::search::evaluator::Evaluator;

/// Extensions that are fitted beyond their first rounds, in addition to the best of each effect.
const FURTHER: usize = 8;
/// Extensions that are evaluated in addition to the best of each effect.
const EVALUATED: usize = 4;
/// Extensions that are completed, the best.
const COMPLETED: usize = 6;

/// An extension while it is fitted.
struct Runner {
    effect: usize,
    price: f64,
    approach: Approach,
}

/// Returns first fits of a structure's extensions by a block from a point each, under the law `law`: the best one of each effect and
/// a few others, the best first.
pub(super) fn first_fits(
    engine: &mut Engine,
    fit: &Fit,
    law: &Noise,
    extensions: impl Iterator<Item = (Block, Vec<f64>)>,
) -> Vec<Fit> {
    let known = engine.known(fit, law);
    let mut runners = Vec::new();
    for (block, point) in extensions {
        if engine.is_over() {
            break;
        }
        let approach = engine.approached(fit.model.with(block, point), law, &known);
        runners.push(Runner { effect: block.effect, price: engine.price(&block), approach });
    }
    retain_best(&mut runners, FURTHER);
    for runner in &mut runners {
        if !engine.is_over() {
            engine.approach_further(&mut runner.approach, law, &known);
        }
    }
    retain_best(&mut runners, EVALUATED);
    let mut fits = Vec::new();
    for (rank, Runner { effect, approach, .. }) in runners.into_iter().enumerate() {
        if engine.is_over() {
            break;
        }
        fits.push(match rank < COMPLETED {
            true => engine.completed(approach.model, law, effect),
            false => engine.evaluate(approach.model),
        });
    }
    fits
}

/// Sorts by likelihood less price, the best first, and retains the best of each effect and those with a rank up to `rank`.
fn retain_best(runners: &mut Vec<Runner>, rank: usize) {
    let score = |runner: &Runner| runner.approach.log_likelihood - runner.price;
    runners.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let (mut ranks, mut seen) = (1.., HashSet::new());
    runners.retain(|runner| {
        let is_among_best = ranks.next().is_some_and(|of| of <= rank);
        seen.insert(runner.effect) || is_among_best
    });
}
