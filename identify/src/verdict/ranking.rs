//! The best sets of causes compared by score and by held-out error: the one source of what is the best without a cause, for the
//! page and for the sentence on its evidence.

use crate::effects::EFFECTS;
use crate::effects::effect::Quantity;
use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::plant::base::Base;
use crate::record::data::Data;
use crate::record::observed::Observed;
use crate::search::{Evaluator, Scored, Search, effects};
use crate::verdict::cause::Cause;

/// A set of causes in its best forms, with its score and errors.
#[derive(Clone, Debug, PartialEq)]
pub struct RankedCauses {
    /// Names of the causes, in the order of the chain; empty for the simulation as it is given.
    pub causes: Vec<&'static str>,
    /// Findings of which it is the best explanation without them.
    pub best_without: Vec<&'static str>,
    /// Parameters of the fit to all rows in the user's units, as `name = value unit, ...`; with the gain of a cause that has one
    /// of its own.
    pub values: String,
    /// Held-out log-likelihood less the price of the blocks, in nats.
    pub score: f64,
    /// Root mean square error on the rows that it was fitted to, in the reading's unit; outliers are left out.
    pub rmse: f64,
    /// Root mean square error on held-out segments, in the reading's unit; outliers are left out.
    pub held_out_rmse: f64,
}

/// Number of sets that are listed for their score alone.
const LISTED_BY_SCORE: usize = 8;

/// Structures to rank: the best sets of causes, the best without each cause that was found, and the simulation as it is given.
pub(crate) fn contenders<E: Evaluator>(search: &Search<E>, causes: &[Cause]) -> Vec<Scored> {
    let kept = |(place, scored): &(usize, &Scored)| {
        *place < LISTED_BY_SCORE
            || scored.fit.model.blocks.is_empty()
            || causes.iter().any(|cause| is_same(&cause.without, scored))
    };
    search.ranked().into_iter().enumerate().filter(kept).map(|(_, scored)| scored.clone()).collect()
}

fn is_same(a: &Scored, b: &Scored) -> bool {
    a.fit.model.structure() == b.fit.model.structure()
}

/// Ranks the contenders of a search that found `causes`, by their errors of the `regular` readings. `known` holds fits whose residual on
/// held-out segments was computed before.
pub(crate) fn ranking(
    engine: &mut Engine,
    contenders: &[Scored],
    causes: &[Cause],
    regular: &Observed,
    known: [(&Fit, &[f64]); 2],
) -> Vec<RankedCauses> {
    let (data, base) = (engine.data, engine.base());
    let mut ranked = |scored: &Scored| {
        let held_out_rmse = match known.iter().find(|(other, _)| other.model == scored.fit.model) {
            Some((_, held_out)) => regular.rms(held_out),
            None => regular.rms(&engine.held_out_residual(&scored.fit)),
        };
        let without = causes.iter().filter(|cause| is_same(&cause.without, scored));
        RankedCauses {
            causes: effects(&scored.fit.model).into_iter().map(|effect| EFFECTS[effect].cause()).collect(),
            best_without: without.map(|cause| EFFECTS[cause.effect].cause()).collect(),
            values: values(data, base, &scored.fit.model),
            score: scored.score,
            rmse: regular.rms(&scored.fit.residual),
            held_out_rmse,
        }
    };
    contenders.iter().map(&mut ranked).collect()
}

/// The causes of a model joined by "and".
pub(crate) fn named(model: &Model) -> String {
    model.blocks.iter().map(|(block, _)| block.cause()).collect::<Vec<_>>().join(" and ")
}

/// Parameters of all blocks in the user's units, as `name = value unit, ...`.
fn values(data: &Data, base: &Base, model: &Model) -> String {
    let of_block = |index| model.reported(index, base, data).into_iter().map(|reported| reported.quantity);
    let quantities = (0..model.blocks.len()).flat_map(of_block);
    let said =
        |Quantity { name, dimension, value, .. }| format!("{name} = {}", data.scales().shown(dimension, value, 4));
    quantities.map(said).collect::<Vec<_>>().join(", ")
}
