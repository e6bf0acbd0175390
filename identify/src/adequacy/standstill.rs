//! Check for a sensor that does not read the spring: a constant is at least as likely as the best spring.
//!
//! ```text
//! reading = constant + hum + shifted run + noise
//! ```
//!
//! A disconnected sensor reads noise, and a spring model can be fitted until it is constant: by a flat voltage law, a play
//! wider than the command, readings that saturate. So the spring's score, log-likelihood less the price of its blocks, has
//! to exceed the log-likelihood of a constant, as it has to exceed that of the simulation as it is given.

use crate::adequacy::check::{Candidate, Check, Inadequacy};
use crate::adequacy::comparison::Comparison;
use crate::adequacy::unidentifiable::Unidentifiable;
use crate::effects::index_of;
use crate::effects::model::Model;
use crate::fit::engine::Engine;
use crate::noise::Noise;
use crate::stats::median::median;
use crate::stats::scale::robust_scale;
use crate::stats::thresholds::empirical::SPRING_ERROR_PER_SCATTER;

/// Effects that act on readings whatever the sensor reads; they are added to the constant.
const ON_ANY_READING: [&str; 2] = ["hum", "reading-offset"];

/// The check of a model with at least one effect.
pub(super) struct Standstill;

impl Check for Standstill {
    fn name(&self) -> &'static str {
        "standstill"
    }

    fn test(&self, engine: &mut Engine, Candidate { fit, score }: &Candidate) -> Option<Inadequacy> {
        let constant = !fit.model.blocks.is_empty() && constant_is_as_likely(engine, &fit.model, *score);
        constant.then(|| Unidentifiable::Noise(Comparison::new(engine).constant_readings()).into())
    }
}

/// True if a constant is at least as likely as a model with this score, in nats.
pub(crate) fn constant_is_as_likely(engine: &mut Engine, model: &Model, score: f64) -> bool {
    let left = engine.residual(model);
    let spring =
        ON_ANY_READING.iter().fold(model.clone(), |model, cause| model.without(index_of(cause).expect("an effect")));
    let without_added = engine.residual(&spring);
    let added = without_added.iter().zip(&left).map(|(without, with)| without - with);
    let read = &engine.data.reading;
    let without_added: Vec<f64> = read.iter().zip(added).map(|(reading, added)| reading - added).collect();
    // The shift of a run may be what makes a spring constant.
    [without_added, read.clone()].into_iter().any(|reading| is_as_likely(engine, &left, &reading, score))
}

/// True if a constant is at least as likely for these readings as a model with this residual and score.
fn is_as_likely(engine: &Engine, left: &[f64], reading: &[f64], score: f64) -> bool {
    let constant = median(&mut reading.to_vec()).expect("readings");
    let around: Vec<f64> = reading.iter().map(|reading| reading - constant).collect();
    let noise = Noise::fitted(&around, engine.observed);
    let likelihood = noise.log_likelihood(&around, engine.observed) - noise.cost(around.len());
    let [error, scatter] = [left, &around].map(|residual| robust_scale(&engine.observed.errors(residual)));
    likelihood >= score && error > SPRING_ERROR_PER_SCATTER.get() * scatter
}
