//! The causes that the bank distinguishes, by their codes.

use crate::error::OutOfRange;

/// A fault that explains the difference between the readings and the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Cause {
    /// The static gain differs from the model's; size: relative difference.
    GainError,
    /// The instantaneous share differs; size: difference of the share.
    InstantaneousShare,
    /// The relaxation time differs; size: natural logarithm of the ratio to the model's.
    TimeConstant,
    /// The relaxation time changes with the voltage; size: its relative change over the range.
    VoltageDependentTimeConstant,
    /// Part of the response has a slower time constant; size: that share.
    SecondRelaxation,
    /// The stiffness decreases while the voltage stays; size: share that is lost.
    ChargeLeakage,
    /// Rate-independent memory; size: width between the branches, in V.
    Hysteresis,
    /// The sensitivity depends on the voltage; size: deviation from the straight line at half of the range, in V.
    StaticNonlinearity,
    /// The real voltage stops below the commanded one; size: voltage missing at the top of the range, in V.
    AmplifierLimit,
    /// The real voltage changes at a bounded rate; size: reciprocal of the rate, in s/V.
    AmplifierSlew,
    /// The response starts late; size: delay, in s.
    Delay,
    /// A further lag in series; size: its time constant, in s.
    SeriesLag,
    /// The readings are shifted by a constant; size: offset, in V.
    ReadingOffset,
    /// The response grows or fades with time; size: relative change per s.
    Drift,
    /// The readings stop at a bound; size: 1.
    SensorSaturation,
    /// The readings do not change; size: 1.
    StuckSensor,
}

impl Cause {
    /// All causes, in the order of their numbers.
    pub const ALL: [Self; 16] = [
        Self::GainError,
        Self::InstantaneousShare,
        Self::TimeConstant,
        Self::VoltageDependentTimeConstant,
        Self::SecondRelaxation,
        Self::ChargeLeakage,
        Self::Hysteresis,
        Self::StaticNonlinearity,
        Self::AmplifierLimit,
        Self::AmplifierSlew,
        Self::Delay,
        Self::SeriesLag,
        Self::ReadingOffset,
        Self::Drift,
        Self::SensorSaturation,
        Self::StuckSensor,
    ];

    /// Returns the cause with this code; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Returns the unit of the size; empty for a ratio.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Hysteresis | Self::StaticNonlinearity | Self::AmplifierLimit | Self::ReadingOffset => "V",
            Self::AmplifierSlew => "s/V",
            Self::Delay | Self::SeriesLag => "s",
            Self::Drift => "1/s",
            _ => "",
        }
    }

    /// Returns the cause code, as in the findings of `vsj diagnose`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::GainError => "gain-error",
            Self::InstantaneousShare => "instantaneous-share",
            Self::TimeConstant => "time-constant",
            Self::VoltageDependentTimeConstant => "voltage-dependent-time-constant",
            Self::SecondRelaxation => "second-relaxation",
            Self::ChargeLeakage => "charge-leakage",
            Self::Hysteresis => "hysteresis",
            Self::StaticNonlinearity => "static-nonlinearity",
            Self::AmplifierLimit => "amplifier-limit",
            Self::AmplifierSlew => "amplifier-slew",
            Self::Delay => "delay",
            Self::SeriesLag => "series-lag",
            Self::ReadingOffset => "reading-offset",
            Self::Drift => "drift",
            Self::SensorSaturation => "sensor-saturation",
            Self::StuckSensor => "stuck-sensor",
        }
    }
}

const _: () = assert!(Cause::ALL.len() == 16, "the bits of a set are those of an u16");

/// A set of causes: one bit for each, bit 0 for the first of [`Cause::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Causes(u16);

impl Causes {
    /// The empty set.
    pub const NONE: Self = Self(0);

    /// Returns the set of the causes that have a bit in `bits`: each of the 16 has one.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// Returns one bit for each cause of the set.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Returns the set with `cause` in it.
    pub const fn with(self, cause: Cause) -> Self {
        Self(self.0 | 1 << cause as u16)
    }

    /// Returns true if `cause` is in the set.
    pub const fn contains(self, cause: Cause) -> bool {
        self.0 & 1 << cause as u16 != 0
    }

    /// Returns true if the set has no cause.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Checks that the set, which is the setting `trip_on_cause`, is empty; `causes` says in the error which ones cannot be in it.
    ///
    /// # Errors
    /// [`OutOfRange`] with the number of causes.
    pub fn check_none(self, causes: &'static str) -> Result<(), OutOfRange> {
        OutOfRange::check_count("trip_on_cause", self.iter().count(), 0..=0, causes)
    }

    /// Returns the causes of the set, in the order of their numbers.
    pub fn iter(self) -> impl Iterator<Item = Cause> {
        Cause::ALL.into_iter().filter(move |cause| self.contains(*cause))
    }
}
