//! A named cause: its odds against the best explanation without it, and its parameters.

use crate::answer::{Finding, Parameter};
use crate::dimension::Dimension;
use crate::effects::EFFECTS;
use crate::fit::engine::Engine;
use crate::verdict::cause::Cause;
use crate::verdict::form_average::parameters_over_forms;
use crate::verdict::found::Found;
use crate::verdict::ranking::named;

/// Largest odds that are converted to a probability, in nats.
const LARGEST_ODDS: f64 = 40.0;

/// Mean square error that a finding explains, in V^2.
pub(crate) fn explained(finding: &Finding) -> f64 {
    finding.rmse_before.powi(2) - finding.rmse_after.powi(2)
}

/// Reports an effect of the best structure.
pub(crate) fn finding(engine: &mut Engine, found: &Found, cause: &Cause) -> Finding {
    let Cause { effect, without, odds, left_out } = cause;
    let Found { best, explored, regular, .. } = found;
    let effect = *effect;
    let [before, rival, after] = [left_out, without, best].map(|scored| regular.rms(&scored.fit.residual));
    let others = named(&without.fit.model);
    let rival = engine.data.scales().shown_in_four_digits(Dimension::ReadingSize, rival);
    let against = if others.is_empty() { "the simulation as it is given".to_owned() } else { others };
    let better = if best.fit.model.searched(effect) {
        format!("with the price of all searched places deducted, the readings are {odds:.1} nats likelier")
    } else {
        format!("on held-out segments this is {odds:.1} nats better")
    };
    let parameters = parameters_over_forms(engine, best, explored, effect);
    let at_bounds = at_bounds(&parameters);
    Finding {
        cause: EFFECTS[effect].cause(),
        probability: 1.0 / (1.0 + (-odds.clamp(-LARGEST_ODDS, LARGEST_ODDS)).exp()),
        parameters,
        rmse_before: before.max(after),
        rmse_after: after,
        evidence: format!(
            "{}: {better} than the best explanation without it ({against}, {rival}){}",
            EFFECTS[effect].description(),
            at_bounds
        ),
        proved: false,
    }
}

/// The words on parameters at their bounds that follow the evidence; empty if there are none.
fn at_bounds(parameters: &[(String, Parameter)]) -> String {
    let names: Vec<&str> = parameters.iter().filter(|(_, it)| it.at_bound).map(|(name, _)| name.as_str()).collect();
    match names.as_slice() {
        [] => String::new(),
        [name] => format!("; {name} is at the bound of its range, and the best value may be beyond"),
        names => {
            format!("; {} are at the bounds of their ranges, and the best values may be beyond", names.join(" and "))
        }
    }
}
