//! Stand-ins without values, built without the feature `feedback`.

use super::Observed;
use crate::error::OutOfRange;
#[cfg(feature = "robust")]
use crate::units::Accumulator;
use crate::units::{SampleTime, ScaledStiffness, Signal, Volts};
use crate::validated::{Validate, Validated};

/// Settings of the stiffness sensor; without the feature `feedback` they have no values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feedback {}

/// A reading of the stiffness sensor; without the feature `feedback` it has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {}

/// Whether the stiffness sensor is trusted; without the feature `feedback` it has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {}

/// The quantized correction; without the feature `feedback` it has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Config {}

/// State of the correction; without the feature `feedback` it is empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State;

impl Feedback {
    /// Returns `None`: without the feature `feedback` nothing is corrected.
    pub const fn from_values(_values: [f64; 8]) -> Option<Self> {
        None
    }

    /// Returns the settings in the order of their fields; without the feature `feedback` it is never called.
    pub const fn values(&self) -> [f64; 8] {
        match *self {}
    }
}

impl Validate for Feedback {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        match *self {}
    }
}

impl Validated<'_, Feedback> {
    pub(crate) fn quantize(self, _: bool) -> Config {
        match *self.settings() {}
    }
}

impl Reading {
    /// Returns `None`: without the feature `feedback` there are no readings.
    pub fn fresh(_: ScaledStiffness) -> Option<Self> {
        None
    }
}

impl Sensor {
    /// Returns the name for logs; without the feature `feedback` it is never called.
    pub const fn name(self) -> &'static str {
        match self {}
    }

    /// Returns true for a sensor that is trusted; without the feature `feedback` it is never called.
    pub const fn is_trusted(self) -> bool {
        match self {}
    }

    /// Returns the number for frames; without the feature `feedback` it is never called.
    pub const fn code(self) -> u8 {
        match self {}
    }
}

impl Config {
    pub(crate) fn update(&self, _: &mut State, _: Volts, _: Option<Reading>) -> (Volts, Observed) {
        match *self {}
    }

    #[cfg(feature = "robust")]
    pub(crate) fn follow(&self, _: &State, _: Observed, _: &mut Accumulator, _: Signal) {
        match *self {}
    }

    pub(crate) fn estimate(&self, _: &mut State, _: ScaledStiffness) -> (ScaledStiffness, Option<Sensor>) {
        match *self {}
    }
}

impl State {
    pub(crate) fn transfer_to(&mut self, _: Option<&Config>) {}

    pub(crate) fn shift(&mut self, _: Signal) {}

    pub(crate) fn corrected(&self, target: Volts) -> Volts {
        target
    }

    pub(crate) fn is_trusted(&self) -> bool {
        false
    }

    /// Returns 0 V: without the feature `feedback` nothing is corrected.
    pub fn correction(&self) -> ScaledStiffness {
        ScaledStiffness::default()
    }
}
