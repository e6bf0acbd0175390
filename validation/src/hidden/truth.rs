//! What is true about a record, in the words of a finding.

use serde::Serialize;

use super::cause::Cause;
use super::record::Hidden;

/// A hidden cause with the true values of its parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// What is wrong.
    pub cause: Cause,
    /// In which form.
    pub form: &'static str,
    /// 1: plain to see.
    pub size: f64,
    /// By name, in the cause's order.
    pub parameters: Vec<(String, f64)>,
}

/// Voltages at which the curve of a static nonlinearity is stated, in V.
const CURVE_V: [u32; 5] = [100, 200, 300, 400, 500];

impl Hidden {
    /// Of every effect.
    pub fn truths(&self) -> Vec<Truth> {
        self.effects.iter().enumerate().map(|(index, _)| self.truth(index)).collect()
    }

    fn truth(&self, index: usize) -> Truth {
        let effect = &self.effects[index];
        let mut values = effect.values();
        match effect.cause {
            Cause::AmplifierSlew => values[0] = 1.0 / values[0],
            Cause::Hysteresis => values[0] = effect.memory().map_or(0.0, |memory| memory.width_v()),
            Cause::SensorSaturation => values[0] = self.readings.limit.unwrap_or(f64::INFINITY),
            // As many as there are, not as were likely.
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

    /// The true value of a finding's parameter, and what its error is compared with.
    ///
    /// That is the value itself; for the ends of a stretch its length. A parameter of a static nonlinearity is the curve at
    /// the voltage in its name, such as `at_100_v`.
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
