//! The file of a recording: rows of time, voltage and stiffness.
//!
//! A CSV file ends with a complete row and an MCAP file with a complete chunk of at most a second, however the recording ends. A
//! Parquet file cannot be read before its end is written: it has its name only then.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use record_files::{Cell, Column, Container, Sheet, Writer};
use simulation::bad_input;

use crate::output::file::WholeFile;

/// Longest time between two chunks of an MCAP file, in s of the recording.
const CHUNK_S: f64 = 1.0;

/// A file that takes rows.
pub(super) enum Sink {
    /// Each row is written in one piece.
    Csv {
        path: PathBuf,
        file: File,
        /// Number of bytes up to the end of the last complete row.
        complete: u64,
    },
    /// Rows are messages at the time of day.
    Mcap {
        path: PathBuf,
        writer: Option<Writer<File>>,
        /// Time of day of the first row, in ns since 1970.
        start_ns: Option<u64>,
        /// Time of the last chunk, in s of the recording.
        chunk_s: f64,
    },
    Parquet {
        path: PathBuf,
        writer: Option<(WholeFile, Writer<BufWriter<File>>)>,
    },
}

impl Sink {
    /// Creates the file that the extension of `path` asks for, with the column `reading` and `source` as a remark on its origin. An
    /// existing one is kept unless `replace`, since a measurement cannot be repeated.
    pub(super) fn create(path: &Path, replace: bool, reading: &'static str, source: &str) -> Result<Self> {
        let columns = [Column::number("time_s", "s"), Column::number("voltage_v", "V"), Column::number(reading, "V")];
        let sheet = Sheet { name: "record", source, columns: &columns };
        let path = path.to_owned();
        let unwritable = || format!("{} cannot be written", path.display());
        match Container::of(&path) {
            None => {
                let mut sink = Self::Csv { file: create(&path, replace)?, path, complete: 0 };
                sink.put(&format!("# {source}\ntime_s,voltage_v,{reading}\n"))?;
                Ok(sink)
            }
            Some(container @ Container::Mcap) => {
                let mut writer = Writer::new(container, &sheet, create(&path, replace)?).with_context(unwritable)?;
                writer.flush().with_context(unwritable)?;
                Ok(Self::Mcap { path, writer: Some(writer), start_ns: None, chunk_s: 0.0 })
            }
            Some(container @ Container::Parquet) => {
                let (file, out) = WholeFile::create(&path, replace)?;
                let writer = Writer::new(container, &sheet, out).with_context(unwritable)?;
                Ok(Self::Parquet { path, writer: Some((file, writer)) })
            }
        }
    }

    /// Writes a row.
    pub(super) fn row(&mut self, time_s: f64, voltage_v: f64, reading: Option<f64>) -> Result<()> {
        let cells = [Cell::Number(time_s), Cell::Number(voltage_v), reading.into()];
        match self {
            Self::Csv { .. } => {
                let reading = reading.map_or("-".into(), |reading| format!("{reading:.6}"));
                self.put(&format!("{time_s},{voltage_v:.6},{reading}\n"))
            }
            Self::Mcap { writer, start_ns, chunk_s, path } => {
                let Some(writer) = writer else { return Ok(()) };
                let now = || SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64;
                let start_ns = *start_ns.get_or_insert_with(now);
                let mut add = || -> Result<()> {
                    writer.row(start_ns + (time_s * 1e9).round() as u64, &cells)?;
                    if time_s - *chunk_s >= CHUNK_S {
                        *chunk_s = time_s;
                        writer.flush()?;
                    }
                    Ok(())
                };
                add().with_context(|| format!("{} cannot be written", path.display()))
            }
            Self::Parquet { writer, path } => {
                let Some((_, writer)) = writer else { return Ok(()) };
                writer.row(0, &cells).with_context(|| format!("{} cannot be written", path.display()))
            }
        }
    }

    /// Writes the end of the file; without effect a second time.
    pub(super) fn finish(&mut self) -> Result<()> {
        match self {
            Self::Csv { .. } => Ok(()),
            Self::Mcap { writer, path, .. } => {
                let finished = writer.take().map_or(Ok(()), Writer::finish);
                finished.with_context(|| format!("{} cannot be written", path.display()))
            }
            Self::Parquet { writer, path } => {
                let Some((file, writer)) = writer.take() else { return Ok(()) };
                writer.finish().with_context(|| format!("{} cannot be written", path.display()))?;
                file.finish()
            }
        }
    }

    fn put(&mut self, text: &str) -> Result<()> {
        let Self::Csv { path, file, complete } = self else { return Ok(()) };
        let written = file.write_all(text.as_bytes());
        if written.is_err() {
            // Remove an incomplete row; if that fails too, the first error is reported.
            let _ = file.set_len(*complete);
            let _ = file.seek(SeekFrom::Start(*complete));
        }
        written.with_context(|| format!("{} cannot be written", path.display()))?;
        *complete += text.len() as u64;
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
