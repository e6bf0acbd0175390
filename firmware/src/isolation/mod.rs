//! Fault isolation after each control tick: the bank of [`model::isolation`] with the readings of the stiffness sensor.
//!
//! After the output of each tick is written, [`Isolation::tick`] gives the bank the voltage and the model of the tick before and the
//! reading that belongs to them. What the bank says goes into the log and to the host; it changes no voltage, unless the setting
//! `trip_on_cause` makes the naming of a cause a fault, which [`Isolation::begin`] returns.
//!
//! While the output is off the voltage at the spring is not known: readings are left out then.
//!
//! Without the feature `isolation` there are stand-ins of the same names without values.

#[cfg(not(feature = "isolation"))]
mod disabled;
#[cfg(feature = "isolation")]
mod enabled;
#[cfg(all(feature = "isolation", feature = "mcu"))]
mod shared;
#[cfg(all(feature = "isolation", test))]
pub(crate) mod tests;

#[cfg(not(feature = "isolation"))]
pub use disabled::*;
#[cfg(feature = "isolation")]
pub use enabled::*;
#[cfg(all(feature = "isolation", feature = "mcu"))]
pub use shared::*;
