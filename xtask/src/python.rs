//! Virtual environments for the Python scripts.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::{files, shell};

/// The folder of the virtual environment of a command, whether or not it exists.
pub fn folder(target: &Path, command: &str) -> PathBuf {
    target.join(format!("{command}-venv"))
}

/// The Python interpreter of a virtual environment under `target` that has the packages of `requirements`, a file
/// relative to the root of the workspace. Creates the environment, named after `command`, or renews it when the file
/// has changed.
pub fn environment(target: &Path, command: &str, requirements: &str) -> Result<PathBuf> {
    let venv = folder(target, command);
    let python = venv.join("bin/python");
    let path = shell::root().join(requirements);
    let installed = venv.join("requirements.txt");
    let wanted = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    if python.exists() && fs::read(&installed).is_ok_and(|there| there == wanted) {
        eprintln!("{command}: {} is up to date", venv.display());
        return Ok(python);
    }
    eprintln!("{command}: installing {requirements} into {}", venv.display());
    shell::run(shell::command("python3").args(["-m", "venv", "--clear"]).arg(&venv))
        .context("python3 with its module venv is needed (Debian, Ubuntu: apt-get install python3-venv)")?;
    // Most modules are never imported: each is compiled when it is.
    shell::run(shell::command(&python).args(["-m", "pip", "install", "--quiet", "--no-compile", "-r"]).arg(&path))?;
    // Written last: its presence shows that the installation succeeded.
    files::write(&installed, wanted)?;
    Ok(python)
}
