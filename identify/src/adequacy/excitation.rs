//! Check of whether a record can identify any spring: its voltage and its readings change.

use crate::adequacy::check::{Candidate, Check, Inadequacy};
use crate::adequacy::comparison::Comparison;
use crate::adequacy::unidentifiable::Unidentifiable;
use crate::fit::engine::Engine;
use crate::record::scales::REFERENCE_VOLTAGE_V;
use crate::stats::thresholds::empirical::RANGE_OF_A_DEAD_SENSOR;

/// The check of a record, with the fit of the simulation as it is given.
pub(super) struct Excitation;

impl Check for Excitation {
    fn name(&self) -> &'static str {
        "excitation"
    }

    fn test(&self, engine: &mut Engine, _: &Candidate) -> Option<Inadequacy> {
        let changes = |values: &[f64]| values.iter().any(|value| *value != values[0]);
        // Under a constant voltage a response to the voltage cannot be distinguished from the decay of the initial state.
        if !changes(&engine.data.voltage_v) {
            return Some(Unidentifiable::Excitation.into());
        }
        if changes(&engine.data.reading) {
            return None;
        }
        let comparison = Comparison::new(engine);
        let excited = comparison.simulated_range_v() > RANGE_OF_A_DEAD_SENSOR.get() * REFERENCE_VOLTAGE_V;
        Some(match excited {
            true => Unidentifiable::DeadSensor(comparison.constant_readings()).into(),
            false => Unidentifiable::Excitation.into(),
        })
    }
}
