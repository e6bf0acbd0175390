//! Records and logs in the files of other people's tools: MCAP (Foxglove, PlotJuggler) and Parquet (pandas, polars, Spark).
//!
//! In: the path of a measured record, in CSV or one of these containers, and the format that its user asks for; or a table, row by
//! row. Out: the record, with the errors of a CSV file; or the bytes of a file.
//!
//! | module | what it is |
//! | --- | --- |
//! | `read` | the columns of a file, which go through the reader of CSV files |
//! | `write` | a table as a file |
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod read;
mod write;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use anyhow::Result;
use simulation::bad_input;
use simulation::csv_table::Numbering;
use simulation::csv_table::dialect::Dialect;
use simulation::csv_table::text::{MOST_BYTES, Source};
use simulation::record::{Format, MeasuredRecord};

pub use write::{Cell, Column, Kind, Sheet, Writer};

/// A file format other than CSV that holds tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// Messages with time stamps on topics, here JSON objects.
    Mcap,
    /// Columns with types.
    Parquet,
}

impl Container {
    /// The container that the extension of a path names, in any case; `None` for any other.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "mcap" => Some(Self::Mcap),
            "parquet" => Some(Self::Parquet),
            _ => None,
        }
    }

    /// Name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mcap => "MCAP",
            Self::Parquet => "Parquet",
        }
    }

    /// The container whose files start with these bytes.
    fn starting_with(start: &[u8]) -> Option<Self> {
        let starts = |container: &Self| start.starts_with(container.magic());
        [Self::Mcap, Self::Parquet].into_iter().find(starts)
    }

    fn magic(self) -> &'static [u8] {
        match self {
            Self::Mcap => mcap::MAGIC,
            Self::Parquet => b"PAR1",
        }
    }
}

/// Opens a measured record: MCAP and Parquet are recognised by their first bytes, anything else is read as CSV. Of an MCAP file,
/// `topic` names the topic of the messages; without it, the only one that has the columns.
///
/// # Errors
/// [`simulation::BadInput`] with file, row or line, column and what was expected.
pub fn open(path: &Path, format: &Format, topic: Option<&str>) -> Result<MeasuredRecord> {
    let name = path.display().to_string();
    let mut file = match File::open(path) {
        Ok(file) => BufReader::new(file),
        Err(error) => bad_input!("{name}: cannot be read: {error}"),
    };
    // A folder can be opened and fails here, which the reader of texts reports.
    let container = Container::starting_with(file.fill_buf().unwrap_or_default());
    if topic.is_some() && container != Some(Container::Mcap) {
        bad_input!("{name}: --topic applies to MCAP only; expected an MCAP file");
    }
    match (container, Container::of(path)) {
        (None, Some(expected)) => {
            let magic = expected.magic().escape_ascii();
            bad_input!("{name}: does not start with `{magic}`; expected {}", expected.name())
        }
        (None, None) => format.read(Source::read(&name, file)),
        (Some(container), _) => {
            let mut bytes = Vec::new();
            if let Err(error) = file.take(MOST_BYTES as u64 + 1).read_to_end(&mut bytes) {
                bad_input!("{name}: cannot be read: {error}");
            }
            read(&name, container, bytes, format, topic)
        }
    }
}

/// Reads a measured record from the bytes of a file; `name` is what messages call it.
///
/// # Errors
/// The errors of [`open`].
pub fn read(
    name: &str,
    container: Container,
    bytes: Vec<u8>,
    format: &Format,
    topic: Option<&str>,
) -> Result<MeasuredRecord> {
    if bytes.len() > MOST_BYTES {
        let most = MOST_BYTES >> 20;
        bad_input!(
            "{name}: more than {most} MiB; expected at most that: keep every tenth row, or a part of the record"
        );
    }
    let Dialect { separator, decimal } = format.dialect;
    for (option, is_given) in [("--separator", separator.is_some()), ("--decimal", decimal.is_some())] {
        if is_given {
            bad_input!("{name}: {option} applies to CSV only, and this is {}; expected none", container.name());
        }
    }
    let read::Columns { columns, remarks } = match container {
        Container::Mcap => read::mcap::columns(name, &bytes, format, topic)?,
        Container::Parquet => read::parquet::columns(name, bytes, format)?,
    };
    let mut measured = format.read_columns(name, &columns, Numbering::Rows)?;
    measured.remarks.splice(0..0, remarks);
    Ok(measured)
}
