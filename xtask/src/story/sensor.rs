//! The board hears the spring's sensor: with the paper's model of a spring that is another one, without the sensor, with it,
//! and with one that falls silent while the voltage rests at the top.

use std::fmt::Write;
use std::ops::Range;

use anyhow::{Result, ensure};
use firmware::RATE_HZ;
use serde::Serialize;
use validation::ground_truth::Cause;

use super::lock_step::{Moment, NEVER};
use super::stage::{Errors, Stage, Way, name};
use crate::variant::Controller;
use crate::{audit, image};

/// The sensor's silence, in ticks: from the midst of the time at 500 V over the next step.
const SILENT: Range<usize> = 50_000..60_000;
/// Where a change of voltage has no other cause: until the next step.
const AT_REST: Range<usize> = 49_999..55_000;
/// Of the log, in the table; JSON has all.
const MOST_LINES: usize = 6;
/// At most that of a tick, in V: a few codes.
const MOST_BUMP_V: f64 = 1.0;

/// What came of one effect.
#[derive(Serialize)]
pub(super) struct Heard {
    effect: &'static str,
    without: Led,
    with: Led,
    silent: Led,
}

/// One way up and down.
#[derive(Serialize)]
struct Led {
    #[serde(flatten)]
    errors: Errors,
    /// The largest change of voltage from tick to tick at 500 V, where the silence begins, in V.
    bump_v: f64,
    /// In a tick of the model.
    most_instructions: u32,
    /// What the board's log said of its sensor.
    log: Vec<String>,
}

impl Led {
    fn of(way: Way) -> Self {
        let Way { moments, sensor, most_instructions } = way;
        let change = |pair: &[Moment]| (pair[1].commanded_v - pair[0].commanded_v).abs();
        let bump_v = moments[AT_REST].windows(2).map(change).fold(0.0, f64::max);
        Self { errors: Errors::of(&moments), bump_v, most_instructions, log: sensor }
    }
}

/// With the sensor in the image.
pub(super) fn stage(controller: Controller) -> Result<Stage> {
    Stage::new(controller, &["feedback"])
}

/// The three ways.
pub(super) fn hear(stage: &Stage, cause: Option<Cause>, seed: u64) -> Result<Heard> {
    let folder = stage.folder(cause)?;
    let sensing = sensing(stage);
    let lead = |run, silent| anyhow::Ok(Led::of(stage.lead(run, &folder, stage.spring(cause, seed), silent, None)?));
    Ok(Heard {
        effect: name(cause),
        without: lead(stage.run, NEVER)?,
        with: lead(&sensing, NEVER)?,
        silent: lead(&sensing, SILENT)?,
    })
}

/// For `cargo xtask test`: the board trusts its sensor, loses it, and trusts it again, without a bump and without a way into
/// a panic.
pub(super) fn check() -> Result<()> {
    let stage = stage(Controller::Paper)?;
    audit::run(&image::read(&stage.elf)?)?;
    let cause = Some(Cause::GainError);
    let way = stage.lead(&sensing(&stage), &stage.folder(cause)?, stage.spring(cause, 1), SILENT, None)?;
    let Led { bump_v, log, .. } = Led::of(way);
    let said: Vec<_> = log.iter().filter_map(|line| line.split(' ').next()).collect();
    ensure!(said == ["absent", "trusted", "absent", "trusted"], "the log says of the sensor: {log:?}");
    ensure!(bump_v < MOST_BUMP_V, "the voltage changed by {bump_v} V in a tick when the sensor fell silent");
    Ok(())
}

fn sensing(stage: &Stage) -> String {
    format!("{} sensor", stage.run)
}

/// One effect.
pub(super) fn line(heard: &Heard) -> String {
    let Heard { effect, without, with, silent } = heard;
    let mut text = format!("{effect:<31}");
    for led in [without, with, silent] {
        let _ = write!(text, "{:>8.2}", led.errors.rms_v);
    }
    for led in [without, with, silent] {
        let _ = write!(text, "{:>8.2}", led.errors.worst_plateau_v);
    }
    for led in [with, silent] {
        let _ = write!(text, "{:>8.2}", led.bump_v);
    }
    let shown = silent.log.len().min(MOST_LINES);
    text += &format!("  {}", silent.log[..shown].join(", "));
    match silent.log.len() - shown {
        0 => text,
        more => text + &format!(" and {more} more"),
    }
}

/// All of them.
pub(super) fn table(heard: &[Heard]) -> String {
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
    heard.iter().for_each(|one| text += &(line(one) + "\n"));
    let most = |led: fn(&Heard) -> &Led| heard.iter().map(|one| led(one).most_instructions).max().unwrap_or(0);
    let (without, with) = (most(|one| &one.without), most(|one| &one.with).max(most(|one| &one.silent)));
    let _ = writeln!(text, "instructions of a tick, at most: {without} without the sensor, {with} with it");
    text
}
