//! The 18 causes that `vsj diagnose` tells apart.

use std::fmt::{self, Display};

use serde::{Serialize, Serializer};

/// Where in the chain from command to reading a cause acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Block {
    /// Between the commanded voltage and the spring's.
    Amplifier,
    /// Where the spring settles, and what it remembers of its past whatever the time.
    Static,
    /// How it gets there, and how it goes on with time.
    Relaxation,
    /// Between stiffness and file.
    Reading,
}

/// What a simulation of the spring may get wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "`Facts::name` says it")]
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
}

/// What is known of a cause before any record.
#[derive(Debug)]
pub struct Facts {
    /// As in the findings of `vsj diagnose`.
    pub name: &'static str,
    /// Where it acts.
    pub block: Block,
    /// Names of its parameters in a finding, in the order of [`Effect::values`](super::Effect::values).
    pub parameters: &'static [&'static str],
    /// Physical forms, the plain reading of the cause's words first.
    pub forms: &'static [&'static str],
    /// What its smallness is measured by.
    pub measure: Measure,
    /// It shows in steps only, not in a sweep.
    pub needs_steps: bool,
    /// Numbers that a test told the structure still has to find: its degrees of freedom.
    pub unknowns: usize,
}

/// The number that goes to nothing with the effect.
#[derive(Debug)]
pub struct Measure {
    /// Which of the values.
    pub value: usize,
    /// From the value's distance to no effect, to `unit`.
    pub factor: f64,
    /// With what it is, where the name of the cause doesn't say it.
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

/// In the order of [`Cause::ALL`].
static FACTS: [Facts; 18] = facts! {
    "gain-error" Static ["gain"], ["gain"], 0 * 1.0 "of 1", false, 1;
    "instantaneous-share" Relaxation ["share"], ["share"], 0 * 1.0 "beside 1/11", true, 1;
    "time-constant" Relaxation ["tau_s"], ["tau"], 0 * 1.0 "s beside 5.5 s", false, 1;
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
};

impl Cause {
    /// All of them, in the order of `vsj diagnose`'s table.
    pub const ALL: [Self; 18] = [
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
    ];

    /// What is known of it.
    pub fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }

    /// As in the findings of `vsj diagnose`.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Where it acts.
    pub fn block(self) -> Block {
        self.facts().block
    }

    /// The cause of that name.
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
    fn facts_stand_in_the_order_of_the_causes() {
        for (index, cause) in Cause::ALL.into_iter().enumerate() {
            assert_eq!(cause as usize, index);
            assert_eq!(Cause::named(cause.name()), Some(cause));
            // GainError is `gain-error`.
            let words: String = cause.name().split('-').collect();
            assert_eq!(format!("{cause:?}").to_lowercase(), words);
        }
    }
}
