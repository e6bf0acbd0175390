//! Turns of the voltage, and how often samples arrive to find them.

use std::cmp::Ordering;

use link::WireVolts;

/// Bits of the line that a sample takes, start and stop bits included: the longest frame and a share for the answers.
const SAMPLE_BITS: f64 = 460.0;

/// How often the MCU sends a sample, and how often one becomes a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Every {
    /// Ticks between two samples.
    pub sample_ticks: u16,
    /// Ticks between two rows, a multiple of `sample_ticks`.
    pub row_ticks: u16,
}

impl Every {
    /// For `rows_hz` rows per second of an MCU with `rate_hz` ticks per second, and samples more often as far as a line of `baud`
    /// bit/s carries them.
    pub fn at(rows_hz: f64, rate_hz: u32, baud: u32) -> Self {
        let bounded = |ticks: f64| ticks.clamp(1.0, f64::from(u16::MAX)) as u16;
        let rate_hz = f64::from(rate_hz);
        Self::new(bounded((rate_hz / rows_hz).round()), bounded((rate_hz * SAMPLE_BITS / f64::from(baud)).ceil()))
    }

    /// The shortest time between samples that divides the time between rows and is at least `line_ticks`, which a line needs
    /// for a sample.
    pub fn new(row_ticks: u16, line_ticks: u16) -> Self {
        let divides = |ticks: &u16| row_ticks.is_multiple_of(*ticks);
        let sample_ticks = (line_ticks.max(1)..row_ticks).find(divides).unwrap_or(row_ticks);
        Self { sample_ticks, row_ticks }
    }
}

/// A sample at which the voltage turns.
pub(super) struct Turn {
    /// True if samples are missing next to it: the extreme value may be among them.
    pub(super) has_gap: bool,
}

/// Follows the voltage from sample to sample.
pub(super) struct Turns {
    /// Direction of the last change, up or down; equal before the first one.
    direction: Ordering,
    /// True if samples are missing in the last change.
    has_gap: bool,
}

impl Default for Turns {
    fn default() -> Self {
        Self { direction: Ordering::Equal, has_gap: false }
    }
}

impl Turns {
    /// Follows the voltage from one sample to the next, between which samples are missing if `has_gap`; returns whether it
    /// turns at the former.
    pub(super) fn next(&mut self, from: WireVolts, to: WireVolts, has_gap: bool) -> Option<Turn> {
        let direction = to.0.cmp(&from.0);
        if direction == Ordering::Equal {
            self.has_gap |= has_gap;
            return None;
        }
        let before = std::mem::replace(self, Self { direction, has_gap });
        (before.direction == direction.reverse()).then_some(Turn { has_gap: before.has_gap || has_gap })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_arrive_as_often_as_the_line_permits_and_fall_on_every_row() {
        for (row_ticks, line_ticks, sample_ticks) in
            [(10, 4, 5), (10, 1, 1), (4, 4, 4), (7, 4, 7), (1, 4, 1), (100, 4, 4)]
        {
            assert_eq!(Every::new(row_ticks, line_ticks), Every { sample_ticks, row_ticks }, "{row_ticks}");
        }
    }
}
