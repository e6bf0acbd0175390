//! True values of a record's effects, with the parameter names of a finding.

use serde::Serialize;

use super::cause::Cause;
use super::record::LabelledRecord;

/// A cause in a record with the true values of its parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// Cause of the effect.
    pub cause: Cause,
    /// Name of the physical form.
    pub form: &'static str,
    /// Size of the effect; 1 is full size.
    pub size: f64,
    /// Parameters by name, in the cause's order.
    pub parameters: Vec<(String, f64)>,
}

/// Voltages at which the curve of a static nonlinearity is stated, in V.
const CURVE_V: [u32; 5] = [100, 200, 300, 400, 500];

impl LabelledRecord {
    /// True values of every effect.
    pub fn truths(&self) -> Vec<Truth> {
        self.effects.iter().enumerate().map(|(index, _)| self.truth(index)).collect()
    }

    fn truth(&self, index: usize) -> Truth {
        let effect = &self.effects[index];
        let mut values = effect.values();
        match effect.cause {
            Cause::AmplifierSlew => values[0] = 1.0 / values[0],
            Cause::Hysteresis => values[0] = effect.hysteresis().map_or(0.0, |hysteresis| hysteresis.width_v()),
            Cause::SensorSaturation => values[0] = self.readings.limit.unwrap_or(f64::INFINITY),
            // The number that occurred in the record, not the expected number.
            Cause::Outliers => values[0] = self.readings.outliers as f64 / self.readings.read.len() as f64,
            _ => {}
        }
        let names = effect.cause.facts().parameters.iter().map(|&name| name.to_owned());
        let mut parameters: Vec<_> = names.zip(values).collect();
        if let Some(law) = effect.law() {
            parameters.extend(CURVE_V.map(|volts| (format!("at_{volts}_v"), law.at(f64::from(volts)))));
        }
        Truth { cause: effect.cause, form: effect.cause.facts().forms[effect.form], size: effect.size, parameters }
    }

    /// True value of a finding's parameter, and the scale of its relative error; `None` if the record does not have it.
    ///
    /// The scale is the absolute value itself; for the ends of a segment it is the segment's length. A parameter of a
    /// static nonlinearity is the curve at the voltage in its name, such as `at_100_v`.
    pub fn true_value(&self, cause: Cause, parameter: &str) -> Option<(f64, f64)> {
        let index = self.effects.iter().position(|effect| effect.cause == cause)?;
        if let Some(law) = self.effects[index].law() {
            let volts = parameter.strip_prefix("at_")?.strip_suffix("_v")?.parse().ok()?;
            let settled = law.at(volts);
            return (settled != 0.0).then_some((settled, settled));
        }
        let truth = self.truth(index);
        let value = |name: &str| truth.parameters.iter().find(|(n, _)| n == name).map(|&(_, value)| value);
        let scale = match parameter {
            "from_s" | "to_s" => value("to_s")? - value("from_s")?,
            _ => value(parameter)?.abs(),
        };
        Some((value(parameter)?, scale))
    }
}
