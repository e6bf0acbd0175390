//! Check of whether a record identifies the gain and the time constant; without these two no cause can be isolated.

use model::Plant;

use crate::adequacy::check::{Candidate, Check, Inadequacy};
use crate::adequacy::comparison::Comparison;
use crate::adequacy::gain_and_time_constant::{gain_and_time_constant, model_of_both};
use crate::adequacy::standstill::constant_is_as_likely;
use crate::adequacy::unidentifiable::Unidentifiable;
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::covariance;
use crate::noise::Noise;
use crate::stats::thresholds::empirical::{
    CORRELATION_OF_NO_SPRING, CORRELATION_OF_OTHER_UNIT, GAIN_DEVIATION, LOG_TIME_CONSTANT_DEVIATION,
    NATS_TO_TRUST_FIT, RANGE_OF_A_DEAD_SENSOR_V,
};

/// The check of a record, with the fit of the simulation as it is given.
pub(super) struct Informative;

impl Check for Informative {
    fn name(&self) -> &'static str {
        "informative"
    }

    fn test(&self, engine: &mut Engine, candidate: &Candidate) -> Option<Inadequacy> {
        unidentifiable(engine, candidate.fit).map(Inadequacy::from)
    }
}

/// Returns why gain and time constant are not identified, or `None` if they are.
fn unidentifiable(engine: &mut Engine, baseline: &Fit) -> Option<Unidentifiable> {
    let data = engine.data;
    let changes = |values: &[f64]| values.iter().any(|value| *value != values[0]);
    // Under a constant voltage a response to the voltage cannot be distinguished from the decay of the initial state.
    if !changes(&data.voltage_v) {
        return Some(Unidentifiable::Excitation);
    }
    let comparison = Comparison::new(engine);
    if !changes(&data.reading) {
        let excited = comparison.simulated_range_v() > RANGE_OF_A_DEAD_SENSOR_V.get();
        return Some(if excited {
            Unidentifiable::Sensor(comparison.constant_readings())
        } else {
            Unidentifiable::Excitation
        });
    }
    let start = model_of_both(engine.base().relaxation.tau_s);
    let mut best = engine.fit(start.clone(), &Noise::default_robust());
    // From a time constant that is wrong by decades the fit does not converge, so the paper's is a second start.
    let paper = model_of_both(Plant::PAPER.time_constant_s);
    if paper != start {
        let other = engine.fit(paper, &Noise::default_robust());
        best = if other.log_likelihood > best.log_likelihood { other } else { best };
    }
    let [gain, _] = gain_and_time_constant();
    let bounds = &gain.coordinates(data)[0];
    let found = best.model.point(gain.effect).map_or(1.0, |point| point[0]);
    if !(1.01 * bounds.lowest..0.99 * bounds.highest).contains(&found)
        && comparison.correlation.abs() > CORRELATION_OF_OTHER_UNIT.get()
    {
        return Some(Unidentifiable::Sensor(comparison.other_unit()));
    }
    let identified = |fit: &Fit, engine: &mut Engine| {
        covariance(engine, fit).is_some_and(|of| {
            of[(0, 0)].sqrt() < GAIN_DEVIATION.get() && of[(1, 1)].sqrt() < LOG_TIME_CONSTANT_DEVIATION.get()
        })
    };
    // Noise of the best fit with the sensitivities at the start of the search; where the start is far off, these vanish.
    let residual = engine.residual(&start);
    let start = Fit { model: start, residual, noise: best.noise.clone(), ..best.clone() };
    let is_clear = best.log_likelihood > baseline.log_likelihood + NATS_TO_TRUST_FIT.get();
    let informative = identified(&start, engine) || is_clear && identified(&best, engine);
    if !informative {
        return Some(Unidentifiable::Excitation);
    }
    // Checked before the search, which takes long on noise alone.
    let constant = comparison.correlation.abs() < CORRELATION_OF_NO_SPRING.get()
        && constant_is_as_likely(engine, &best.model, best.log_likelihood);
    constant.then(|| Unidentifiable::Sensor(comparison.constant_readings()))
}
