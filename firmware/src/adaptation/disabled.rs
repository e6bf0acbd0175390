//! Stand-ins without values, built without the feature `adaptation`.

use link::adaptation::Adaptation as Request;
use link::isolation::Off;
use link::{AdaptationReport, Reply};
use model::{Amplifier, Input, Output, Reading, ScaledStiffness, Volts, device};

use crate::control::{Control, Tick};
use crate::isolation::{self, Isolation};

/// The gain of the spring; without the feature `adaptation` it is 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Scale;

impl Scale {
    /// Returns the stiffness as it is.
    #[inline(always)]
    pub fn inward(&self, stiffness: ScaledStiffness) -> ScaledStiffness {
        stiffness
    }

    /// Returns the input as it is.
    #[inline(always)]
    pub fn input(&self, target: Volts, measured: Option<ScaledStiffness>) -> Input {
        Input { target, measured: measured.and_then(Reading::fresh) }
    }

    /// Returns the output as it is.
    #[inline(always)]
    pub fn output(&self, output: Output) -> Output {
        output
    }
}

/// What the adaptation starts from; without the feature `adaptation` there is nothing.
#[derive(Clone, Copy, Debug)]
pub struct Terms;

impl Terms {
    /// Without the feature `adaptation` nothing adapts.
    pub fn new(_: &device::Settings, _: Amplifier, _: &isolation::Terms) -> Self {
        Self
    }
}

/// The planner; without the feature `adaptation` it is empty.
#[derive(Debug)]
pub struct Planner;

impl Planner {
    /// An empty planner.
    pub fn begin() -> Self {
        Self
    }
}

/// Without the feature `adaptation` nothing is shared.
pub fn set_terms(_: Terms) {}

/// Without the feature `adaptation` nothing is watched.
#[inline(always)]
pub fn after_tick(_: &mut Control, _: &mut Isolation, _: &Tick, _: u64) {}

/// Without the feature `adaptation` there is nothing to plan.
pub fn serve(_: &mut Planner) {}

/// Replies that the image is built without the adaptation.
pub async fn execute(_: Request, tick: u64) -> Reply {
    Reply::Adaptation(AdaptationReport::off(Off::NotBuiltIn, tick))
}
