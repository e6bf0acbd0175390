//! In the place of measured feedback where the crate is built without its feature: nobody can ask for it, and whoever
//! matches on it pays nothing.

use crate::error::OutOfRange;
use crate::units::{SampleTime, ScaledStiffness, Volts};

/// There is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feedback {}

/// Nobody listens to any.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {}

/// Nobody thinks anything of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {}

/// There is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Config {}

/// Nothing to remember.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State;

impl Feedback {
    pub(crate) fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        match *self {}
    }
}

impl Reading {
    /// Nobody listens.
    pub fn fresh(_: ScaledStiffness) -> Option<Self> {
        None
    }
}

impl Sensor {
    /// It has none.
    pub const fn name(self) -> &'static str {
        match self {}
    }
}

impl Config {
    pub(crate) fn new(feedback: &Feedback, _: SampleTime) -> Self {
        match *feedback {}
    }

    pub(crate) fn hear(&self, _: &mut State, _: Volts, _: Option<Reading>) -> Volts {
        match *self {}
    }

    pub(crate) fn correct(&self, _: &mut State, _: ScaledStiffness) -> (ScaledStiffness, Option<Sensor>) {
        match *self {}
    }
}

impl State {
    pub(crate) fn adopted_by(&mut self, _: Option<&Config>) {}

    pub(crate) fn corrected(&self, target: Volts) -> Volts {
        target
    }

    /// Nothing.
    pub fn correction(&self) -> ScaledStiffness {
        ScaledStiffness::default()
    }
}
