//! A sensor that reads no spring: readings that stand still are at least as likely as the best spring.
//!
//! ```text
//! reading = constant + hum + shifted run + noise
//! ```
//!
//! A dead sensor has noise, and a spring can be bent until it stands still: by a law that is flat, a play that is never
//! taken up, readings that stop. So a spring has to be worth its causes' price beside a constant, as beside the simulation.

use crate::effects::index_of;
use crate::effects::model::Model;
use crate::fit::engine::Engine;
use crate::noise::Noise;
use crate::stats::median::median;
use crate::stats::scale::robust_scale;

/// What is added to readings, whatever is read.
const ADDED: [&str; 2] = ["hum", "reading-offset"];
/// A spring whose error is below this part of the readings' scatter around the constant moves, however much a memory of the
/// noise explains.
const MOVES: f64 = 0.9;

/// True if a constant is as likely as a model that scores so many nats.
pub(crate) fn as_likely(engine: &mut Engine, model: &Model, score: f64) -> bool {
    let left = engine.residual(model);
    let spring = ADDED.iter().fold(model.clone(), |model, cause| model.without(index_of(cause).expect("an effect")));
    let without_added = engine.residual(&spring);
    let reading: Vec<f64> = engine
        .data
        .reading
        .iter()
        .zip(without_added.iter().zip(&left))
        .map(|(reading, (without, with))| reading - (without - with))
        .collect();
    let constant = median(&mut reading.clone()).expect("readings");
    let around: Vec<f64> = reading.iter().map(|reading| reading - constant).collect();
    let noise = Noise::fitted(&around, engine.observed);
    let likelihood = noise.log_likelihood(&around, engine.observed) - noise.cost(around.len());
    likelihood >= score
        && robust_scale(&engine.observed.errors(&left)) > MOVES * robust_scale(&engine.observed.errors(&around))
}
