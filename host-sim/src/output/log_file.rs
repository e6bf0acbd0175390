//! The decoded firmware log as an MCAP or Parquet file: the columns of the CSV, and the numbers of the lines that have any.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use record_files::{Cell, Column, Container, Sheet, Writer};

use super::file::WholeFile;
use crate::log::{Event, Line};

const COLUMNS: &[Column] = &[
    Column::number("time_s", "s"),
    Column::text("level"),
    Column::text("event"),
    Column::text("message"),
    Column::whole("tick"),
    Column::whole("overruns"),
    Column::number("worst_lateness_us", "us"),
    Column::whole("limited_ticks"),
    Column::number("target_v", "V"),
    Column::number("applied_v", "V"),
    Column::number("estimate_v", "V"),
];

/// A log file that is being written; it has its name when it is complete.
pub struct LogFile {
    path: PathBuf,
    file: WholeFile,
    writer: Writer<BufWriter<File>>,
    /// Time of the last line, in ns, which a line without time takes over.
    time_ns: u64,
}

impl LogFile {
    /// Creates the file; an existing one is replaced when the new one is complete.
    ///
    /// # Errors
    /// [`simulation::BadInput`] if it cannot be created.
    pub fn create(path: &Path, container: Container) -> Result<Self> {
        let source = "log of the firmware, decoded by vsj log; times since the start of the MCU";
        let (file, out) = WholeFile::create(path, true)?;
        let writer = Writer::new(container, &Sheet { name: "log", source, columns: COLUMNS }, out)?;
        Ok(Self { path: path.to_owned(), file, writer, time_ns: 0 })
    }

    /// Adds a line.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn line(&mut self, line: &Line) -> Result<()> {
        self.time_ns = line.time_us.map_or(self.time_ns, |time_us| time_us.saturating_mul(1000));
        let level = line.level.map(|level| level.to_string().to_lowercase());
        let mut cells = [Cell::Missing; COLUMNS.len()];
        cells[0] = line.time_us.map(|time_us| time_us as f64 / 1e6).into();
        cells[1] = level.as_deref().map_or(Cell::Missing, Cell::Text);
        cells[2] = Cell::Text(line.event.name());
        cells[3] = Cell::Text(&line.message);
        cells[4..].copy_from_slice(&numbers(&line.event));
        self.writer.row(self.time_ns, &cells).with_context(|| format!("{} cannot be written", self.path.display()))
    }

    /// Writes the end of the file and gives it its name; returns its path.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<PathBuf> {
        self.writer.finish().with_context(|| format!("{} cannot be written", self.path.display()))?;
        self.file.finish()?;
        Ok(self.path)
    }
}

/// The cells of the columns from `tick` on.
fn numbers(event: &Event) -> [Cell<'static>; COLUMNS.len() - 4] {
    let whole = |number: u32| Cell::Whole(number.into());
    let volts = |millivolts: i32| Cell::Number(f64::from(millivolts) / 1e3);
    let mut cells = [Cell::Missing; COLUMNS.len() - 4];
    match *event {
        Event::Fault { tick, .. } | Event::Limit { tick, .. } => cells[0] = whole(tick),
        Event::Summary {
            tick,
            overruns,
            worst_lateness_us,
            limited_ticks,
            target_mv,
            applied_mv,
            stiffness_mv,
            ..
        } => {
            cells = [
                whole(tick),
                whole(overruns),
                Cell::Number(worst_lateness_us.into()),
                whole(limited_ticks),
                volts(target_mv),
                volts(applied_mv),
                volts(stiffness_mv),
            ];
        }
        _ => (),
    }
    cells
}
