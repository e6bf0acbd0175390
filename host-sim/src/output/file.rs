//! A file alone that is complete or absent: it is written under a temporary name beside its own, and then renamed.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use simulation::bad_input;

use crate::signals::{TemporaryFolder, uninterrupted};

/// A file that is being written.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    /// In the folder of the file, so that renaming is one step; removed when it is dropped or a signal ends the program.
    stage: TemporaryFolder,
}

impl WholeFile {
    /// Prepares a file and opens it for writing. An existing one is an error unless `replace`.
    ///
    /// # Errors
    /// [`simulation::BadInput`] if it exists, or if it cannot be created.
    pub fn create(path: &Path, replace: bool) -> Result<(Self, BufWriter<File>)> {
        if path.exists() && !replace {
            bad_input!("{}: already exists; expected a new file, or --force", path.display());
        }
        if path.is_dir() {
            bad_input!("{}: cannot be created: it is a folder; expected a writable path", path.display());
        }
        let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        let staged = TemporaryFolder::new_in(folder).and_then(|stage| {
            let file = File::create_new(stage.path().join(NAME))?;
            Ok((Self { path: path.to_owned(), stage }, BufWriter::new(file)))
        });
        match staged {
            Ok(staged) => Ok(staged),
            Err(error) => bad_input!("{}: cannot be created: {error}; expected a writable path", path.display()),
        }
    }

    /// Gives the complete file its name.
    ///
    /// # Errors
    /// If it cannot be renamed.
    pub fn finish(self) -> Result<()> {
        let moved = uninterrupted(|| fs::rename(self.stage.path().join(NAME), &self.path));
        moved.with_context(|| format!("{} cannot be written", self.path.display()))
    }
}

/// Name of the file in its temporary folder.
const NAME: &str = "file";

/// Writes a file that is complete or absent.
///
/// # Errors
/// The errors of [`WholeFile`], and those of `write`.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    let (file, mut out) = WholeFile::create(path, true)?;
    let written = write(&mut out).and_then(|()| Ok(out.flush()?));
    written.with_context(|| format!("{} cannot be written", path.display()))?;
    file.finish()
}
