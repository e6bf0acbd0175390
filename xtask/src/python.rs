//! Python with packages of its own.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::shell;

/// Python with what `xtask/<chore>/requirements.txt` asks for, in a venv of its own under the target directory.
pub(crate) fn with(target: &Path, chore: &str) -> Result<PathBuf> {
    let venv = target.join(format!("{chore}-venv"));
    let python = venv.join("bin/python");
    let requirements = shell::root().join("xtask").join(chore).join("requirements.txt");
    let installed = venv.join("requirements.txt");
    let wanted = fs::read(&requirements).with_context(|| format!("cannot read {}", requirements.display()))?;
    if python.exists() && fs::read(&installed).is_ok_and(|there| there == wanted) {
        eprintln!("{chore}: {} is up to date", venv.display());
        return Ok(python);
    }
    eprintln!("{chore}: installing xtask/{chore}/requirements.txt into {}", venv.display());
    shell::run(shell::command("python3").args(["-m", "venv", "--clear"]).arg(&venv))
        .context("python3 with its module venv is needed (Debian, Ubuntu: apt-get install python3-venv)")?;
    shell::run(shell::command(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(&requirements))?;
    // Last: its presence says that the rest succeeded.
    fs::write(&installed, wanted).with_context(|| format!("cannot write {}", installed.display()))?;
    Ok(python)
}
