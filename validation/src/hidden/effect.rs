//! One cause, its form and its values, and how it shrinks.

use super::cause::Cause;
use super::memory::Memory;
use super::physics::{Creep, Drift, Law, Leakage, Resonance, TAU_S, Tau};
use super::spring::Spring;

/// A cause at work.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// What is wrong.
    pub cause: Cause,
    /// Which of the cause's forms.
    pub form: usize,
    /// The values at size 1, in the order of [`Effect::values`].
    pub plain: Vec<f64>,
    /// The values at which nothing is wrong. A value that doesn't shrink, such as a frequency, is the same as in `plain`.
    pub neutral: Vec<f64>,
    /// 0: no effect. 1: plain to see.
    pub size: f64,
}

impl Effect {
    /// The same at another size.
    pub fn at(&self, size: f64) -> Self {
        Self { size, ..self.clone() }
    }

    /// The size next to no effect. It is 0, but for delay and slew: a row is read just after its voltage is commanded, so
    /// that the least of them hides a step's immediate part from the step's own row.
    pub fn least(&self) -> f64 {
        if matches!(self.cause, Cause::Delay | Cause::AmplifierSlew) { 1e-6 } else { 0.0 }
    }

    /// The cause's parameters, and what else its form needs, at this size.
    ///
    /// Two are not as in a finding: the slew is in s/V, which goes to nothing with the effect, and the bound of the sensor
    /// is a part of the record's largest stiffness.
    ///
    /// | cause | values after its parameters |
    /// | --- | --- |
    /// | static nonlinearity | bend |
    /// | resonance | participation |
    /// | hum | phase |
    /// | outliers | typical distance in V |
    pub fn values(&self) -> Vec<f64> {
        let shrunk = |(&plain, &neutral): (&f64, &f64)| neutral + self.size * (plain - neutral);
        self.plain.iter().zip(&self.neutral).map(shrunk).collect()
    }

    /// How large it is, in the unit of the cause's [`Measure`](super::cause::Measure).
    pub fn magnitude(&self) -> f64 {
        let measure = &self.cause.facts().measure;
        let i = measure.value;
        ((self.values()[i] - self.neutral[i]) * measure.factor).abs()
    }

    /// The law of a static nonlinearity.
    pub fn law(&self) -> Option<Law> {
        let forms = [Law::Quadratic, Law::Exponential, Law::Saturating];
        (self.cause == Cause::StaticNonlinearity).then(|| match self.values()[0] {
            0.0 => Law::Straight,
            bend => forms[self.form](bend),
        })
    }

    /// The memory of a hysteresis.
    pub fn memory(&self) -> Option<Memory> {
        let forms = [Memory::play, Memory::bank, Memory::bouc_wen];
        (self.cause == Cause::Hysteresis).then(|| match self.values()[0] {
            0.0 => Memory::None,
            width_v => forms[self.form](width_v),
        })
    }

    /// Builds it into a spring; the causes of the readings are none of the spring's.
    pub fn alter(&self, spring: &mut Spring) {
        let form = self.form;
        match (self.cause, self.values().as_slice()) {
            (Cause::GainError, &[gain]) => spring.gain = gain,
            (Cause::InstantaneousShare, &[share]) => spring.share = share,
            (Cause::TimeConstant, &[tau_s]) => spring.tau = Tau::Linear { low_s: tau_s, high_s: tau_s },
            (Cause::SecondRelaxation, &[share, tau_s]) => {
                spring.creep = Some(Creep { share, tau_s, from_everything: form == 1 });
            }
            (Cause::VoltageDependentTimeConstant, &[low_s, high_s]) => {
                spring.tau = if form == 0 { Tau::Linear { low_s, high_s } } else { Tau::Exponential { low_s, high_s } };
            }
            (Cause::StaticNonlinearity, _) => spring.law = self.law().expect("its own law"),
            (Cause::Hysteresis, _) => spring.memory = self.memory().expect("its own memory"),
            (Cause::ChargeLeakage, &[share, tau_s]) => {
                spring.leakage = Some(Leakage { share, tau_s, before: form == 1 });
            }
            (Cause::Drift, &[per_s]) => {
                spring.drift = Some([Drift::Multiplicative, Drift::Exponential, Drift::Additive][form](per_s));
            }
            (Cause::Resonance, &[freq_hz, zeta, participation]) => {
                spring.resonance = Some(Resonance { freq_hz, zeta, participation, immediate: form == 1 });
            }
            (Cause::Delay, &[delay_s]) => spring.delay_s = delay_s,
            (Cause::AmplifierLimit, &[limit_v]) => spring.limit_v = limit_v,
            (Cause::AmplifierSlew, &[s_per_v]) => spring.slew_v_per_s = 1.0 / s_per_v,
            (
                Cause::SensorSaturation | Cause::Quantisation | Cause::Hum | Cause::ReadingOffset | Cause::Outliers,
                _,
            ) => {}
            (cause, values) => unreachable!("{cause} with values {values:?}"),
        }
    }
}

/// At what a value stands when nothing is wrong, where that is a constant.
pub(super) fn neutral(cause: Cause) -> f64 {
    match cause {
        Cause::GainError => 1.0,
        Cause::InstantaneousShare => super::physics::SHARE,
        Cause::TimeConstant | Cause::VoltageDependentTimeConstant => TAU_S,
        _ => 0.0,
    }
}
