//! A named cause: what it is worth beside the best explanation without it, and its parameters.

use crate::answer::Finding;
use crate::effects::EFFECTS;
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::parameters;
use crate::search::{Scored, effects};
use crate::stats::scale::root_mean_square;

pub(crate) fn explained(finding: &Finding) -> f64 {
    finding.rmse_before.powi(2) - finding.rmse_after.powi(2)
}

/// `without` is the best structure without the effect, others in its place; `left_out` the best with nothing in its place.
pub(crate) fn finding(
    engine: &mut Engine,
    best: &Scored,
    effect: usize,
    without: &Scored,
    left_out: &Scored,
) -> Finding {
    let odds = best.score - without.score;
    let [before, rival, after] = [left_out, without, best].map(|scored| rms(engine, &scored.fit));
    let others: Vec<&str> = effects(&without.fit.model).into_iter().map(|other| EFFECTS[other].cause()).collect();
    let against = if others.is_empty() { "the simulation as it was".to_owned() } else { others.join(" and ") };
    let better = if best.fit.model.searched(effect) {
        format!("the readings are {odds:.1} nats likelier, all places that were searched charged,")
    } else {
        format!("on held-out stretches this is {odds:.1} nats better")
    };
    Finding {
        cause: EFFECTS[effect].cause(),
        probability: 1.0 / (1.0 + (-odds.clamp(-40.0, 40.0)).exp()),
        parameters: parameters(engine, &best.fit, effect),
        rmse_before: before.max(after),
        rmse_after: after,
        evidence: format!(
            "{}: {better} than the best without it ({against}, {rival:.3} V)",
            EFFECTS[effect].description()
        ),
    }
}

fn rms(engine: &Engine, fit: &Fit) -> f64 {
    root_mean_square(&engine.observed.errors(&fit.residual))
}
