//! Stand-ins without values, built without the feature `time-optimal`.

use core::convert::Infallible;
use core::marker::PhantomData;

use crate::error::OutOfRange;
use crate::estimator::{Estimator, Invertible};
use crate::units::{SampleTime, Volts};
use crate::validated::{Validate, Validated};

/// Settings of the time-optimal pre-compensator; without the feature `time-optimal` they have no values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Approach {}

/// The time-optimal pre-compensator; without the feature `time-optimal` it has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOptimal<I> {
    never: Infallible,
    inverse: PhantomData<I>,
}

/// State of the time-optimal pre-compensator; without the feature `time-optimal` it is empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State;

impl Approach {
    /// Returns `None`: without the feature `time-optimal` there is no time-optimal pre-compensator.
    pub const fn new(_time_constant_s: f64) -> Option<Self> {
        None
    }

    /// Returns the time constant of the last part of the way, in s; without the feature `time-optimal` it is never called.
    pub const fn time_constant_s(&self) -> f64 {
        match *self {}
    }
}

impl Validate for Approach {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        match *self {}
    }
}

impl Validated<'_, Approach> {
    pub(crate) fn quantize<E: Estimator>(self, _: &Invertible<E>, _: Option<f64>) -> TimeOptimal<E::Inverse> {
        match *self.settings() {}
    }
}

impl<I: Copy> TimeOptimal<I> {
    pub(crate) fn voltage<E: Estimator<Inverse = I>>(
        &self,
        _: &mut State,
        _: Volts,
        _: &E,
        _: &E::State,
        _: Volts,
        _: Volts,
    ) -> Volts {
        match self.never {}
    }

    pub(crate) fn preset_offset<E: Estimator>(&self, _: &mut State, _: Volts, _: &E, _: &E::State, _: Volts) {
        match self.never {}
    }
}
