//! The best sets of causes compared by score and by held-out error.

use crate::effects::EFFECTS;
use crate::effects::effect::Quantity;
use crate::effects::model::{Block, Model};
use crate::fit::engine::{Engine, Fit};
use crate::record::data::Data;
use crate::search::{Evaluator, Scored, Search, effects};
use crate::stats::scale::root_mean_square;

/// A set of causes in its best forms, with its score and errors.
#[derive(Clone, Debug, PartialEq)]
pub struct RankedCauses {
    /// Names of the causes, in the order of the chain; empty for the simulation as it is given.
    pub causes: Vec<&'static str>,
    /// Parameters of the fit to all rows in the user's units, as `name = value unit, ...`.
    pub values: String,
    /// Held-out log-likelihood less the price of the blocks, in nats.
    pub score: f64,
    /// Root mean square error on the rows that it was fitted to, in the reading's unit.
    pub rmse: f64,
    /// Root mean square error on held-out segments, in the reading's unit.
    pub held_out_rmse: f64,
}

/// Number of sets that are listed for their score alone.
const LISTED_BY_SCORE: usize = 8;

/// Structures to rank: the best sets of causes, the best without each cause of the best set, and the simulation as it is given.
pub(crate) fn contenders<E: Evaluator>(search: &Search<E>, best: &Scored) -> Vec<Scored> {
    let without: Vec<_> =
        effects(&best.fit.model).into_iter().map(|effect| search.best_without(effect).fit.model.structure()).collect();
    let kept = |(place, scored): &(usize, &Scored)| {
        let structure = scored.fit.model.structure();
        *place < LISTED_BY_SCORE || structure.is_empty() || without.contains(&structure)
    };
    search.ranked().into_iter().enumerate().filter(kept).map(|(_, scored)| scored.clone()).collect()
}

/// Ranks structures, in the given order. `known` holds fits whose residual on held-out segments was computed before.
pub(crate) fn ranking(engine: &mut Engine, contenders: &[Scored], known: [(&Fit, &[f64]); 2]) -> Vec<RankedCauses> {
    let data = engine.data;
    let mut held_out_rmse = |fit: &Fit| match known.iter().find(|(other, _)| other.model == fit.model) {
        Some((_, held_out)) => root_mean_square(held_out),
        None => root_mean_square(&engine.held_out_residual(fit)),
    };
    let ranked = |scored: &Scored| RankedCauses {
        causes: effects(&scored.fit.model).into_iter().map(|effect| EFFECTS[effect].cause()).collect(),
        values: values(data, &scored.fit.model),
        score: scored.score,
        rmse: root_mean_square(&scored.fit.residual),
        held_out_rmse: held_out_rmse(&scored.fit),
    };
    contenders.iter().map(ranked).collect()
}

/// Parameters of all blocks in the user's units, as `name = value unit, ...`.
fn values(data: &Data, model: &Model) -> String {
    let of_block = |(block, point): &(Block, Vec<f64>)| block.effect().quantities(block.form, point, data);
    let quantities = model.blocks.iter().flat_map(of_block);
    let said = |Quantity { name, dimension, value }| format!("{name} = {}", data.scales().shown(dimension, value, 4));
    quantities.map(said).collect::<Vec<_>>().join(", ")
}
