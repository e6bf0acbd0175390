//! The ranges of the readings and of the simulation as it is given.

use crate::dimension::{Dimension, significant};
use crate::fit::engine::Engine;
use crate::record::scales::Scales;

/// Readings compared with the simulation without any effect.
pub(crate) struct Comparison {
    scales: Scales,
    /// Lowest and highest reading, in V.
    read: [f64; 2],
    /// Lowest and highest simulated stiffness, in V.
    simulated: [f64; 2],
}

impl Comparison {
    /// Compares the engine's readings with its simulation.
    pub(crate) fn new(engine: &Engine) -> Self {
        let read = &engine.data.reading;
        let simulated: Vec<f64> = read.iter().zip(&engine.baseline_residual).map(|(read, left)| read - left).collect();
        let range = |values: &[f64]| {
            values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)])
        };
        Self { read: range(read), simulated: range(&simulated), scales: engine.data.scales().clone() }
    }

    /// Range of the simulated stiffness, highest less lowest, in V.
    pub(crate) fn simulated_range_v(&self) -> f64 {
        self.simulated[1] - self.simulated[0]
    }

    /// The report's sentence on readings that do not follow the voltage.
    pub(crate) fn constant_readings(&self) -> String {
        let range = |[low, high]: [f64; 2]| {
            let ends = [low, high].map(|value| self.scales.restored(Dimension::Reading, value));
            let [low, high] = if ends[0] <= ends[1] { ends } else { [ends[1], ends[0]] };
            format!("{} to {}", significant(low, 4), self.scales.four_digits(Dimension::Reading, high))
        };
        format!(
            "The readings, {}, do not follow the voltage, under which the simulation goes from {}",
            range(self.read),
            range(self.simulated)
        )
    }
}
