//! Input and output of a tick as C has them. Voltages are integers in steps of 2^-20 V.

use model::units::Signal;
use model::{Input, Reading, ScaledStiffness, Volts};

/// `vsj_input`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickInput {
    /// Desired stiffness.
    pub target: i32,
    /// Latest reading of the stiffness sensor.
    pub reading: i32,
    /// Whole ticks since the sensor sampled.
    pub reading_age: u16,
    /// 0 if there is no reading.
    pub has_reading: u16,
}

impl TickInput {
    /// The input of the tick.
    pub fn input(&self) -> Input {
        Input { target: Volts(Signal::from_bits(self.target)), measured: self.measured() }
    }

    /// The reading, if there is one.
    pub fn measured(&self) -> Option<Reading> {
        if self.has_reading == 0 {
            return None;
        }
        reading(ScaledStiffness(Signal::from_bits(self.reading)), self.reading_age)
    }
}

#[cfg(feature = "feedback")]
fn reading(stiffness: ScaledStiffness, age: u16) -> Option<Reading> {
    Some(Reading { stiffness, age })
}

#[cfg(not(feature = "feedback"))]
fn reading(_: ScaledStiffness, _: u16) -> Option<Reading> {
    None
}

/// `vsj_output`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickOutput {
    /// The target, moved into the amplifier's range.
    pub target: i32,
    /// Voltage before rounding to a code.
    pub voltage: i32,
    /// Voltage of the code.
    pub applied: i32,
    /// Estimated stiffness.
    pub stiffness: i32,
    /// Code for the DAC.
    pub code: u16,
    /// Limits that acted.
    pub limits: u8,
    /// Whether the sensor is trusted.
    pub sensor: u8,
}

impl From<model::Output> for TickOutput {
    fn from(output: model::Output) -> Self {
        Self {
            target: output.target.0.to_bits(),
            voltage: output.voltage.0.to_bits(),
            applied: output.applied.0.to_bits(),
            stiffness: output.stiffness.0.to_bits(),
            code: output.code.0,
            limits: output.limits.bits(),
            sensor: output.sensor.map_or(0, |sensor| sensor.code()),
        }
    }
}
