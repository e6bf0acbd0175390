//! The input of a dynamic model: a dimensionless level over time, piecewise linear with jumps.
//!
//! It is a schedule whose voltage is the level.

use std::path::Path;

use anyhow::Result;

use simulation::bad_input;
use simulation::bad_input::{check, number};
use simulation::record::{MEASURED, Record};
use simulation::schedule::{Between, Piece, Schedule};

/// The report's input of section 8.2.1.
const REPORT: &str = include_str!("../../../data/section821_input.csv");

/// A level over time.
#[derive(Clone, Debug)]
pub struct Input {
    /// Name of the input in messages.
    pub name: String,
    schedule: Schedule,
}

impl Input {
    /// The report's input: levels 1, 4, 7 and 1, each for 30 s.
    ///
    /// # Errors
    /// If the built-in data file is damaged.
    pub fn report() -> Result<Self> {
        let record = Record::parse("data/section821_input.csv", REPORT, MEASURED)?;
        Ok(Self { name: "section 8.2.1".to_owned(), schedule: Schedule::from_record(&record, Between::Linear) })
    }

    /// Opens the input `report`, `stair`, or a file with the columns `time_s,voltage_v`.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for a bad file.
    pub fn open(name: &str, between: Between) -> Result<Self> {
        match name {
            "report" => Self::report(),
            "stair" => Ok(Self { name: "the stair".to_owned(), schedule: Schedule::stair() }),
            file => {
                let record = Record::open(Path::new(file), MEASURED)?;
                Ok(Self { name: file.to_owned(), schedule: Schedule::from_record(&record, between) })
            }
        }
    }

    /// Levels that jump at the given times in s and hold until the next one; the last of at least two times ends the
    /// input.
    pub fn held(moments: &[(f64, f64)]) -> Self {
        Self { name: "levels".to_owned(), schedule: Schedule::new(moments.to_vec(), Between::Hold) }
    }

    /// The linear pieces, in order of time.
    pub fn pieces(&self) -> &[Piece] {
        self.schedule.pieces()
    }

    /// Duration from the first time to the last, in s.
    pub fn duration_s(&self) -> f64 {
        self.schedule.end_s() - self.schedule.start_s()
    }

    /// Level at the start.
    pub fn first(&self) -> f64 {
        self.pieces().first().map_or(0.0, |piece| piece.from_v)
    }

    /// Checks that a response can be computed whose shortest time constant is `shortest_s` (s) and whose rows are
    /// `every_s` (s) apart.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for more than a million rows, or a time constant below 1e-5 of the duration.
    pub fn check_pace(&self, every_s: f64, shortest_s: f64) -> Result<()> {
        check("every_s", every_s, 1e-6..=1e6, "s")?;
        let duration = self.duration_s();
        let (name, whole) = (&self.name, number(duration));
        if duration / every_s > 1e6 {
            bad_input!("every_s = {every_s} is not allowed: expected at least a millionth of the {whole} s of {name}");
        }
        if duration / shortest_s > 1e5 {
            bad_input!(
                "the model's time constant of {} s is too short for {name}, which takes {whole} s: expected at least a \
                 hundred thousandth",
                number(shortest_s)
            );
        }
        Ok(())
    }

    /// Highest level.
    pub fn highest(&self) -> f64 {
        self.pieces().iter().flat_map(|piece| [piece.from_v, piece.to_v]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Checks that every level is positive, as a stiffness must be.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the first level that is not positive.
    pub fn check_positive(&self) -> Result<()> {
        for piece in self.pieces() {
            for (time, level) in [(piece.start_s, piece.from_v), (piece.end_s, piece.to_v)] {
                if level.is_nan() || level <= 0.0 {
                    bad_input!(
                        "{}: level {} at {} s is not a stiffness; expected more than 0 (or the model pi-plant)",
                        self.name,
                        number(level),
                        number(time)
                    );
                }
            }
        }
        Ok(())
    }
}

/// Splits a piece into steps, each with its start and length in s; all but the last are `every_s` long.
fn steps(piece: &Piece, every_s: f64) -> impl Iterator<Item = (f64, f64)> {
    let (start, end) = (piece.start_s, piece.end_s);
    let count = ((end - start) / every_s - 1e-9).ceil().max(1.0) as usize;
    let at = move |index: usize| if index < count { start + every_s * index as f64 } else { end };
    (0..count).map(move |index| (at(index), at(index + 1) - at(index)))
}

/// Integrates a state `y` over an input; `step(piece, t, y, h)` advances it by `h` seconds. Returns (time, level, y)
/// every `every_s` seconds and at both ends of every piece; at a jump the same time occurs twice.
pub(crate) fn follow(
    input: &Input,
    every_s: f64,
    start: f64,
    mut step: impl FnMut(&Piece, f64, f64, f64) -> f64,
) -> Vec<(f64, f64, f64)> {
    let (mut found, mut y) = (Vec::new(), start);
    for piece in input.pieces() {
        let jumps = |&(_, level, _): &(f64, f64, f64)| (level - piece.from_v).abs() > 1e-12 * (1.0 + level.abs());
        if found.last().is_none_or(jumps) {
            found.push((piece.start_s, piece.from_v, y));
        }
        for (t, h) in steps(piece, every_s) {
            y = step(piece, t, y, h);
            found.push((t + h, piece.at(t + h), y));
        }
    }
    found
}
