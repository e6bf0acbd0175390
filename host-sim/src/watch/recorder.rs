//! The recordings that are made while the loop is watched: one file for each, with the columns of `vsj link PORT record`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use link::{Status, Telemetry};

use super::message::Progress;
use crate::output::recording::{Every, Recording};

/// Names of the files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// The first file; further ones have a number behind their name, `out-2.csv`.
    pub first: PathBuf,
    /// True to overwrite the first file.
    pub force: bool,
    /// True if the first file was asked for by its name: an existing one is then an error instead of passed over.
    pub is_given: bool,
}

impl Names {
    /// Names of recordings that nobody has named.
    pub fn default_names() -> Self {
        Self { first: "watch.csv".into(), force: false, is_given: false }
    }

    /// The file number `number`, from 1.
    fn file(&self, number: u32) -> PathBuf {
        if number == 1 {
            return self.first.clone();
        }
        let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let extension = self.first.extension().map(|it| format!(".{}", it.to_string_lossy())).unwrap_or_default();
        self.first.with_file_name(format!("{}-{number}{extension}", part(self.first.file_stem())))
    }
}

/// Begins and closes recordings.
pub(super) struct Recorder {
    names: Names,
    /// Number of the latest file, 0 before the first.
    number: u32,
    current: Option<(PathBuf, Recording)>,
}

impl Recorder {
    pub(super) fn new(names: Names) -> Self {
        Self { names, number: 0, current: None }
    }

    /// True while a recording runs.
    pub(super) fn runs(&self) -> bool {
        self.current.is_some()
    }

    /// Begins a recording in the next free file.
    ///
    /// # Errors
    /// If it cannot be created.
    pub(super) fn begin(&mut self, status: &Status, every: Every) -> Result<()> {
        self.number += 1;
        let must_be_this = |number| number == 1 && self.names.is_given;
        while !must_be_this(self.number) && self.names.file(self.number).exists() {
            self.number += 1;
        }
        let path = self.names.file(self.number);
        let recording = Recording::new(&path, self.names.force && self.number == 1, status, every)?;
        self.current = Some((path, recording));
        Ok(())
    }

    /// Adds a sample to the recording that runs, if any. An error closes it; its rows stay.
    ///
    /// # Errors
    /// If the file cannot be written, or the MCU has restarted.
    pub(super) fn add(&mut self, sample: &Telemetry) -> Result<()> {
        let Some((_, recording)) = &mut self.current else { return Ok(()) };
        let added = recording.add(sample);
        if added.is_err() {
            self.current = None;
        }
        added
    }

    /// How far the recording is.
    pub(super) fn progress(&self) -> Option<Progress> {
        let (path, recording) = self.current.as_ref()?;
        let summary = recording.summary();
        Some(Progress { file: name(path), rows: summary.rows, lost: summary.lost })
    }

    /// Closes the recording; returns what it contains, as a sentence, or `None` if none runs.
    ///
    /// # Errors
    /// If the end of the file cannot be written.
    pub(super) fn close(&mut self) -> Result<Option<String>> {
        let Some((path, mut recording)) = self.current.take() else { return Ok(None) };
        recording.finish()?;
        let summary = recording.summary();
        let (path, seconds) = (path.display(), summary.seconds);
        let kind = if summary.stiffness == "estimate" { " (estimates, no measurement)" } else { "" };
        Ok(Some(format!("wrote {path}: {} rows{kind}, {seconds} s, {} samples lost", summary.rows, summary.lost)))
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERY: Every = Every { sample_ticks: 1, row_ticks: 1 };

    fn status() -> Status {
        Status { rate_hz: 1000, ..Status::default() }
    }

    #[test]
    fn each_recording_has_a_file_of_its_own_and_none_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("out.csv");
        std::fs::write(folder.path().join("out-2.csv"), "kept").unwrap();
        let mut recorder = Recorder::new(Names { first: first.clone(), force: false, is_given: true });
        for name in ["out.csv", "out-3.csv"] {
            recorder.begin(&status(), EVERY).unwrap();
            recorder.add(&Telemetry { tick: 1, ..Telemetry::default() }).unwrap();
            assert_eq!(recorder.progress().unwrap(), Progress { file: name.into(), rows: 1, lost: 0 });
            let wrote = recorder.close().unwrap().unwrap();
            assert!(
                wrote.contains(&format!("{name}: 1 rows (estimates, no measurement), 0 s, 0 samples lost")),
                "{wrote}"
            );
        }
        assert_eq!(std::fs::read_to_string(folder.path().join("out-2.csv")).unwrap(), "kept");
        let error = Recorder::new(Names { first, force: false, is_given: true }).begin(&status(), EVERY).unwrap_err();
        assert!(error.to_string().contains("already exists"), "{error}");
    }

    #[test]
    fn a_file_that_cannot_be_completed_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("out.parquet");
        let mut recorder = Recorder::new(Names { first: first.clone(), force: false, is_given: true });
        recorder.begin(&status(), EVERY).unwrap();
        std::fs::create_dir(&first).unwrap();
        let error = recorder.close().unwrap_err();
        assert!(format!("{error:#}").contains("out.parquet cannot be written: "), "{error:#}");
    }

    #[test]
    fn a_file_that_nobody_named_takes_the_next_free_name() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("watch.csv");
        std::fs::write(&first, "kept").unwrap();
        let mut recorder = Recorder::new(Names { first, ..Names::default_names() });
        recorder.begin(&status(), EVERY).unwrap();
        assert_eq!(recorder.progress().unwrap().file, "watch-2.csv");
    }

    #[test]
    fn a_restart_of_the_mcu_closes_the_recording() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("out.csv");
        let mut recorder = Recorder::new(Names { first, force: false, is_given: true });
        recorder.begin(&status(), EVERY).unwrap();
        recorder.add(&Telemetry { tick: 500, ..Telemetry::default() }).unwrap();
        let error = recorder.add(&Telemetry { tick: 2, ..Telemetry::default() }).unwrap_err();
        assert!(error.to_string().contains("restarted after 1 rows") && !recorder.runs(), "{error}");
    }
}
