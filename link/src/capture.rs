//! The fast capture: every tick in a row of RAM, read by the host afterwards.
//!
//! A row has two words, so that ten seconds at 1 kHz need 80 KB:
//!
//! | bits | first word | second word |
//! | --- | --- | --- |
//! | 0 to 15 | DAC code | stiffness in steps of 2^-20 V: |
//! | 16 to 19 | active limits | measured if bit 22 is set, |
//! | 20 and 21 | state | otherwise estimated |
//! | 22 | a reading of the sensor | |
//! | 24 to 31 | ticks missed before this one, at most 255 | |

use serde::{Deserialize, Serialize};

use crate::telemetry::{State, Telemetry};
use crate::value::WireVolts;

/// Number of rows in a reply.
pub const ROWS: usize = 13;

/// Request of the host about the capture. The order of the variants defines their codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Capture {
    /// Captures this number of ticks from the next one on, in place of an earlier capture; 0 ends it.
    Start {
        /// Number of rows.
        rows: u32,
    },
    /// Reads how far the capture is.
    State,
    /// Reads [`ROWS`] rows.
    Read {
        /// Number of the first row, counted from 0.
        first: u32,
    },
}

/// How far a capture is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Captured {
    /// Number of rows for which the MCU has room.
    pub most: u32,
    /// Number of rows that were asked for.
    pub wanted: u32,
    /// Number of rows that are complete.
    pub captured: u32,
}

/// Some rows of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rows {
    /// Number of the first row.
    pub first: u32,
    /// Number of rows that are valid; the others are zero.
    pub count: u8,
    /// The rows, low byte first.
    pub rows: [[u8; 8]; ROWS],
}

/// One tick of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Code written to the DAC.
    pub code: u16,
    /// Active limits, see [`Telemetry::limits`].
    pub limits: u8,
    /// State of the output.
    pub state: State,
    /// Whether `stiffness` is a reading of the sensor, otherwise the estimate.
    pub measured: bool,
    /// Ticks missed just before this one, at most 255.
    pub missed: u8,
    /// Stiffness as equivalent static voltage.
    pub stiffness: WireVolts,
}

impl Row {
    /// The row of a tick.
    #[inline]
    pub fn new(sample: &Telemetry, missed_ticks: u32) -> Self {
        Self {
            code: sample.code,
            limits: sample.limits,
            state: sample.state,
            measured: sample.measured.is_some(),
            missed: missed_ticks.min(255) as u8,
            stiffness: sample.measured.unwrap_or(sample.estimate),
        }
    }

    /// The row as two words.
    #[inline]
    pub const fn pack(&self) -> [u32; 2] {
        let Self { code, limits, state, measured, missed, stiffness } = *self;
        let flags = (limits & 0xf) as u32 | (state as u32) << 4 | (measured as u32) << 6 | (missed as u32) << 8;
        [code as u32 | flags << 16, stiffness.0 as u32]
    }

    /// The row of two words.
    pub const fn unpack([first, second]: [u32; 2]) -> Self {
        Self {
            code: first as u16,
            limits: (first >> 16) as u8 & 0xf,
            state: match first >> 20 & 3 {
                0 => State::Disarmed,
                1 => State::Armed,
                2 => State::Ramping,
                _ => State::Faulted,
            },
            measured: first >> 22 & 1 != 0,
            missed: (first >> 24) as u8,
            stiffness: WireVolts(second as i32),
        }
    }
}

impl Rows {
    /// Rows from number `first` on, of the `captured` ones that `row` returns.
    pub fn read(first: u32, captured: u32, row: impl Fn(u32) -> [u32; 2]) -> Self {
        let count = captured.saturating_sub(first).min(ROWS as u32) as u8;
        let mut rows = [[0; 8]; ROWS];
        for (number, place) in (first..captured).zip(&mut rows) {
            let [low, high] = row(number).map(u32::to_le_bytes);
            let [a, b, c, d] = low;
            let [e, f, g, h] = high;
            *place = [a, b, c, d, e, f, g, h];
        }
        Self { first, count, rows }
    }

    /// The valid rows.
    pub fn iter(&self) -> impl Iterator<Item = Row> {
        let row = |&[a, b, c, d, e, f, g, h]: &[u8; 8]| {
            Row::unpack([u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])])
        };
        self.rows.iter().take(usize::from(self.count)).map(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn a_row_keeps_its_values(
            code: u16, limits in 0..16u8, state in 0..4usize, measured: bool, missed: u8, stiffness: i32,
        ) {
            let state = [State::Disarmed, State::Armed, State::Ramping, State::Faulted][state];
            let row = Row { code, limits, state, measured, missed, stiffness: WireVolts(stiffness) };
            prop_assert_eq!(Row::unpack(row.pack()), row);
        }
    }

    #[test]
    fn a_row_has_the_layout_that_the_module_shows() {
        let state = State::Ramping;
        let row = Row { code: 0x1234, limits: 5, state, measured: true, missed: 0xab, stiffness: WireVolts(-2) };
        assert_eq!(row.pack(), [0xab65_1234, 0xffff_fffe]);
    }

    #[test]
    fn a_row_has_the_reading_if_there_is_one_and_counts_missed_ticks_up_to_255() {
        let sample = Telemetry { estimate: WireVolts(5), measured: Some(WireVolts(-7)), ..Telemetry::default() };
        let row = Row::new(&sample, 3);
        assert_eq!((row.stiffness, row.measured, row.missed), (WireVolts(-7), true, 3));
        let row = Row::new(&Telemetry { measured: None, ..sample }, 300);
        assert_eq!((row.stiffness, row.measured, row.missed), (WireVolts(5), false, 255));
    }

    #[test]
    fn rows_are_read_up_to_the_last_one() {
        let row = |number: u32| Row { code: number as u16, ..Row::unpack([0; 2]) }.pack();
        for (first, captured, expected) in [
            (0, 0, 0..0),
            (0, 5, 0..5),
            (3, 5, 3..5),
            (5, 5, 0..0),
            (9, 5, 0..0),
            (10, 100, 10..23),
            (u32::MAX, u32::MAX, 0..0),
        ] {
            let rows = Rows::read(first, captured, row);
            let codes: Vec<u16> = rows.iter().map(|row| row.code).collect();
            assert_eq!(codes, expected.collect::<Vec<u16>>(), "{first} of {captured}");
            assert_eq!((rows.first, usize::from(rows.count)), (first, codes.len()));
        }
    }
}
