//! Stand-ins without values, built without the feature `robust`.

use core::convert::Infallible;
use core::marker::PhantomData;

use super::Aim;
use crate::amplifier::Amplifier;
use crate::error::OutOfRange;
use crate::estimator::{Estimator, Invertible};
use crate::feedback::{self, Observed};
use crate::units::{SampleTime, Volts};
use crate::validated::{Validate, Validated};

/// Settings of the robust pre-compensator; without the feature `robust` they have no values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Margin {}

/// The robust pre-compensator; without the feature `robust` it has no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Robust<E> {
    never: Infallible,
    estimator: PhantomData<E>,
}

/// State of the robust pre-compensator; without the feature `robust` it is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State<S>(PhantomData<S>);

impl<S> Default for State<S> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl Margin {
    /// Returns `None`: without the feature `robust` there is no robust pre-compensator.
    pub const fn from_values(_values: [f64; 5]) -> Option<Self> {
        None
    }

    /// Returns the settings in the order of their fields; without the feature `robust` it is never called.
    pub const fn values(&self) -> [f64; 5] {
        match *self {}
    }

    pub(crate) fn factors(&self) -> (f64, f64) {
        match *self {}
    }
}

impl Validate for Margin {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        match *self {}
    }
}

impl Validated<'_, Margin> {
    pub(crate) fn quantize<E: Estimator>(self, _: Invertible<E>, _: &Amplifier) -> Robust<E> {
        match *self.settings() {}
    }
}

impl<E: Estimator> Robust<E> {
    pub(crate) fn voltage(
        &self,
        _: &mut State<E::State>,
        _: Aim,
        _: Option<(&feedback::Config, &feedback::State, Observed)>,
    ) -> Volts {
        match self.never {}
    }

    pub(crate) fn run(&self, _: &mut State<E::State>, _: Volts) {
        match self.never {}
    }

    pub(crate) fn transfer(&self, _: &mut State<E::State>, _: Aim, _: &E::State, _: bool) {
        match self.never {}
    }
}
