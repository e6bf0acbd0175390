//! Comparison of PySINDy, SysIdentPy and `vsj diagnose`: identification on the first 60 % of a record, free-run
//! simulation over the last 40 %.
//!
//! The input of the other two tools is described in `validation/bench/identification.py`; they may start from the
//! readings before the last part. The extended model of `vsj diagnose` runs from the record's first row and uses the
//! voltages alone. For comparison: the paper's plant, unchanged, and the floor, which is the error of the true spring.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use cpu_time::ProcessTime;
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::diagnosis::predict;
use super::part::seed;
use crate::ground_truth::record::Recipe;
use crate::ground_truth::{Cause, LabelledRecord};
use crate::statistics::median;

/// Fraction of a record for identification; the rest is predicted.
pub(super) const LEARN: f64 = 0.6;
/// Largest error, relative to the floor, that counts as reaching the floor.
pub(super) const AT_FLOOR: f64 = 1.1;

/// Results for one record.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// True cause; `None` for the paper's spring.
    pub cause: Option<Cause>,
    /// Root mean square error of the true spring, in V.
    pub floor: f64,
    /// Answers in the order of [`TOOLS`].
    pub tools: [Answer; 4],
}

/// Result of a tool on a record.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Answer {
    /// Root mean square error, in V; `None` if the free run diverged or there was no answer.
    pub rmse: Option<f64>,
    /// CPU time of identification and free run, in s, which does not depend on the load of the machine.
    pub seconds: f64,
    /// Best settings of the tool; for `vsj diagnose`, the causes that it named.
    #[serde(default)]
    pub settings: Value,
}

/// Names of the compared tools; the paper's plant is not identified from the record.
pub const TOOLS: [&str; 4] = ["the paper's plant", "PySINDy", "SysIdentPy", "vsj"];

/// Number of records: one of each cause, and one without an effect.
pub const RECORDS: usize = Cause::ALL.len() + 1;

/// Runs every tool on every record.
///
/// # Errors
/// Python with the packages is not available, or a tool fails.
pub fn run(first: u64, progress: &ProgressBar) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (place, cause) in Cause::ALL.into_iter().map(Some).chain([None]).enumerate() {
        let hidden = Recipe::of(cause.as_slice()).draw(seed(first, 9, place));
        let folder = tempfile::tempdir()?;
        hidden.write(folder.path(), "record")?;
        let answers = identification(folder.path(), &[])?;
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

/// Answers of the other tools for the CSV files of a folder.
///
/// # Errors
/// Python with the packages is not available, or the script fails.
pub(super) fn identification(folder: &Path, arguments: &[&str]) -> Result<Value> {
    let script = bench().join("identification.py");
    // One thread: the waiting of others would count as CPU time.
    let mut command = Command::new(python()?);
    let output = command.env("OMP_NUM_THREADS", "1").arg(script).arg(folder).args(arguments).output()?;
    if !output.status.success() {
        bail!("identification.py: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    serde_json::from_slice(&output.stdout).context("identification.py prints JSON")
}

fn paper(hidden: &LabelledRecord) -> Answer {
    let rmse = Some(last_part(hidden, &hidden.at(0.0).readings.expected));
    Answer { rmse, seconds: 0.0, settings: Value::Null }
}

/// Result of `vsj diagnose`, evaluated as the other tools.
fn ours(hidden: &LabelledRecord) -> Result<Answer> {
    let start = ProcessTime::now();
    let (predicted, causes) = predict(hidden, learning_rows(hidden))?;
    let rmse = Some(last_part(hidden, &predicted)).filter(|rmse| rmse.is_finite());
    Ok(Answer { rmse, seconds: start.elapsed().as_secs_f64(), settings: causes.into() })
}

/// Number of rows for identification.
fn learning_rows(hidden: &LabelledRecord) -> usize {
    (LEARN * hidden.readings.read.len() as f64) as usize
}

/// Root mean square of reading less prediction over the last 40 % of the record, in V.
fn last_part(hidden: &LabelledRecord, predicted: &[f64]) -> f64 {
    let read = &hidden.readings.read;
    let split = learning_rows(hidden);
    let squares = read[split..].iter().zip(&predicted[split..]).map(|(read, y)| (read - y).powi(2));
    (squares.sum::<f64>() / (read.len() - split) as f64).sqrt()
}

/// Markdown page; errors at the floor are bold.
pub fn table(rows: &[Row]) -> String {
    let mut text = "\
Root mean square error, in V, of a free run over the last 40 % of a record by the model that was identified on the first 60 %,
and the CPU time. Bold: at most 1.1 times the floor, which is the error of the true spring. `-`: the free run diverged.

| true cause | floor | paper's plant | PySINDy | SysIdentPy | vsj | vsj named | CPU time in s: PySINDy | SysIdentPy | vsj |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
"
    .to_owned();
    for Row { cause, floor, tools } in rows {
        let hidden = cause.map_or("none", Cause::name);
        let errors = tools.each_ref().map(|answer| match answer.rmse {
            Some(rmse) if at_floor(rmse, *floor) => format!("**{rmse:.2}**"),
            Some(rmse) => format!("{rmse:.2}"),
            None => "-".to_owned(),
        });
        let [_, p, q, r] = tools.each_ref().map(|answer| answer.seconds);
        let named: Vec<&str> = tools[3].settings.as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let named = if named.is_empty() { "none".to_owned() } else { named.join(", ") };
        let errors = errors.join(" | ");
        text += &format!("| {hidden} | {floor:.2} | {errors} | {named} | {p:.1} | {q:.1} | {r:.1} |\n");
    }
    text + "\n" + &counts(rows)
}

fn at_floor(rmse: f64, floor: f64) -> bool {
    rmse <= AT_FLOOR * floor
}

/// How often each tool reaches the floor, is worse than the paper's plant or diverges, and its median CPU time.
fn counts(rows: &[Row]) -> String {
    let mut text = format!(
        "\
Where the paper's plant is at the floor, the effect is not visible in the last 40 %, or no model could predict it.

| of {} records | at the floor | worse than the paper's plant by 10 % | diverged | median CPU time in s |
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
        let diverged = count(&|_, rmse| rmse.is_none());
        let seconds: Vec<f64> = rows.iter().map(|row| row.tools[tool].seconds).collect();
        let median = median(&seconds).unwrap_or(f64::NAN);
        text += &format!("| {name} | {floor} | {worse} | {diverged} | {median:.1} |\n");
    }
    text
}

/// Folder of the Python script.
fn bench() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bench")
}

/// Python of a virtual environment below the target folder, with the packages of `validation/bench/requirements.txt`,
/// which are installed when the file has changed.
fn python() -> Result<PathBuf> {
    // The program is TARGET/PROFILE/campaign.
    let program = std::env::current_exe()?;
    let target = program.ancestors().nth(2).filter(|folder| folder.join("CACHEDIR.TAG").exists());
    let venv = target
        .with_context(|| format!("{}: expected in a target folder, as cargo builds it", program.display()))?
        .join("identification-venv");
    let python = venv.join("bin/python");
    let wanted = fs::read(bench().join("requirements.txt"))?;
    let installed = venv.join("requirements.txt");
    if python.exists() && fs::read(&installed).is_ok_and(|there| there == wanted) {
        return Ok(python);
    }
    eprintln!("installing validation/bench/requirements.txt into {}", venv.display());
    done(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&venv))
        .context("python3 with its module venv is needed (Debian, Ubuntu: apt-get install python3-venv)")?;
    done(Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(bench().join("requirements.txt")))?;
    // Written last, so that its presence means that the installation succeeded.
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

    #[test]
    fn the_model_of_the_first_part_predicts_the_last_to_the_floor() {
        for cause in [Cause::StaticNonlinearity, Cause::Drift, Cause::SensorSaturation] {
            let hidden = Recipe { rows: 1201, ..Recipe::of(&[cause]) }.draw(5);
            let floor = last_part(&hidden, &hidden.readings.expected);
            let rmse = |answer: Answer| answer.rmse.expect("a free run");
            let [before, after] = [rmse(paper(&hidden)), rmse(ours(&hidden).expect("a diagnosis"))];
            assert!(before > 2.0 * floor, "{cause}: the effect is not visible, {before} V");
            assert!(at_floor(after, floor), "{cause}: {after} V, the floor is {floor} V");
        }
    }
}
