//! What PySINDy and SysIdentPy make of the records: learnt from the first 60 %, run freely over the last 40 %.
//!
//! They get what `tests/bench/identification.py` says. Beside them the paper's plant as it is, the floor (what the true spring
//! with its true values leaves), both over the same last 40 %, and `vsj diagnose`: the held-out error of its extended model,
//! over stretches that it chose itself.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::seam::Diagnose;
use crate::hidden::record::Recipe;
use crate::hidden::{Cause, Hidden};

/// Part of a record to learn from.
const LEARN: f64 = 0.6;

/// One record.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is hidden in it.
    pub cause: Cause,
    /// Root mean square error in V: the true spring.
    pub floor: f64,
    /// The paper's plant.
    pub paper: f64,
    /// PySINDy.
    pub pysindy: Answer,
    /// SysIdentPy.
    pub sysidentpy: Answer,
    /// `vsj diagnose`.
    pub vsj: Answer,
}

/// What a tool made of a record.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Answer {
    /// Root mean square error in V; none if the free run left all bounds, or there was no answer.
    pub rmse: Option<f64>,
    /// For everything, in s.
    pub seconds: f64,
    /// The settings that the tool did best with.
    #[serde(default)]
    pub settings: Value,
}

/// Learns from one record of each cause.
///
/// # Errors
/// No Python with these packages, or it fails.
pub fn run(first: u64, diagnose: &Diagnose<'_>, progress: &ProgressBar) -> Result<Vec<Row>> {
    let python = python()?;
    let mut rows = Vec::new();
    for cause in Cause::ALL {
        let hidden = Recipe::of(&[cause]).draw(first.wrapping_mul(1_000_000_007) + 900_000_000 + cause as u64);
        let folder = tempfile::tempdir()?;
        hidden.write(folder.path(), "record")?;
        let output = Command::new(&python).arg(bench().join("identification.py")).arg(folder.path()).output()?;
        if !output.status.success() {
            bail!("identification.py: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        let answers: Value = serde_json::from_slice(&output.stdout).context("identification.py prints JSON")?;
        let of = |tool: &str| serde_json::from_value::<Answer>(answers["record"][tool].clone());
        let start = Instant::now();
        let report =
            diagnose(&hidden).inspect_err(|error| progress.println(format!("{cause}: no diagnosis: {error:#}")));
        let vsj = Answer {
            rmse: report.ok().and_then(|report| report["extended"]["held_out_rmse"].as_f64()),
            seconds: start.elapsed().as_secs_f64(),
            settings: Value::Null,
        };
        rows.push(Row {
            cause,
            floor: last_part(&hidden, &hidden.readings.expected),
            paper: last_part(&hidden, &hidden.at(0.0).readings.expected),
            pysindy: of("pysindy")?,
            sysidentpy: of("sysidentpy")?,
            vsj,
        });
        progress.inc(1);
    }
    Ok(rows)
}

/// Root mean square over the last 40 % of what was read less what was foretold, in V.
fn last_part(hidden: &Hidden, foretold: &[f64]) -> f64 {
    let read = &hidden.readings.read;
    let split = (LEARN * read.len() as f64) as usize;
    let squares = read[split..].iter().zip(&foretold[split..]).map(|(read, y)| (read - y).powi(2));
    (squares.sum::<f64>() / (read.len() - split) as f64).sqrt()
}

/// As Markdown.
pub fn table(rows: &[Row]) -> String {
    let mut text = "\
| error in V | floor | paper's plant | PySINDy | SysIdentPy | vsj diagnose | time in s | PySINDy | SysIdentPy | vsj |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
"
    .to_owned();
    for Row { cause, floor, paper, pysindy, sysidentpy, vsj } in rows {
        let error = |answer: &Answer| answer.rmse.map_or_else(|| "-".to_owned(), |rmse| format!("{rmse:.2}"));
        let (a, b, c) = (error(pysindy), error(sysidentpy), error(vsj));
        let (p, q, r) = (pysindy.seconds, sysidentpy.seconds, vsj.seconds);
        text += &format!("| {cause} | {floor:.2} | {paper:.2} | {a} | {b} | {c} | | {p:.1} | {q:.1} | {r:.1} |\n");
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
