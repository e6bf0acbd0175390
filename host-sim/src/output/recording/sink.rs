//! The file of a recording: rows of time, voltage and stiffness.
//!
//! A CSV file ends with a complete row and an MCAP file with a complete chunk of at most a second, however the recording ends. A
//! Parquet file cannot be read before its end is written: it has its name only then.

use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::mem;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use record_files::{Cell, Column, Container, Sheet, Writer};
use simulation::bad_input;

use crate::output::file::WholeFile;

/// Longest time between two chunks of an MCAP file, in s of the recording.
const CHUNK_S: f64 = 1.0;

/// A file that takes rows.
pub(super) struct Sink {
    path: PathBuf,
    file: Format,
}

enum Format {
    Csv(Csv),
    /// Rows are messages at the time of day.
    Mcap {
        writer: Writer<File>,
        /// Time of day of the first row, in ns since 1970.
        start_ns: Option<u64>,
        /// Time of the last chunk, in s of the recording.
        chunk_s: f64,
    },
    Parquet {
        writer: Writer<BufWriter<File>>,
        file: WholeFile,
    },
    /// The end of the file is written.
    Finished,
}

impl Sink {
    /// Creates the file that the extension of `path` asks for, with the column `reading` and `source` as a remark on its origin. An
    /// existing one is kept unless `replace`, since a measurement cannot be repeated.
    pub(super) fn create(path: &Path, replace: bool, reading: &'static str, source: &str) -> Result<Self> {
        let columns = [Column::number("time_s", "s"), Column::number("voltage_v", "V"), Column::number(reading, "V")];
        let sheet = Sheet { name: "record", source, columns: &columns };
        let unwritable = || format!("{} cannot be written", path.display());
        let file = match Container::of(path) {
            None => {
                let mut csv = Csv { file: create(path, replace)?, complete: 0 };
                csv.put(&format!("# {source}\ntime_s,voltage_v,{reading}\n")).with_context(unwritable)?;
                Format::Csv(csv)
            }
            Some(container @ Container::Mcap) => {
                let mut writer = Writer::new(container, &sheet, create(path, replace)?).with_context(unwritable)?;
                writer.flush().with_context(unwritable)?;
                Format::Mcap { writer, start_ns: None, chunk_s: 0.0 }
            }
            Some(container @ Container::Parquet) => {
                let (file, out) = WholeFile::create(path, replace)?;
                Format::Parquet { writer: Writer::new(container, &sheet, out).with_context(unwritable)?, file }
            }
        };
        Ok(Self { path: path.to_owned(), file })
    }

    /// Writes a row; without effect after the end.
    pub(super) fn row(&mut self, time_s: f64, voltage_v: f64, reading: Option<f64>) -> Result<()> {
        let written = self.file.row(time_s, voltage_v, reading);
        written.with_context(|| format!("{} cannot be written", self.path.display()))
    }

    /// Writes the end of the file; without effect a second time.
    pub(super) fn finish(&mut self) -> Result<()> {
        let finished = match mem::replace(&mut self.file, Format::Finished) {
            Format::Csv(_) | Format::Finished => Ok(()),
            Format::Mcap { writer, .. } => writer.finish(),
            Format::Parquet { writer, file } => match writer.finish() {
                Ok(()) => return file.finish(),
                error => error,
            },
        };
        finished.with_context(|| format!("{} cannot be written", self.path.display()))
    }
}

impl Format {
    fn row(&mut self, time_s: f64, voltage_v: f64, reading: Option<f64>) -> Result<()> {
        let cells = [Cell::Number(time_s), Cell::Number(voltage_v), reading.into()];
        match self {
            Self::Csv(csv) => {
                let reading = reading.map_or("-".into(), |reading| format!("{reading:.6}"));
                Ok(csv.put(&format!("{time_s},{voltage_v:.6},{reading}\n"))?)
            }
            Self::Mcap { writer, start_ns, chunk_s } => {
                let now = || SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64;
                let start_ns = *start_ns.get_or_insert_with(now);
                writer.row(start_ns + (time_s * 1e9).round() as u64, &cells)?;
                if time_s - *chunk_s >= CHUNK_S {
                    *chunk_s = time_s;
                    writer.flush()?;
                }
                Ok(())
            }
            Self::Parquet { writer, .. } => writer.row(0, &cells),
            Self::Finished => Ok(()),
        }
    }
}

/// A CSV file. Each row is written in one piece.
struct Csv {
    file: File,
    /// Number of bytes up to the end of the last complete row.
    complete: u64,
}

impl Csv {
    fn put(&mut self, text: &str) -> io::Result<()> {
        let written = self.file.write_all(text.as_bytes());
        if written.is_err() {
            // Remove an incomplete row; if that fails too, the first error is reported.
            let _ = self.file.set_len(self.complete);
            let _ = self.file.seek(SeekFrom::Start(self.complete));
            return written;
        }
        self.complete += text.len() as u64;
        Ok(())
    }
}

impl Drop for Sink {
    /// What was measured before an error stays readable.
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

fn create(path: &Path, replace: bool) -> Result<File> {
    match File::options().write(true).create_new(!replace).create(replace).truncate(replace).open(path) {
        Ok(file) => Ok(file),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            bad_input!("{}: already exists; expected a new file, or --force", path.display())
        }
        Err(error) => bad_input!("{}: cannot be created: {error}; expected a writable path", path.display()),
    }
}
