//! First fits of a structure's extensions: fewer and fewer of them are fitted further and further (successive halving, Jamieson
//! and Talwalkar, *AISTATS* 2016).
//!
//! | which | fit |
//! | --- | --- |
//! | every form from every start that is worth fitting | two rounds, the derivatives of the extended fit kept |
//! | of these, the best of each effect and all among the best eight | up to four more rounds of the same kind |
//! | of these, the best of each effect and all among the best four | evaluated |
//! | the best six of these | before, completed with derivatives of their own and across discontinuities |

use std::collections::HashSet;

use crate::effects::model::Block;
use crate::fit::engine::{Approach, Engine, Fit};
use crate::noise::Noise;

/// Extensions among this many best ones are fitted beyond their first rounds, and the best of each effect.
const FURTHER: usize = 8;
/// Extensions among this many best ones are evaluated, and the best of each effect.
const EVALUATED: usize = 4;
/// Number of extensions that are completed.
const COMPLETED: usize = 6;

/// A block that is added to a structure, before it is fitted.
pub(super) struct Start {
    pub(super) block: Block,
    pub(super) point: Vec<f64>,
    /// The price of the block, in nats.
    pub(super) price: f64,
}

/// An extension while it is fitted.
struct Runner {
    effect: usize,
    price: f64,
    approach: Approach,
}

/// Returns first fits of a structure's extensions under the law `law`: the best one of each effect and a few others, the best first.
pub(super) fn first_fits(engine: &mut Engine, fit: &Fit, law: &Noise, starts: Vec<Start>) -> Vec<Fit> {
    let known = engine.known(fit, law);
    let mut runners = Vec::new();
    for Start { block, point, price } in starts {
        if engine.budget().is_over() {
            break;
        }
        let approach = engine.approached(fit.model.with(block, point), law, &known);
        runners.push(Runner { effect: block.effect, price, approach });
    }
    retain_best(&mut runners, FURTHER);
    for runner in &mut runners {
        if !engine.budget().is_over() {
            engine.approach_further(&mut runner.approach, law, &known);
        }
    }
    retain_best(&mut runners, EVALUATED);
    let mut fits = Vec::new();
    for (rank, Runner { effect, approach, .. }) in runners.into_iter().enumerate() {
        if engine.budget().is_over() {
            break;
        }
        fits.push(match rank < COMPLETED {
            true => engine.completed(approach.model, law, effect),
            false => engine.evaluate(approach.model),
        });
    }
    fits
}

/// Sorts by likelihood less price, the best first, and retains the best of each effect and the `most` best ones.
fn retain_best(runners: &mut Vec<Runner>, most: usize) {
    let score = |runner: &Runner| runner.approach.log_likelihood - runner.price;
    runners.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let (mut rank, mut seen) = (0, HashSet::new());
    runners.retain(|runner| {
        rank += 1;
        seen.insert(runner.effect) || rank <= most
    });
}
