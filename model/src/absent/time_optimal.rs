//! In the place of the time-optimal pre-compensator where the crate is built without its feature: nobody can ask for it,
//! and whoever matches on it pays nothing.

use core::convert::Infallible;
use core::marker::PhantomData;

use crate::error::OutOfRange;
use crate::estimator::{Estimator, Promptness};
use crate::units::{SampleTime, Volts};

/// There is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Approach {}

/// There is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOptimal<I> {
    never: Infallible,
    inverse: PhantomData<I>,
}

/// Nothing to remember.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State;

impl Approach {
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        match *self {}
    }
}

impl<I: Copy> TimeOptimal<I> {
    pub(crate) fn new(approach: &Approach, _: I, _: &Promptness, _: Option<(Promptness, f64)>, _: SampleTime) -> Self {
        match *approach {}
    }

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

    pub(crate) fn align<E: Estimator<Inverse = I>>(&self, _: &mut State, _: Volts, _: &E, _: &E::State, _: Volts) {
        match self.never {}
    }
}
