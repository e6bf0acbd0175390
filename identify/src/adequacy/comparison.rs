//! The readings compared with the simulation as it is given: ranges, correlation, slope.

use crate::fit::engine::Engine;
use crate::stats::sums::dot;

/// Readings compared with the simulation without any effect.
pub(crate) struct Comparison {
    /// Lowest and highest reading, in V.
    read: [f64; 2],
    /// Lowest and highest simulated stiffness, in V.
    simulated: [f64; 2],
    /// Pearson correlation of readings and simulation, -1 to 1; 0 where one of them is constant.
    pub(crate) correlation: f64,
    /// Least-squares slope of the readings over the simulation, in V per V.
    slope: f64,
}

impl Comparison {
    /// Compares the engine's readings with its simulation.
    pub(crate) fn new(engine: &Engine) -> Self {
        let read = &engine.data.reading;
        let simulated: Vec<f64> = read.iter().zip(&engine.baseline_residual).map(|(read, left)| read - left).collect();
        let range = |values: &[f64]| {
            values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)])
        };
        let centred = |values: &[f64]| -> Vec<f64> {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|value| value - mean).collect()
        };
        let (a, b) = (centred(read), centred(&simulated));
        Self {
            read: range(read),
            simulated: range(&simulated),
            correlation: dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt().max(f64::MIN_POSITIVE),
            slope: dot(&a, &b) / dot(&b, &b).max(f64::MIN_POSITIVE),
        }
    }

    /// Range of the simulated stiffness, highest less lowest, in V.
    pub(crate) fn simulated_range_v(&self) -> f64 {
        self.simulated[1] - self.simulated[0]
    }

    /// The report's sentence on readings that do not follow the voltage.
    pub(crate) fn constant_readings(&self) -> String {
        let ([low, high], [from, to]) = (self.read, self.simulated);
        format!(
            "The readings, {low:.3} to {high:.3} V, do not follow the voltage, under which the simulation goes from \
             {from:.0} to {to:.0} V"
        )
    }

    /// The report's sentence on readings that follow the voltage in another unit.
    pub(crate) fn other_unit(&self) -> String {
        format!(
            "The readings are {} times the simulated stiffness, beyond the gain of any spring",
            three_digits(self.slope)
        )
    }
}

/// Three decimals, or two and an exponent below 0.001 and from 100000.
fn three_digits(number: f64) -> String {
    match number.abs() {
        0.001..1e5 => format!("{number:.3}"),
        _ => format!("{number:.2e}"),
    }
}
