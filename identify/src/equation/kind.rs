//! The kinds of operators, and their codes in reports.

use crate::equation::curve::Curve;
use crate::equation::lag::By;

/// The kind of an operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A lag of constant time constant.
    Lag,
    /// A lag whose time constant varies.
    Varying(By),
    /// A second order of any damping.
    Second,
    /// Creep as a power of the time.
    Creep,
    /// A play operator on a part of the signal.
    Play,
    /// A lag over the travelled distance on a part of the signal.
    Travel,
    /// A gain that depends on the direction.
    Direction,
    /// A static curve.
    Curve(Curve),
    /// A delay.
    Delay,
    /// A bounded rate of change.
    Slew,
    /// A gain that swings with time.
    Swing,
    /// A gain that grows with time.
    Grow,
    /// A gain that steps at a time.
    Step,
    /// The product with one plus a chain: `x (1 + a chain(x) / full scale)`.
    Times,
    /// The weighted sum of chains: `sum_i a_i chain_i(x)`.
    Parallel,
}

impl Kind {
    /// Returns the code of the kind in reports.
    pub fn code(self) -> &'static str {
        match self {
            Self::Lag => "lag",
            Self::Varying(By::Direction) => "lag-by-direction",
            Self::Varying(By::State) => "lag-by-state",
            Self::Varying(By::Input) => "lag-by-input",
            Self::Varying(By::Distance) => "lag-by-distance",
            Self::Second => "second-order",
            Self::Creep => "creep",
            Self::Play => "play",
            Self::Travel => "drag",
            Self::Direction => "direction-gain",
            Self::Curve(Curve::Square) => "square",
            Self::Curve(Curve::Cube) => "cube",
            Self::Curve(Curve::Even) => "even",
            Self::Curve(Curve::Power) => "power",
            Self::Curve(Curve::Tanh) => "soft-limit",
            Self::Curve(Curve::Limit) => "limit",
            Self::Curve(Curve::Floor) => "floor",
            Self::Curve(Curve::DeadBand) => "dead-band",
            Self::Delay => "delay",
            Self::Slew => "slew",
            Self::Swing => "periodic-gain",
            Self::Grow => "growing-gain",
            Self::Step => "stepping-gain",
            Self::Times => "product",
            Self::Parallel => "sum",
        }
    }
}
