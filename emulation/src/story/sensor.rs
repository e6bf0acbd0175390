//! The demonstration with a sensor: the board keeps the paper's model of a spring that differs from it, and drives it
//! without the sensor, with it, and with a sensor that falls silent while the voltage is constant at the top.

use std::fmt::Write;
use std::ops::Range;

use anyhow::{Result, ensure};
use firmware::RATE_HZ;
use serde::Serialize;
use validation::ground_truth::Cause;
use xtask::variant::Controller;

use super::lock_step::{Disturbance, Moment};
use super::stage::{Errors, Pass, Stage, name};

/// Ticks without a reading: from the middle of the plateau at 500 V past the next step.
const SILENT: Range<usize> = 50_000..60_000;
/// Ticks in which only the silence can change the voltage: until the next step.
const AT_REST: Range<usize> = 49_999..55_000;
/// Most lines of the log in the table. JSON has all of them.
const MOST_LINES: usize = 6;
/// Largest change of voltage in a tick that is accepted when the sensor falls silent, in V.
const MOST_BUMP_V: f64 = 1.0;

/// Result for one effect.
#[derive(Serialize)]
pub(super) struct Outcome {
    effect: &'static str,
    without: Tracking,
    with: Tracking,
    silent: Tracking,
}

/// Result of one pass up and down.
#[derive(Serialize)]
struct Tracking {
    #[serde(flatten)]
    errors: Errors,
    /// Largest change of voltage from tick to tick on the plateau at 500 V, where the silence begins, in V.
    bump_v: f64,
    /// Most instructions in a tick of the model.
    most_instructions: u32,
    /// The board's log lines about the sensor.
    log: Vec<String>,
}

impl Tracking {
    fn of(pass: Pass) -> Self {
        let log = pass.said("sensor");
        let Pass { moments, most_instructions, .. } = pass;
        let change = |pair: &[Moment]| (pair[1].commanded_v - pair[0].commanded_v).abs();
        let bump_v = moments[AT_REST].windows(2).map(change).fold(0.0, f64::max);
        Self { errors: Errors::of(&moments), bump_v, most_instructions, log }
    }
}

/// Builds the image with the sensor.
pub(super) fn stage(controller: Controller) -> Result<Stage> {
    Stage::new(controller, &["feedback"])
}

/// Drives a spring that hides `cause` without the sensor, with it, and with a sensor that falls silent.
pub(super) fn run(stage: &Stage, cause: Option<Cause>, seed: u64) -> Result<Outcome> {
    let folder = stage.folder(name(cause))?;
    let sensing = sensing(stage);
    let drive =
        |run, silent| anyhow::Ok(Tracking::of(stage.drive(run, &folder, stage.spring(cause, seed), &silent, None)?));
    Ok(Outcome {
        effect: name(cause),
        without: drive(stage.run, Disturbance::None)?,
        with: drive(&sensing, Disturbance::None)?,
        silent: drive(&sensing, Disturbance::Silent(SILENT))?,
    })
}

/// The check in `cargo xtask test`: the board trusts the sensor, loses it and trusts it again, without a bump.
pub(super) fn check(stage: &Stage) -> Result<()> {
    let cause = Some(Cause::GainError);
    let silent = Disturbance::Silent(SILENT);
    let pass = stage.drive(&sensing(stage), &stage.folder(name(cause))?, stage.spring(cause, 1), &silent, None)?;
    let Tracking { bump_v, log, .. } = Tracking::of(pass);
    let said: Vec<_> = log.iter().filter_map(|line| line.split(' ').next()).collect();
    ensure!(said == ["absent", "trusted", "absent", "trusted"], "the log says of the sensor: {log:?}");
    ensure!(bump_v < MOST_BUMP_V, "the voltage changed by {bump_v} V in a tick when the sensor fell silent");
    Ok(())
}

/// Script of the pass with a sensor.
pub(super) fn sensing(stage: &Stage) -> String {
    format!("{} sensor", stage.run)
}

/// The line of one effect.
pub(super) fn line(outcome: &Outcome) -> String {
    let Outcome { effect, without, with, silent } = outcome;
    let mut text = format!("{effect:<31}");
    for tracking in [without, with, silent] {
        let _ = write!(text, "{:>8.2}", tracking.errors.rms_v);
    }
    for tracking in [without, with, silent] {
        let _ = write!(text, "{:>8.2}", tracking.errors.worst_plateau_v);
    }
    for tracking in [with, silent] {
        let _ = write!(text, "{:>8.2}", tracking.bump_v);
    }
    let shown = silent.log.len().min(MOST_LINES);
    text += &format!("  {}", silent.log[..shown].join(", "));
    match silent.log.len() - shown {
        0 => text,
        more => text + &format!(" and {more} more"),
    }
}

/// The table of all effects.
pub(super) fn table(outcomes: &[Outcome]) -> String {
    let mut text = format!("{:<31}{:>24}{:>24}{:>16}\n", "", "RMS error [V]", "worst step [V]", "bump [V]");
    let _ = writeln!(
        text,
        "{:<31}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}  the board's log, sensor silent from {} to {} s",
        "hidden effect",
        "without",
        "with",
        "silent",
        "without",
        "with",
        "silent",
        "with",
        "silent",
        SILENT.start / RATE_HZ as usize,
        SILENT.end / RATE_HZ as usize,
    );
    outcomes.iter().for_each(|one| text += &(line(one) + "\n"));
    let most = |of: fn(&Outcome) -> &Tracking| outcomes.iter().map(|one| of(one).most_instructions).max().unwrap_or(0);
    let (without, with) = (most(|one| &one.without), most(|one| &one.with).max(most(|one| &one.silent)));
    let _ = writeln!(text, "instructions per tick, at most: {without} without the sensor, {with} with it");
    text
}
