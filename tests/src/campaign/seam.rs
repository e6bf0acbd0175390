//! The one place that calls the diagnosis.

use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::hidden::Hidden;

/// What is asked to name the causes in a record: the diagnosis, or in tests of the campaign something that knows better.
pub type Diagnose<'a> = dyn Fn(&Hidden) -> Result<Value> + Sync + 'a;

/// The report of `vsj diagnose` on a record, from the program that the environment's `VSJ` names.
///
/// Nothing else knows how the diagnosis is called: to call a library's function instead, hand it [`Hidden::record`] here.
///
/// # Errors
/// No such program, or it failed.
pub fn diagnose(hidden: &Hidden) -> Result<Value> {
    let program = std::env::var_os("VSJ").context("the environment names no program `VSJ`")?;
    let folder = tempfile::tempdir()?;
    let [csv, _] = hidden.write(folder.path(), "record")?;
    let output = Command::new(&program).arg("diagnose").arg(csv).arg("--json").output().context("vsj starts")?;
    if !output.status.success() {
        bail!("vsj diagnose: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    serde_json::from_slice(&output.stdout).context("no JSON on stdout")
}
