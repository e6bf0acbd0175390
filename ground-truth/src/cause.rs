//! 19 of the 20 causes that `vsj diagnose` distinguishes, all but `stuck-sensor`: name, block, parameters, forms and how their size is
//! measured.

use std::fmt::{self, Display};

use serde::{Serialize, Serializer};

/// Stage of the chain from command to reading in which a cause acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Block {
    /// Amplifier: between the commanded voltage and the voltage across the spring.
    Amplifier,
    /// Static response: the settled stiffness as a function of the voltage and its history, independent of time.
    Static,
    /// Relaxation: how the stiffness approaches its settled value and changes with time.
    Relaxation,
    /// Reading: the sensor and the file.
    Reading,
}

/// Something that a simulation of the spring may get wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "each variant is named as in `Facts::name`")]
pub enum Cause {
    GainError,
    InstantaneousShare,
    TimeConstant,
    SecondRelaxation,
    VoltageDependentTimeConstant,
    StaticNonlinearity,
    Hysteresis,
    ChargeLeakage,
    Drift,
    Resonance,
    Delay,
    AmplifierLimit,
    AmplifierSlew,
    SensorSaturation,
    Quantisation,
    Hum,
    ReadingOffset,
    Outliers,
    SeriesLag,
}

/// Properties of a cause that are independent of any record.
#[derive(Debug)]
pub struct Facts {
    /// Cause code, as in the findings of `vsj diagnose`.
    pub name: &'static str,
    /// Stage of the chain in which the cause acts.
    pub block: Block,
    /// Names of the parameters in a finding, in the order of [`Effect::values`](super::Effect::values).
    pub parameters: &'static [&'static str],
    /// Physical forms of the cause; the first is the one that the diagnosis models.
    pub forms: &'static [&'static str],
    /// How the size of the effect is measured.
    pub measure: Measure,
    /// True if the effect is visible in voltage steps only, not in a slow sweep.
    pub needs_steps: bool,
    /// Number of unknown values, which is the degrees of freedom of a likelihood-ratio test with known structure.
    pub unknowns: usize,
}

/// Measure of an effect's size that goes to zero with the effect.
#[derive(Debug)]
pub struct Measure {
    /// Index of the measured value in [`Effect::values`](super::Effect::values).
    pub value: usize,
    /// Factor from the value's distance to its neutral value, to `unit`.
    pub factor: f64,
    /// Unit, with the reference that the distance is measured from.
    pub unit: &'static str,
}

macro_rules! facts {
    ($($name:literal $block:ident $parameters:expr, $forms:expr, $value:literal * $factor:literal $unit:literal,
       $steps:literal, $unknowns:literal;)*) => {
        [$(Facts { name: $name, block: Block::$block, parameters: &$parameters, forms: &$forms,
            measure: Measure { value: $value, factor: $factor, unit: $unit }, needs_steps: $steps,
            unknowns: $unknowns }),*]
    };
}

/// Facts of every cause, in the order of [`Cause::ALL`].
static FACTS: [Facts; 19] = facts! {
    "gain-error" Static ["gain"], ["gain"], 0 * 1.0 "of 1", false, 1;
    "instantaneous-share" Relaxation ["share"], ["share"], 0 * 1.0 "from 1/11", true, 1;
    "time-constant" Relaxation ["tau_s"], ["tau"], 0 * 1.0 "s from 5.5 s", false, 1;
    "second-relaxation" Relaxation ["share", "tau_s"], ["from the relaxing part", "from everything"],
        0 * 1.0 "share", false, 2;
    "voltage-dependent-time-constant" Relaxation ["tau_low_s", "tau_high_s"], ["linear", "exponential"],
        0 * 1.0 "s at 0 V", false, 2;
    "static-nonlinearity" Static [], ["quadratic", "exponential", "saturating"], 0 * 125.0 "V at 250 V", false, 1;
    "hysteresis" Static ["width_v"], ["one play", "play bank", "Bouc-Wen"], 0 * 1.0 "V wide", false, 1;
    "charge-leakage" Relaxation ["share", "tau_s"], ["after relaxation", "before relaxation"],
        0 * 1.0 "share", false, 2;
    "drift" Relaxation ["per_s"], ["multiplicative", "exponential", "additive"], 0 * 1.0 "1/s", false, 1;
    "resonance" Relaxation ["freq_hz", "zeta"], ["in series", "on the instantaneous part"],
        2 * 1.0 "of the response", true, 2;
    "delay" Amplifier ["delay_s"], ["delay"], 0 * 1.0 "s", true, 1;
    "amplifier-limit" Amplifier ["limit_v"], ["limit"], 0 * 1.0 "V below full scale", false, 1;
    "amplifier-slew" Amplifier ["slew_v_per_s"], ["slew"], 0 * 100.0 "s per 100 V", true, 1;
    "sensor-saturation" Reading ["limit"], ["limit"], 0 * 500.0 "V below the largest", false, 1;
    "quantisation" Reading ["step"], ["round"], 0 * 1.0 "V", false, 1;
    "hum" Reading ["amplitude", "freq_hz"], ["sine"], 0 * 1.0 "V", false, 3;
    "reading-offset" Reading ["from_s", "to_s", "offset"], ["constant"], 2 * 1.0 "V", false, 3;
    "outliers" Reading ["fraction"], ["either side", "one side"], 1 * 1.0 "V", false, 1;
    "series-lag" Relaxation ["tau_s"], ["one lag", "two equal lags"], 0 * 1.0 "s", true, 1;
};

impl Cause {
    /// All causes, in the order of the table of `vsj diagnose`.
    pub const ALL: [Self; 19] = [
        Self::GainError,
        Self::InstantaneousShare,
        Self::TimeConstant,
        Self::SecondRelaxation,
        Self::VoltageDependentTimeConstant,
        Self::StaticNonlinearity,
        Self::Hysteresis,
        Self::ChargeLeakage,
        Self::Drift,
        Self::Resonance,
        Self::Delay,
        Self::AmplifierLimit,
        Self::AmplifierSlew,
        Self::SensorSaturation,
        Self::Quantisation,
        Self::Hum,
        Self::ReadingOffset,
        Self::Outliers,
        Self::SeriesLag,
    ];

    /// Properties of the cause.
    pub fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }

    /// Cause code, as in the findings of `vsj diagnose`.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Stage of the chain in which the cause acts.
    pub fn block(self) -> Block {
        self.facts().block
    }

    /// Cause with the code `name`, or `None`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }
}

impl Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl Serialize for Cause {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_are_in_the_order_of_the_causes() {
        for (index, cause) in Cause::ALL.into_iter().enumerate() {
            assert_eq!(cause as usize, index);
            assert_eq!(Cause::named(cause.name()), Some(cause));
            // The variant `GainError` has the code `gain-error`.
            let words: String = cause.name().split('-').collect();
            assert_eq!(format!("{cause:?}").to_lowercase(), words);
        }
    }
}
