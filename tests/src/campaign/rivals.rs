//! What PySINDy, SysIdentPy and `vsj diagnose` make of the records: learnt from the first 60 %, run freely over the last 40 %.
//!
//! The other two get what `tests/bench/identification.py` says, also the readings before the last part, to start from; the
//! extended model of `vsj diagnose` runs from the record's first row and sees the voltages alone. Beside them the paper's plant
//! as it is, and the floor: what the true spring with its true values leaves.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use cpu_time::ProcessTime;
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::seam::foretell;
use crate::hidden::record::Recipe;
use crate::hidden::{Cause, Hidden};

/// Part of a record to learn from.
const LEARN: f64 = 0.6;
/// An error of so many times the floor is the floor's.
const AT_FLOOR: f64 = 1.1;

/// One record.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is hidden in it, if anything.
    pub cause: Option<Cause>,
    /// Root mean square error in V: the true spring.
    pub floor: f64,
    /// As [`TOOLS`].
    pub tools: [Answer; 4],
}

/// What a tool made of a record.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Answer {
    /// Root mean square error in V; none if the free run left all bounds, or there was no answer.
    pub rmse: Option<f64>,
    /// Of a processor, for everything, in s: the same on a busy machine.
    pub seconds: f64,
    /// The settings that the tool did best with; of `vsj diagnose`, the causes that it named.
    #[serde(default)]
    pub settings: Value,
}

/// What is compared; the paper's plant has learnt nothing.
pub const TOOLS: [&str; 4] = ["the paper's plant", "PySINDy", "SysIdentPy", "vsj"];

/// Number of records: one of each cause, and one with nothing in it.
pub const RECORDS: usize = Cause::ALL.len() + 1;

/// Learns from each.
///
/// # Errors
/// No Python with these packages, or it fails.
pub fn run(first: u64, progress: &ProgressBar) -> Result<Vec<Row>> {
    let python = python()?;
    let mut rows = Vec::new();
    for (place, cause) in Cause::ALL.into_iter().map(Some).chain([None]).enumerate() {
        let seed = first.wrapping_mul(1_000_000_007) + 900_000_000 + place as u64;
        let hidden = Recipe::of(cause.as_slice()).draw(seed);
        let folder = tempfile::tempdir()?;
        hidden.write(folder.path(), "record")?;
        let script = bench().join("identification.py");
        // One thread: others that wait for it would count as time spent.
        let output = Command::new(&python).env("OMP_NUM_THREADS", "1").arg(script).arg(folder.path()).output()?;
        if !output.status.success() {
            bail!("identification.py: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        let answers: Value = serde_json::from_slice(&output.stdout).context("identification.py prints JSON")?;
        let of = |tool: &str| serde_json::from_value::<Answer>(answers["record"][tool].clone());
        rows.push(Row {
            cause,
            floor: last_part(&hidden, &hidden.readings.expected),
            tools: [paper(&hidden), of("pysindy")?, of("sysidentpy")?, ours(&hidden)?],
        });
        progress.inc(1);
    }
    Ok(rows)
}

fn paper(hidden: &Hidden) -> Answer {
    let rmse = Some(last_part(hidden, &hidden.at(0.0).readings.expected));
    Answer { rmse, seconds: 0.0, settings: Value::Null }
}

/// `vsj diagnose`, judged as the others are.
fn ours(hidden: &Hidden) -> Result<Answer> {
    let start = ProcessTime::now();
    let (foretold, causes) = foretell(hidden, learnt(hidden))?;
    let rmse = Some(last_part(hidden, &foretold)).filter(|rmse| rmse.is_finite());
    Ok(Answer { rmse, seconds: start.elapsed().as_secs_f64(), settings: causes.into() })
}

/// Number of rows to learn from.
fn learnt(hidden: &Hidden) -> usize {
    (LEARN * hidden.readings.read.len() as f64) as usize
}

/// Root mean square over the last 40 % of what was read less what was foretold, in V.
fn last_part(hidden: &Hidden, foretold: &[f64]) -> f64 {
    let read = &hidden.readings.read;
    let split = learnt(hidden);
    let squares = read[split..].iter().zip(&foretold[split..]).map(|(read, y)| (read - y).powi(2));
    (squares.sum::<f64>() / (read.len() - split) as f64).sqrt()
}

/// As Markdown; in bold what is at the floor.
pub fn table(rows: &[Row]) -> String {
    let mut text = "\
Root mean square error in V over the last 40 % of a record, run freely by what was learnt from the first 60 %, and the
processor time for it. Bold: at most 1.1 times the floor, which is what the true spring leaves. `-`: the free run left all bounds.

| hidden | floor | paper's plant | PySINDy | SysIdentPy | vsj | vsj named | time in s: PySINDy | SysIdentPy | vsj |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
"
    .to_owned();
    for Row { cause, floor, tools } in rows {
        let hidden = cause.map_or("nothing", Cause::name);
        let errors = tools.each_ref().map(|answer| match answer.rmse {
            Some(rmse) if at_floor(rmse, *floor) => format!("**{rmse:.2}**"),
            Some(rmse) => format!("{rmse:.2}"),
            None => "-".to_owned(),
        });
        let [_, p, q, r] = tools.each_ref().map(|answer| answer.seconds);
        let named: Vec<&str> = tools[3].settings.as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let named = if named.is_empty() { "nothing".to_owned() } else { named.join(", ") };
        let errors = errors.join(" | ");
        text += &format!("| {hidden} | {floor:.2} | {errors} | {named} | {p:.1} | {q:.1} | {r:.1} |\n");
    }
    text + "\n" + &counts(rows)
}

fn at_floor(rmse: f64, floor: f64) -> bool {
    rmse <= AT_FLOOR * floor
}

/// How often each tool is at the floor, worse than the paper's plant, or nowhere; and its typical time.
fn counts(rows: &[Row]) -> String {
    let mut text = format!(
        "\
Where the paper's plant is at the floor, the last 40 % do not show what is hidden, or no model could foretell it.

| of {} records | at the floor | worse than the paper's plant by 10 % | left all bounds | median time in s |
| --- | --- | --- | --- | --- |
",
        rows.len()
    );
    for (tool, name) in TOOLS.iter().enumerate() {
        let count = |which: &dyn Fn(&Row, Option<f64>) -> bool| {
            rows.iter().filter(|row| which(row, row.tools[tool].rmse)).count()
        };
        let floor = count(&|row, rmse| rmse.is_some_and(|rmse| at_floor(rmse, row.floor)));
        let worse =
            count(&|row, rmse| rmse.is_some_and(|rmse| row.tools[0].rmse.is_some_and(|paper| !at_floor(rmse, paper))));
        let lost = count(&|_, rmse| rmse.is_none());
        let mut seconds: Vec<f64> = rows.iter().map(|row| row.tools[tool].seconds).collect();
        seconds.sort_by(f64::total_cmp);
        let median = seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN);
        text += &format!("| {name} | {floor} | {worse} | {lost} | {median:.1} |\n");
    }
    text
}

/// Where the script lies.
fn bench() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bench")
}

/// Python with what `tests/bench/requirements.txt` asks for, in a venv of its own beside the campaign's program.
fn python() -> Result<PathBuf> {
    // TARGET/PROFILE/campaign
    let program = std::env::current_exe()?;
    let venv =
        program.ancestors().nth(2).context("the program lies below the target folder")?.join("identification-venv");
    let python = venv.join("bin/python");
    let wanted = fs::read(bench().join("requirements.txt"))?;
    let installed = venv.join("requirements.txt");
    if python.exists() && fs::read(&installed).is_ok_and(|there| there == wanted) {
        return Ok(python);
    }
    eprintln!("installing tests/bench/requirements.txt into {}", venv.display());
    done(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&venv))
        .context("python3 with its module venv is needed (Debian, Ubuntu: apt-get install python3-venv)")?;
    done(Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(bench().join("requirements.txt")))?;
    // Last: its presence says that the rest succeeded.
    fs::write(&installed, wanted)?;
    Ok(python)
}

fn done(command: &mut Command) -> Result<()> {
    if !command.status()?.success() {
        bail!("{command:?} failed");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the diagnosis learns holds beyond what it has seen: a law over the voltage, a clock, a bound of the sensor.
    #[test]
    fn what_is_learnt_from_the_first_part_foretells_the_last() {
        for cause in [Cause::StaticNonlinearity, Cause::Drift, Cause::SensorSaturation] {
            let hidden = Recipe { rows: 1201, ..Recipe::of(&[cause]) }.draw(5);
            let floor = last_part(&hidden, &hidden.readings.expected);
            let rmse = |answer: Answer| answer.rmse.expect("a free run");
            let [before, after] = [rmse(paper(&hidden)), rmse(ours(&hidden).expect("a diagnosis"))];
            assert!(before > 2.0 * floor, "{cause}: it does not show, {before} V");
            assert!(at_floor(after, floor), "{cause}: {after} V, the floor is {floor} V");
        }
    }
}
