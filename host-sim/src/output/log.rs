//! The decoded firmware log on stdout: as a table, as CSV, or as one JSON object.

use anyhow::Result;
use serde::Serialize;

use super::terminal::{json, print, print_to_reader};
use crate::log::{
    CSV_HEADER, Encoding, Item, Line, Summary, TABLE_HEADER, csv_row, more_damage_csv_row, more_damage_table_row,
    summary_text, table_row,
};

/// Largest number of lines and damaged parts in one JSON object: a few hundred MiB.
pub const MOST_IN_JSON: usize = 1_000_000;

/// How a log is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A table, then the summary.
    Table,
    /// The columns `time_s,level,event,message`, then the summary as comments.
    Csv,
    /// One JSON object, at the end.
    Json,
    /// The summary alone, since the lines are written to a file.
    Summary,
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
    /// Text that is not printed yet.
    text: String,
    /// Kept for JSON, which is one object.
    lines: Vec<Line>,
    damaged: Vec<Damage>,
    /// Within a run of damaged frames: the number of frames after its first, and their bytes. The log of another build is one
    /// such run.
    run: Option<(u64, u64)>,
}

impl Printer {
    /// Starts with the header of a table or CSV file.
    pub fn new(format: Format) -> Self {
        let text = match format {
            Format::Table => format!("{TABLE_HEADER}\n"),
            Format::Csv => format!("{CSV_HEADER}\n"),
            Format::Json | Format::Summary => String::new(),
        };
        Self { format, text, lines: Vec::new(), damaged: Vec::new(), run: None }
    }

    /// Adds an item; of a run of damaged frames only the first, then their number.
    pub fn item(&mut self, item: Item) {
        if self.format == Format::Summary {
            return;
        }
        if self.format == Format::Json {
            match item {
                Item::Line(line) => self.lines.push(line),
                Item::Damaged { offset, bytes } => self.damaged.push(Damage { offset, bytes: Some(bytes) }),
                Item::Lost { offset } => self.damaged.push(Damage { offset, bytes: None }),
                Item::Unread { .. } | Item::CutOff { .. } => {}
            }
            return;
        }
        match (&item, &mut self.run) {
            (Item::Damaged { bytes: more, .. }, Some((frames, bytes))) => {
                *frames += 1;
                *bytes += more;
                return;
            }
            (Item::Damaged { .. }, None) => self.run = Some((0, 0)),
            _ => self.end_run(),
        }
        let row = if self.format == Format::Csv { csv_row(&item) } else { table_row(&item) };
        self.text += &row;
        self.text.push('\n');
    }

    /// True if JSON, which is printed at the end, would hold more than [`MOST_IN_JSON`] lines and damaged parts.
    pub fn is_full(&self) -> bool {
        self.lines.len() + self.damaged.len() > MOST_IN_JSON
    }

    /// Prints what has been added, since a log may be followed live; returns false if the reader of stdout has closed the pipe.
    ///
    /// # Errors
    /// If stdout cannot be written for another reason.
    pub fn flush(&mut self) -> Result<bool> {
        print_to_reader(&std::mem::take(&mut self.text))
    }

    fn end_run(&mut self) {
        let Some((frames @ 1.., bytes)) = self.run.take() else { return };
        let row = if self.format == Format::Csv { more_damage_csv_row } else { more_damage_table_row };
        self.text += &row(frames, bytes);
        self.text.push('\n');
    }

    /// Prints the rest and the summary.
    ///
    /// # Errors
    /// If stdout cannot be written, except to a pipe closed by its reader.
    pub fn end(mut self, encoding: Encoding, summary: Summary) -> Result<()> {
        self.end_run();
        match self.format {
            Format::Json => {
                let report = Report { encoding, lines: self.lines, damaged: self.damaged, summary };
                self.text = json(&report)?;
            }
            Format::Csv => {
                for line in summary_text(&summary).lines() {
                    self.text += &format!("# {line}\n");
                }
            }
            Format::Table => self.text += &format!("\n{}", summary_text(&summary)),
            Format::Summary => self.text += &summary_text(&summary),
        }
        print(&self.text)
    }
}
