//! The table of the demonstrations with a better model, and the approved summary of three of them.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use xtask::shell;

use super::better_model::Outcome;
use super::stage::Errors;

/// Decimals of the approved errors, few enough that a slightly better diagnosis needs no new approval.
const APPROVED_DECIMALS: usize = 0;

/// The line of one effect, with this number of decimals.
pub(super) fn line(outcome: &Outcome, decimals: usize) -> String {
    let Outcome { effect, named, right, before, after, remark, .. } = outcome;
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

/// The table of all effects, with this number of decimals.
pub(super) fn table(outcomes: &[Outcome], decimals: usize) -> String {
    let mut text = format!("{:<31} {:<5} {:>15}{:>17}\n", "", "", "RMS error [V]", "worst step [V]");
    let _ = writeln!(
        text,
        "{:<31} {:<5} {:>7}{:>8}{:>9}{:>8}  named",
        "hidden effect", "", "before", "after", "before", "after"
    );
    for outcome in outcomes {
        let _ = writeln!(text, "{}", line(outcome, decimals));
    }
    text
}

fn approved() -> PathBuf {
    shell::root().join("emulation/golden/story.txt")
}

/// Writes the summary as the approved one.
pub(super) fn bless(outcomes: &[Outcome]) -> Result<()> {
    let path = approved();
    fs::create_dir_all(path.parent().context("a file without folder")?)?;
    fs::write(&path, table(outcomes, APPROVED_DECIMALS)).with_context(|| format!("cannot write {}", path.display()))
}

/// An error unless the summary is the approved one.
pub(super) fn compare(outcomes: &[Outcome]) -> Result<()> {
    let path = approved();
    let before = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let now = table(outcomes, APPROVED_DECIMALS);
    if before != now {
        bail!("the summary is not the approved one.\n--- {}\n{before}--- now\n{now}", path.display());
    }
    Ok(())
}
