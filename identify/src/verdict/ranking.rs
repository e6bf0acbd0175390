//! How the best sets of causes stand beside each other: what they score, and what they foretell.

use crate::effects::EFFECTS;
use crate::effects::effect::Quantity;
use crate::effects::model::{Block, Model};
use crate::fit::engine::{Engine, Fit};
use crate::record::data::Data;
use crate::search::{Judge, Scored, Search, effects};
use crate::stats::scale::root_mean_square;

/// A set of causes in its best forms.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// The causes, in the chain's order; none for the simulation as it was.
    pub causes: Vec<&'static str>,
    /// Where a fit to all rows puts their parameters.
    pub values: String,
    /// Held-out log-likelihood less the price of the blocks, in nats.
    pub score: f64,
    /// Error on the rows that it was fitted to, in V.
    pub rmse: f64,
    /// Error on stretches that no fit has seen, in V.
    pub held_out_rmse: f64,
}

/// Sets that are listed for their score alone.
const BEST: usize = 8;

/// The best sets of causes, the best without each cause of the best one, and the simulation as it was.
pub(crate) fn contenders<J: Judge>(search: &Search<J>, best: &Scored) -> Vec<Scored> {
    let without: Vec<_> =
        effects(&best.fit.model).into_iter().map(|effect| search.best_without(effect).fit.model.structure()).collect();
    let kept = |(place, scored): &(usize, &Scored)| {
        let structure = scored.fit.model.structure();
        *place < BEST || structure.is_empty() || without.contains(&structure)
    };
    search.ranked().into_iter().enumerate().filter(kept).map(|(_, scored)| scored.clone()).collect()
}

/// Their standings, in the same order. Of some fits the errors on unseen stretches are known already.
pub(crate) fn standings(engine: &mut Engine, contenders: Vec<Scored>, known: [(&Fit, &[f64]); 2]) -> Vec<Standing> {
    let data = engine.data;
    let mut held_out_rmse = |fit: &Fit| match known.iter().find(|(other, _)| other.model == fit.model) {
        Some((_, unseen)) => root_mean_square(unseen),
        None => root_mean_square(&engine.held_out_residual(fit)),
    };
    let standing = |scored: Scored| Standing {
        causes: effects(&scored.fit.model).into_iter().map(|effect| EFFECTS[effect].cause()).collect(),
        values: values(data, &scored.fit.model),
        score: scored.score,
        rmse: root_mean_square(&scored.fit.residual),
        held_out_rmse: held_out_rmse(&scored.fit),
    };
    contenders.into_iter().map(standing).collect()
}

fn values(data: &Data, model: &Model) -> String {
    let of_block = |(block, point): &(Block, Vec<f64>)| block.effect().quantities(block.form, point, data);
    let quantities = model.blocks.iter().flat_map(of_block);
    let said = |Quantity { name, unit, value }| format!("{name} = {value:.4} {unit}").trim_end().to_owned();
    quantities.map(said).collect::<Vec<_>>().join(", ")
}
