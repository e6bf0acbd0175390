//! Check of whether the readings respond to the voltage at all, before a search that would take long on noise.
//!
//! They do not if a constant is clearly likelier than the simulation as it is given, if they are hardly correlated with the
//! voltage or the simulation, and if the errors of that constant do not depend on the voltage or the time. A spring that noise
//! hides is not concerned: there the simulation is as likely. The correlation is asked because the autoregression of a
//! constant's errors describes any slow response.

use crate::adequacy::check::{Candidate, Check, Inadequacy};
use crate::adequacy::comparison::Comparison;
use crate::adequacy::residual_regression::ResidualRegression;
use crate::adequacy::unidentifiable::Unidentifiable;
use crate::fit::engine::{Engine, Fit};
use crate::noise::Noise;
use crate::stats::median::median;
use crate::stats::scale::centred;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::RESPONSE;
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
        let simulated: Vec<f64> = reading.iter().zip(&fit.residual).map(|(reading, left)| reading - left).collect();
        let responds = |to: &[f64]| squared_correlation(reading, to) > RESPONSE.get();
        if responds(&engine.data.voltage_v) || responds(&simulated) {
            return None;
        }
        let residual: Vec<f64> = reading.iter().map(|reading| reading - constant).collect();
        let noise = Noise::fitted(&residual, engine.observed);
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

/// Returns the squared correlation of two series of equal length; 0 if one of them is constant.
fn squared_correlation(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (centred(a), centred(b));
    dot(&a, &b).powi(2) / (dot(&a, &a) * dot(&b, &b)).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// The verdict on a triangle between 0 and 500 V that the amplifier stops at `limit_v`, or on noise alone.
    fn is_noise(limit_v: Option<f64>) -> bool {
        let noise = normals(2000);
        let mut lag = 0.0;
        let mut row = |row: usize| {
            let time_s = 0.03 * row as f64;
            let voltage_v = 500.0 - 500.0 * ((time_s / 12.0).fract() * 2.0 - 1.0).abs();
            let applied_v = limit_v.map_or(0.0, |limit_v| voltage_v.min(limit_v));
            lag += (applied_v - lag) * (1.0 - f64::exp(-0.03 / 5.5));
            let measured = Some(applied_v / 11.0 + lag / 1.1 + noise[row]);
            Row { line: row + 2, time_s, voltage_v, measured }
        };
        let record = Record { name: String::new(), rows: (0..2000).map(&mut row).collect() };
        let (data, base) = (Data::new(&record, Input::Linear), Base::paper());
        let observed = Observed::new(&data);
        let mut engine = Engine::new(&data, &observed, &base);
        let fit = engine.evaluate(Default::default());
        NoResponse.test(&mut engine, &Candidate::unpriced(&fit)).is_some()
    }

    #[test]
    fn a_slow_response_under_a_low_limit_is_one_and_noise_is_none() {
        assert!(!is_noise(Some(260.0)));
        assert!(is_noise(None));
    }
}
