//! Check of whether the readings respond to the voltage at all, before a search that would take long on noise.
//!
//! They do not if a constant is clearly likelier than the simulation as it is given, and if the errors of that constant do not
//! depend on the voltage or the time. A spring that noise hides is not concerned: there the simulation is as likely. Nor is one whose
//! simulation has a clearly smaller error than the constant, however likely an autoregression makes that.

use crate::adequacy::check::{Candidate, Check, Inadequacy};
use crate::adequacy::comparison::Comparison;
use crate::adequacy::residual_regression::ResidualRegression;
use crate::adequacy::unidentifiable::Unidentifiable;
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::stats::median::median;
use crate::stats::scale::robust_scale;
use crate::stats::thresholds::empirical::SPRING_ERROR_PER_SCATTER;
use crate::stats::thresholds::probability::CLEARLY_LIKELIER;

/// The check of a record, with the fit of the simulation as it is given.
pub(super) struct NoResponse;

impl Check for NoResponse {
    fn name(&self) -> &'static str {
        "no_response"
    }

    fn test(&self, engine: &mut Engine, Candidate { fit, .. }: &Candidate) -> Option<Inadequacy> {
        let reading = &engine.data.reading;
        let constant = median(&mut reading.clone()).expect("readings");
        let residual: Vec<f64> = reading.iter().map(|reading| reading - constant).collect();
        let noise = Noise::fitted(&residual, engine.observed);
        let [error, scatter] = [&fit.residual, &residual].map(|of| robust_scale(&engine.observed.errors(of)));
        if error < SPRING_ERROR_PER_SCATTER.get() * scatter {
            return None;
        }
        let log_likelihood = noise.log_likelihood(&residual, engine.observed) - noise.cost(residual.len());
        if log_likelihood < fit.log_likelihood + CLEARLY_LIKELIER {
            return None;
        }
        let around = Fit { residual, noise, log_likelihood, ..(*fit).clone() };
        match ResidualRegression.test(engine, &Candidate::unpriced(&around)) {
            Some(Inadequacy::Unmodelled(found)) if found.significant => None,
            _ => Some(Unidentifiable::Noise(Comparison::new(engine).constant_readings()).into()),
        }
    }
}
