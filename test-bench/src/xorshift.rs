//! Random numbers that are the same on every machine.

use model::Volts;
use model::units::Signal;

/// Xorshift generator (Marsaglia, 13-17-5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Xorshift(u32);

impl Xorshift {
    /// A generator with a seed; 0 counts as 1.
    pub const fn new(seed: u32) -> Self {
        Self(if seed == 0 { 1 } else { seed })
    }

    /// Draws a number, 1 to 2^32 - 1.
    pub fn draw(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// Draws a target, 0 to 511 V.
    pub fn target(&mut self) -> Volts {
        volts(self.draw())
    }
}

/// The voltage of a drawn number, 0 to 511 V.
pub fn volts(drawn: u32) -> Volts {
    Volts(Signal::from_bits((drawn >> 3) as i32))
}
