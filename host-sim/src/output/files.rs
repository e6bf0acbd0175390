//! Files of one run: all of them are written, or none, and no reader sees old and new ones together.
//!
//! They are written to a temporary folder beside the given one, which then takes its place in one step of the file system.
//! Where that is impossible, because the given folder contains folders, is the current one or a file system of its own, the
//! files are renamed one after the other; only SIGKILL or a loss of power can then separate them.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use simulation::bad_input;

use crate::signals::{TemporaryFolder, uninterrupted};

/// Name of the file with a spring, for `--plant`.
pub const PLANT_FILE: &str = "plant.toml";

/// Files that are written to a temporary folder and moved to their places when all are complete.
pub struct Files {
    folder: PathBuf,
    stage: TemporaryFolder,
    names: Vec<String>,
}

impl Files {
    /// Prepares files for `folder`, which is created if it does not exist.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if the folder cannot be created or written.
    pub fn new(folder: &Path) -> Result<Self> {
        // Who may not write to a folder may not replace it either.
        let is_writable = || tempfile::tempfile_in(folder).map(drop);
        let stage = fs::create_dir_all(folder).and_then(|()| is_writable()).and_then(|()| match beside(folder) {
            Some(stage) => Ok(stage),
            None => TemporaryFolder::new_in(folder),
        });
        match stage {
            Ok(stage) => Ok(Self { folder: folder.to_owned(), stage, names: Vec::new() }),
            Err(error) => {
                bad_input!("{}: cannot be created: {error}; expected a writable folder", folder.display())
            }
        }
    }

    /// Writes one file to the temporary folder.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, name: &str, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let complete = || -> io::Result<()> {
            let mut buffer = BufWriter::new(File::create_new(self.stage.path().join(name))?);
            write(&mut buffer)?;
            buffer.into_inner()?;
            Ok(())
        };
        complete().with_context(|| format!("{} cannot be written", self.folder.join(name).display()))?;
        self.names.push(name.to_owned());
        Ok(())
    }

    /// Writes one file, unless another one of its name is there, which its user may have changed; returns true if that is kept.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add_unless_changed(&mut self, name: &str, text: &str) -> Result<bool> {
        let is_kept = fs::read(self.folder.join(name)).is_ok_and(|old| old != text.as_bytes());
        if !is_kept {
            self.add(name, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(is_kept)
    }

    /// Moves all files to their places; returns their paths.
    ///
    /// # Errors
    /// If a file cannot be moved; [`simulation::bad_input::BadInput`] if its place is taken by something that is not a
    /// file.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        let paths: Vec<PathBuf> = self.names.iter().map(|name| self.folder.join(name)).collect();
        // Foreseeable errors are checked before the first file is moved.
        if let Some(taken) = paths.iter().find(|path| path.exists() && !path.is_file()) {
            bad_input!("{} cannot be written: it is not a file; expected another folder", taken.display());
        }
        uninterrupted(|| {
            if swap(self.stage.path(), &self.folder).is_ok() {
                return Ok(());
            }
            for (name, path) in self.names.iter().zip(&paths) {
                let moved = fs::rename(self.stage.path().join(name), path);
                moved.with_context(|| format!("{} cannot be written", path.display()))?;
            }
            Ok(())
        })
        .map(|()| paths)
    }
}

/// A temporary folder beside `folder` that can take its place; `None` if there can be none.
fn beside(folder: &Path) -> Option<TemporaryFolder> {
    let folder = folder.canonicalize().ok()?;
    let parent = folder.parent()?;
    let on_one_device = device(&folder).is_some() && device(&folder) == device(parent);
    // Who stands in a folder that is replaced would stand in a deleted one.
    let is_current =
        std::env::current_dir().and_then(|current| current.canonicalize()).is_ok_and(|here| here == folder);
    if is_current || !on_one_device || fs::read_dir(&folder).ok()?.any(is_folder) {
        return None;
    }
    TemporaryFolder::new_in(parent).ok()
}

fn is_folder(entry: io::Result<fs::DirEntry>) -> bool {
    entry.and_then(|entry| entry.file_type()).map_or(true, |kind| kind.is_dir())
}

/// Number of the file system of a folder.
#[cfg(unix)]
fn device(path: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt;
    path.metadata().map(|metadata| metadata.dev()).ok()
}

#[cfg(not(unix))]
fn device(_: &Path) -> Option<u64> {
    None
}

/// Puts the folder `stage` in the place of `folder`, whose other files it takes over.
#[cfg(target_os = "linux")]
fn swap(stage: &Path, folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt;

    use rustix::fs::{CWD, RenameFlags, renameat_with};
    let owner = |path: &Path| path.metadata().map(|metadata| (metadata.uid(), metadata.gid()));
    let folder = folder.canonicalize()?;
    if stage.parent() != folder.parent() || owner(stage)? != owner(&folder)? || fs::read_dir(&folder)?.any(is_folder) {
        return Err(io::ErrorKind::Unsupported.into());
    }
    let names = |folder: &Path| -> io::Result<BTreeSet<OsString>> {
        fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.file_name())).collect()
    };
    let new = names(stage)?;
    let old = names(&folder)?;
    let linked: Vec<&OsString> = old.difference(&new).collect();
    let put = |name: &OsStr| fs::hard_link(folder.join(name), stage.join(name));
    let ready = linked.iter().try_for_each(|name| put(name)).and_then(|()| {
        fs::set_permissions(stage, folder.metadata()?.permissions())?;
        Ok(renameat_with(CWD, stage, CWD, &folder, RenameFlags::EXCHANGE)?)
    });
    if ready.is_err() {
        linked.iter().for_each(|name| drop(fs::remove_file(stage.join(name))));
        return ready;
    }
    // `stage` is now the path of what was in the folder. A file that another program has put there meanwhile is kept.
    for name in names(stage).unwrap_or_default().difference(&old) {
        let (from, to) = (stage.join(name), folder.join(name));
        if !to.exists() {
            let _ = fs::rename(from, to);
        }
    }
    Ok(())
}

/// Two folders can be exchanged in one step on Linux only.
#[cfg(not(target_os = "linux"))]
fn swap(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
