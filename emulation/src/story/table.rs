//! The stories beside each other, and the approved summary of three of them.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use xtask::shell;

use super::better_model::Told;
use super::stage::Errors;

/// A better diagnosis is not to need a new approval for a tenth of a volt.
const APPROVED_DECIMALS: usize = 0;

/// One story, its errors with so many decimals.
pub(super) fn line(told: &Told, decimals: usize) -> String {
    let Told { effect, named, right, before, after, remark, .. } = told;
    let named = if named.is_empty() { "nothing".to_owned() } else { named.join(" + ") };
    let right = if *right { "right" } else { "WRONG" };
    let volts = |errors: Option<&Errors>, which: fn(&Errors) -> f64| {
        errors.map_or_else(|| "-".to_owned(), |errors| format!("{:.decimals$}", which(errors)))
    };
    let [rms, worst]: [fn(&Errors) -> f64; 2] = [|errors| errors.rms_v, |errors| errors.worst_plateau_v];
    let (before, after) = (Some(before), after.as_ref());
    format!(
        "{effect:<31} {right} {:>7}{:>8}{:>9}{:>8}  {named}{}{remark}",
        volts(before, rms),
        volts(after, rms),
        volts(before, worst),
        volts(after, worst),
        if remark.is_empty() { "" } else { "; " }
    )
}

/// All of them.
pub(super) fn table(told: &[Told], decimals: usize) -> String {
    let mut text = format!("{:<31} {:<5} {:>15}{:>17}\n", "", "", "RMS error [V]", "worst step [V]");
    let _ = writeln!(
        text,
        "{:<31} {:<5} {:>7}{:>8}{:>9}{:>8}  named",
        "hidden effect", "", "before", "after", "before", "after"
    );
    for told in told {
        let _ = writeln!(text, "{}", line(told, decimals));
    }
    text
}

fn approved() -> PathBuf {
    shell::root().join("emulation/golden/story.txt")
}

/// The summary becomes the approved one.
pub(super) fn bless(told: &[Told]) -> Result<()> {
    let path = approved();
    fs::create_dir_all(path.parent().context("a file without folder")?)?;
    fs::write(&path, table(told, APPROVED_DECIMALS)).with_context(|| format!("cannot write {}", path.display()))
}

/// An error unless the summary is the approved one.
pub(super) fn compare(told: &[Told]) -> Result<()> {
    let path = approved();
    let before = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let now = table(told, APPROVED_DECIMALS);
    if before != now {
        bail!("the story is not the approved one.\n--- {}\n{before}--- now\n{now}", path.display());
    }
    Ok(())
}
