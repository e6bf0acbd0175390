//! Files and folders. Every error names the path.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::shell;

/// Writes a file.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}

/// Copies a file, and makes the folder that it goes to.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    make(to.parent().context("a file in a folder")?)?;
    fs::copy(from, to).map(drop).with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))
}

/// Makes a folder with those above it, unless it exists.
pub fn make(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))
}

/// Removes a folder with its content, if it exists.
pub fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    Ok(())
}

/// The files below `paths` of the workspace that git tracks and that are there, relative to its root; all of them without a path.
pub fn tracked(paths: &[&str]) -> Result<Vec<String>> {
    let files = shell::output(shell::command("git").args(["ls-files", "-z", "--"]).args(paths))?;
    // Tracked, but deleted since.
    let is_there = |file: &&str| !file.is_empty() && shell::root().join(file).is_file();
    Ok(files.split('\0').filter(is_there).map(str::to_owned).collect())
}

/// Copies every file that git tracks, as it is now, to `folder`; what was built there before stays.
pub fn copy_tracked(folder: &Path) -> Result<()> {
    for file in tracked(&[])? {
        let to = folder.join(&file);
        make(to.parent().context("a file in a folder")?)?;
        let from = shell::root().join(&file);
        let bytes = fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
        // Unchanged files keep their time, so that cargo does not compile them again.
        if fs::read(&to).ok().as_ref() != Some(&bytes) {
            write(&to, bytes)?;
        }
    }
    Ok(())
}
