//! Random target voltages.

use model::Volts;
use model::units::Signal;

/// The voltage of a drawn number, 0 to 511 V.
pub fn volts(drawn: u32) -> Volts {
    Volts(Signal::from_bits((drawn >> 3) as i32))
}
