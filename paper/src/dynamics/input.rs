//! What drives a model: a level over time, straight pieces with jumps between them.
//!
//! A schedule whose voltage is the level.

use std::path::Path;

use anyhow::Result;

use simulation::bad_input;
use simulation::bad_input::{check, number};
use simulation::record::{MEASURED, Record};
use simulation::schedule::{Between, Piece, Schedule};

/// The report's parameters of section 8.2.1.
const REPORT: &str = include_str!("../../../data/section821_input.csv");

/// A level over time.
#[derive(Clone, Debug)]
pub struct Input {
    /// What it is called in messages.
    pub name: String,
    schedule: Schedule,
}

impl Input {
    /// The report's levels 1, 4, 7 and 1, 30 s each.
    ///
    /// # Errors
    /// If the file that was built in is damaged.
    pub fn report() -> Result<Self> {
        let record = Record::parse("data/section821_input.csv", REPORT, MEASURED)?;
        Ok(Self { name: "section 8.2.1".to_owned(), schedule: Schedule::from_record(&record, Between::Linear) })
    }

    /// `report`, `stair`, or a file with columns `time_s,voltage_v`.
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

    /// Levels that jump, each held until the next moment; the last of at least two moments ends it.
    pub fn held(moments: &[(f64, f64)]) -> Self {
        Self { name: "levels".to_owned(), schedule: Schedule::new(moments.to_vec(), Between::Hold) }
    }

    /// The straight pieces, in order.
    pub fn pieces(&self) -> &[Piece] {
        self.schedule.pieces()
    }

    /// From the first moment to the last, in s.
    pub fn duration_s(&self) -> f64 {
        self.schedule.end_s() - self.schedule.start_s()
    }

    /// The first level.
    pub fn first(&self) -> f64 {
        self.pieces().first().map_or(0.0, |piece| piece.from_v)
    }

    /// Checks that a model whose fastest change takes `shortest_s` can be followed, a row every `every_s`.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for more than a million rows, or a change faster than a hundred thousandth of the input.
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

    /// The highest level.
    pub fn highest(&self) -> f64 {
        self.pieces().iter().flat_map(|piece| [piece.from_v, piece.to_v]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Checks that every level can be a stiffness.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the first level that is not positive.
    pub fn check_positive(&self) -> Result<()> {
        for piece in self.pieces() {
            for (time, level) in [(piece.start_s, piece.from_v), (piece.end_s, piece.to_v)] {
                if level.is_nan() || level <= 0.0 {
                    bad_input!(
                        "{}: level {} at {} s is no stiffness; expected more than 0 (or the model pi-plant)",
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

/// Steps through a piece: start and length of each, all but the last `every_s` long.
fn steps(piece: &Piece, every_s: f64) -> impl Iterator<Item = (f64, f64)> {
    let (start, end) = (piece.start_s, piece.end_s);
    let count = ((end - start) / every_s - 1e-9).ceil().max(1.0) as usize;
    let at = move |index: usize| if index < count { start + every_s * index as f64 } else { end };
    (0..count).map(move |index| (at(index), at(index + 1) - at(index)))
}

/// Follows a state `y` through an input: `step(piece, t, y, h)` makes one step. Returns the moments asked for, which are
/// `every_s` apart, and every end of a piece, as (time, level, y); at a jump the time comes twice.
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
