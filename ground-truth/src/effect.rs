//! One cause with its form, its values and its size.

use super::cause::Cause;
use super::hysteresis::Hysteresis;
use super::physics::{Law, SHARE, TAU_S};

/// One cause with the values it has in a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Cause of the effect.
    pub cause: Cause,
    /// Index of the physical form in [`Facts::forms`](super::cause::Facts::forms).
    pub form: usize,
    /// Values at size 1, in the order of [`Effect::values`].
    pub full_size: Vec<f64>,
    /// Values without the effect. A value that does not scale with the size, such as a frequency, is as in `full_size`.
    pub neutral: Vec<f64>,
    /// Size of the effect: 0 for none, 1 for full size, linear between.
    pub size: f64,
}

impl Effect {
    /// Returns the effect at another size, 0 for none to 1 for full size.
    pub fn at(&self, size: f64) -> Self {
        Self { size, ..self.clone() }
    }

    /// Limit of the size towards no effect: 0, but 1e-6 for delay, slew and lag. A row is read just after its voltage is
    /// commanded, so that even the smallest of these removes a step's instantaneous part from the step's own row.
    pub fn least(&self) -> f64 {
        if matches!(self.cause, Cause::Delay | Cause::AmplifierSlew | Cause::SeriesLag) { 1e-6 } else { 0.0 }
    }

    /// The cause's parameters and what else its form needs, at this size.
    ///
    /// Two differ from the parameters of a finding: the slew is in s/V, which is 0 without the effect, and the limit of
    /// the sensor is a fraction of the record's largest stiffness.
    ///
    /// | cause | values after its parameters |
    /// | --- | --- |
    /// | static nonlinearity | bend |
    /// | resonance | participation |
    /// | hum | phase |
    /// | outliers | typical distance in V |
    pub fn values(&self) -> Vec<f64> {
        let shrunk = |(&full_size, &neutral): (&f64, &f64)| neutral + self.size * (full_size - neutral);
        self.full_size.iter().zip(&self.neutral).map(shrunk).collect()
    }

    /// Size of the effect in the unit of the cause's [`Measure`](super::cause::Measure).
    pub fn magnitude(&self) -> f64 {
        let measure = &self.cause.facts().measure;
        let i = measure.value;
        ((self.values()[i] - self.neutral[i]) * measure.factor).abs()
    }

    /// Law of a static nonlinearity; `None` for any other cause.
    pub fn law(&self) -> Option<Law> {
        let forms = [Law::Quadratic, Law::Exponential, Law::Saturating];
        (self.cause == Cause::StaticNonlinearity).then(|| match self.values()[0] {
            0.0 => Law::Straight,
            bend => forms[self.form](bend),
        })
    }

    /// Hysteresis operator of a hysteresis; `None` for any other cause.
    pub fn hysteresis(&self) -> Option<Hysteresis> {
        let forms = [Hysteresis::play, Hysteresis::bank, Hysteresis::bouc_wen];
        (self.cause == Cause::Hysteresis).then(|| match self.values()[0] {
            0.0 => Hysteresis::None,
            width_v => forms[self.form](width_v),
        })
    }
}

/// Value of the first parameter without the effect, for causes where it is the same in every record.
pub(super) fn neutral(cause: Cause) -> f64 {
    match cause {
        Cause::GainError => 1.0,
        Cause::InstantaneousShare => SHARE,
        Cause::TimeConstant | Cause::VoltageDependentTimeConstant => TAU_S,
        _ => 0.0,
    }
}
