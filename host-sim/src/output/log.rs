//! The decoded firmware log on stdout: as a table, as CSV, or as one JSON object.

use std::io::{self, StdoutLock, Write};

use anyhow::Result;
use serde::Serialize;

use crate::log::{
    CSV_HEADER, Encoding, Item, Line, Summary, TABLE_HEADER, csv_row, more_damage_csv_row, more_damage_table_row,
    summary_text, table_row,
};

/// How a log is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A table, then the summary.
    Table,
    /// The columns `time_s,level,event,message`, then the summary as comments.
    Csv,
    /// One JSON object, at the end.
    Json,
}

/// The answer of `vsj log --json`.
#[derive(Serialize)]
struct Report {
    encoding: Encoding,
    lines: Vec<Line>,
    damaged: Vec<Damage>,
    summary: Summary,
}

/// A part of the log that holds no frame.
#[derive(Serialize)]
struct Damage {
    offset: u64,
    /// `None` where a raw log becomes unreadable; the summary then counts the bytes.
    bytes: Option<u64>,
}

/// Prints the items of a log while they are decoded.
pub struct Printer {
    format: Format,
    out: StdoutLock<'static>,
    /// Kept for JSON, which is one object.
    lines: Vec<Line>,
    damaged: Vec<Damage>,
    /// Within a run of damaged frames: the number of frames after its first, and their bytes. The log of another build is one
    /// such run.
    run: Option<(u64, u64)>,
}

impl Printer {
    /// Prints the header of a table or CSV file to stdout.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn start(format: Format) -> io::Result<Self> {
        let mut out = io::stdout().lock();
        match format {
            Format::Table => writeln!(out, "{TABLE_HEADER}")?,
            Format::Csv => writeln!(out, "{CSV_HEADER}")?,
            Format::Json => {}
        }
        out.flush()?;
        Ok(Self { format, out, lines: Vec::new(), damaged: Vec::new(), run: None })
    }

    /// Prints an item; of a run of damaged frames only the first, then their number.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn item(&mut self, item: Item) -> io::Result<()> {
        if self.format == Format::Json {
            match item {
                Item::Line(line) => self.lines.push(line),
                Item::Damaged { offset, bytes } => self.damaged.push(Damage { offset, bytes: Some(bytes) }),
                Item::Lost { offset } => self.damaged.push(Damage { offset, bytes: None }),
                Item::Unread { .. } | Item::CutOff { .. } => {}
            }
            return Ok(());
        }
        match (&item, &mut self.run) {
            (Item::Damaged { bytes: more, .. }, Some((frames, bytes))) => {
                *frames += 1;
                *bytes += more;
                return Ok(());
            }
            (Item::Damaged { .. }, None) => self.run = Some((0, 0)),
            _ => self.end_run()?,
        }
        let row = if self.format == Format::Csv { csv_row(&item) } else { table_row(&item) };
        writeln!(self.out, "{row}")
    }

    /// Shows what has been printed so far: a log may be followed live.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn end_run(&mut self) -> io::Result<()> {
        let Some((frames @ 1.., bytes)) = self.run.take() else { return Ok(()) };
        let row = if self.format == Format::Csv { more_damage_csv_row } else { more_damage_table_row };
        writeln!(self.out, "{}", row(frames, bytes))
    }

    /// Prints the summary.
    ///
    /// # Errors
    /// If stdout cannot be written.
    pub fn end(mut self, encoding: Encoding, summary: Summary) -> Result<()> {
        self.end_run()?;
        match self.format {
            Format::Json => {
                let report = Report { encoding, lines: self.lines, damaged: self.damaged, summary };
                writeln!(self.out, "{}", serde_json::to_string(&report)?)?;
            }
            Format::Csv => {
                for line in summary_text(&summary).lines() {
                    writeln!(self.out, "# {line}")?;
                }
            }
            Format::Table => write!(self.out, "\n{}", summary_text(&summary))?,
        }
        Ok(self.out.flush()?)
    }
}
