//! Whether a record can tell anything at all.

use super::effects::{EFFECTS, index_of};
use super::fit::{Engine, Fit};
use super::interval::covariance;
use super::model::{Block, Model};
use super::noise::Noise;

/// True if gain and time constant would show in this record at all.
pub(super) fn informative(engine: &mut Engine) -> bool {
    let data = engine.data;
    let moves = |values: &[f64]| values.iter().any(|value| *value != values[0]);
    // Under one voltage all the time, what the spring does may be its start as well as its answer.
    if !moves(&data.voltage_v) || !moves(&data.reading) {
        return false;
    }
    let probe = ["gain-error", "time-constant"].iter().filter_map(|cause| index_of(cause)).fold(
        Model::default(),
        |model, effect| {
            let point =
                if EFFECTS[effect].cause() == "gain-error" { 1.0 } else { engine.simulator.base.relaxation.tau_s.ln() };
            model.with(Block { effect, form: 0 }, vec![point])
        },
    );
    // The noise as it is at best, the information as it is where the search starts.
    let best = engine.fit(probe.clone(), &Noise::first_look());
    let residual = engine.residual(&probe);
    let start = Fit { model: probe, residual, noise: best.noise, ..best };
    let Some(covariance) = covariance(engine, &start) else { return false };
    // Half of the gain, or a factor of e in the time constant, is no knowledge.
    covariance[(0, 0)].sqrt() < 0.5 && covariance[(1, 1)].sqrt() < 1.0
}
