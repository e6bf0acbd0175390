//! Measured records of any instrument: what is identified, what is diagnosed, and how well each model predicts.
//!
//! In: a folder of CSV files, each with an optional description next to it, or the simulated instruments of
//! [`other_plants`]. Out: for each record the verdict and causes, the held-out error and the
//! error on the last 40 % by a fit to the first 60 %, of the nominal spring that `vsj identify` finds, of the spring that
//! `vsj diagnose --plant identify` extends, of the best linear model, of PySINDy and of SysIdentPy, and the CPU time.
//!
//! ```toml
//! # NAME.toml next to NAME.csv; without it the first three columns are time, voltage and reading
//! known = "two lags in series, converter steps"
//! [columns]
//! time = "Time:s"
//! voltage = "Q1:%"
//! reading = "T1:degC"
//! input = "hold"
//! ```

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use cpu_time::ProcessTime;
use identify::dimension::significant;
use identify::nominal::identify;
use identify::stats::scale::{centred, root_mean_square};
use identify::{Input, Options, examine};
use indicatif::ProgressBar;
use serde::Serialize;
use simulation::record::{Format, Record, columns_file};
use simulation::units::Units;

use super::diagnosis::residuals_beyond;
use super::rivals::{self, Answer, LEARN};
use crate::ground_truth::other_plants;
use crate::markdown;

/// A record with what is known of it.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Name of the record.
    pub name: String,
    /// What is in it, in words; may be empty.
    pub known: String,
    /// The record.
    pub record: Record,
    /// Units of the record.
    pub units: Units,
    /// Course of the voltage between its rows.
    pub input: Input,
}

/// Errors of a model, in the reading's unit; `None` if it was not asked for, or diverged.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Errors {
    /// Root mean square error on held-out segments.
    pub held_out: Option<f64>,
    /// Root mean square error on the last 40 % by a fit to the first 60 %.
    pub last: Option<f64>,
}

/// Results for one record.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the record.
    pub name: String,
    /// What is in it, in words.
    pub known: String,
    /// Number of rows.
    pub rows: usize,
    /// Unit of the errors.
    pub unit: String,
    /// Standard deviation of the readings.
    pub spread: f64,
    /// The nominal spring in words.
    pub nominal: String,
    /// Verdict of the diagnosis.
    pub verdict: String,
    /// Causes that the diagnosis names, with their probabilities.
    pub causes: Vec<(String, f64)>,
    /// Errors of the nominal spring, of the extended one, and of the best linear models of order up to 3 and up to 4.
    pub errors: [Errors; 4],
    /// Answers of PySINDy and SysIdentPy; empty without Python.
    pub others: Vec<Answer>,
    /// CPU time of `vsj identify` and of `vsj diagnose --plant identify`, in s.
    pub seconds: [f64; 2],
}

/// A record without results.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// Name of the record.
    pub name: String,
    /// What was wrong with it.
    pub reason: String,
}

impl Refused {
    fn new(name: String, reason: &anyhow::Error) -> Self {
        Self { name, reason: format!("{reason:#}") }
    }
}

/// Reads every CSV file of a folder; also returns the records that cannot be read.
///
/// # Errors
/// A folder without a CSV file, or that cannot be read.
pub fn open(folder: &Path) -> Result<(Vec<Subject>, Vec<Refused>)> {
    let entries = fs::read_dir(folder).with_context(|| format!("{}: cannot be read", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    paths.sort();
    if paths.is_empty() {
        bail!("{}: no file NAME.csv; expected records, each with an optional NAME.toml", folder.display());
    }
    let (mut subjects, mut refused) = (Vec::new(), Vec::new());
    for path in paths {
        match subject(&path) {
            Ok(subject) => subjects.push(subject),
            Err(reason) => refused.push(Refused::new(stem(&path), &reason)),
        }
    }
    Ok((subjects, refused))
}

/// Name of a file without folder and extension.
fn stem(path: &Path) -> String {
    path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn subject(path: &Path) -> Result<Subject> {
    let description = path.with_extension("toml");
    let (format, input, known) = if description.exists() {
        let (format, input) = columns_file::open(&description)?;
        let table: toml::Table = fs::read_to_string(&description)?.parse()?;
        let known = table.get("known").and_then(toml::Value::as_str).unwrap_or_default().to_owned();
        (format, input, known)
    } else {
        (first_three(path)?, None, String::new())
    };
    let input = match input.as_deref() {
        None | Some("hold") => Input::Hold,
        Some("linear") => Input::Linear,
        Some(other) => bail!("{}: input = {other:?}; expected hold or linear", description.display()),
    };
    let measured = format.open(path)?;
    Ok(Subject { name: stem(path), known, record: measured.record, units: measured.units, input })
}

/// The format of a file without a description: time, voltage and reading are its first three columns.
fn first_three(path: &Path) -> Result<Format> {
    let text = fs::read_to_string(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let header = text.lines().find(|line| !line.starts_with('#') && !line.trim().is_empty()).unwrap_or_default();
    let names: Vec<String> = header.split([',', ';', '\t']).map(|name| name.trim().to_owned()).collect();
    let [time, voltage, reading, ..] = names.as_slice() else {
        bail!("{}: {} column(s) in the header; expected time, voltage and reading", path.display(), names.len());
    };
    let mut format = Format::default();
    (format.columns.time, format.columns.voltage) = (Some(time.clone()), Some(voltage.clone()));
    format.columns.reading = Some(reading.clone());
    Ok(format)
}

/// The simulated instruments.
pub fn twins(seed: u64) -> Vec<Subject> {
    let subject = |plant: other_plants::OtherPlant| Subject {
        name: plant.name.to_owned(),
        known: plant.known.to_owned(),
        record: plant.record,
        units: plant.units,
        input: Input::Hold,
    };
    other_plants::all(seed).into_iter().map(subject).collect()
}

/// Identifies and diagnoses every record; with `python`, also by PySINDy and SysIdentPy. Also returns the records that were refused.
///
/// # Errors
/// Python is missing, or one of its packages fails.
pub fn run(subjects: &[Subject], python: bool, progress: &ProgressBar) -> Result<(Vec<Row>, Vec<Refused>)> {
    let others = if python { others(subjects)? } else { vec![Vec::new(); subjects.len()] };
    let (mut rows, mut refused) = (Vec::new(), Vec::new());
    for (subject, others) in subjects.iter().zip(others) {
        progress.set_message(subject.name.clone());
        match row(subject, others) {
            Ok(row) => rows.push(row),
            Err(reason) => refused.push(Refused::new(subject.name.clone(), &reason)),
        }
        progress.inc(1);
    }
    Ok((rows, refused))
}

fn row(Subject { name, known, record, units, input }: &Subject, others: Vec<Answer>) -> Result<Row> {
    let start = ProcessTime::now();
    let identified = identify(std::slice::from_ref(record), *input, units)?;
    let identifying = start.elapsed().as_secs_f64();
    let report = &identified.report;
    let options = Options { units: units.clone(), input: *input, ..Options::default() };
    let options = options.judging(identified.clone())?;
    let diagnosis = examine(record, &options, |_| ())?;
    let seconds = [identifying, start.elapsed().as_secs_f64()];

    let learnt = (LEARN * record.rows.len() as f64) as usize;
    let first = Record { name: record.name.clone(), rows: record.rows[..learnt].to_vec() };
    let of_first = identify(std::slice::from_ref(&first), *input, units)?;
    let options = options.judging(of_first)?;
    let beyond = residuals_beyond(record, learnt, &options)?.map(|left| Some(root_mean_square(&left)));

    let linear = |most: usize| {
        let orders = report.linear.iter().filter(|of| of.order <= most);
        Errors { held_out: orders.map(|of| of.held_out_rmse).min_by(f64::total_cmp), last: None }
    };
    let nominal = Errors { held_out: Some(report.held_out_rmse), last: beyond[0] };
    let extended = Errors { held_out: Some(diagnosis.report.extended.quality.held_out_rmse), last: beyond[1] };
    let read: Vec<f64> = record.rows.iter().filter_map(|row| row.measured).collect();
    let verdict = serde_json::to_value(diagnosis.report.verdict)?;
    let findings = diagnosis.report.findings.iter();
    Ok(Row {
        name: name.clone(),
        known: known.clone(),
        rows: read.len(),
        unit: units.reading.clone(),
        spread: root_mean_square(&centred(&read)),
        nominal: in_words(report),
        verdict: verdict.as_str().unwrap_or_default().to_owned(),
        causes: findings.map(|finding| (finding.cause.to_owned(), finding.probability)).collect(),
        errors: [nominal, extended, linear(3), linear(4)],
        others,
        seconds,
    })
}

/// Gain, share, delay, time constants and oscillations of a nominal spring.
fn in_words(report: &identify::nominal::report::Report) -> String {
    let nominal = &report.nominal;
    let number = |value: f64| significant(value, 4);
    let mut words = vec![format!("gain {}, share {:.2}", number(nominal.gain.value), nominal.share.value)];
    words.extend((nominal.delay_s.value > 0.0).then(|| format!("delay {} s", number(nominal.delay_s.value))));
    words.extend(nominal.tau_s.iter().map(|of| format!("tau {} s ({:.2})", number(of.tau.value), of.weight.value)));
    let oscillations = report.oscillation.iter();
    words.extend(oscillations.map(|of| format!("{} Hz (zeta {:.3})", number(of.freq_hz.value), of.zeta.value)));
    words.join(", ")
}

/// Answers of PySINDy and SysIdentPy for every record.
fn others(subjects: &[Subject]) -> Result<Vec<Vec<Answer>>> {
    let folder = tempfile::tempdir()?;
    for (index, subject) in subjects.iter().enumerate() {
        let rows = subject.record.rows.iter().filter_map(|row| Some((row, row.measured?)));
        let rows = rows.map(|(row, reading)| format!("{},{},{reading}\n", row.time_s, row.voltage_v));
        let text = format!("time_s,voltage_v,stiffness\n{}", rows.collect::<String>());
        fs::write(folder.path().join(format!("{index:04}.csv")), text)?;
    }
    let answers = rivals::identification(folder.path(), &["--any-unit"])?;
    let of = |index: usize| {
        let of = |tool: &str| serde_json::from_value::<Answer>(answers[format!("{index:04}")][tool].clone());
        Ok(vec![of("pysindy")?, of("sysidentpy")?])
    };
    (0..subjects.len()).map(of).collect()
}

/// The results as Markdown.
pub fn table(rows: &[Row]) -> String {
    let mut text = "\
Errors are root mean squares in percent of the standard deviation of the record's readings: on held-out segments, then on the last
40 % by what was found, structure included, on the first 60 %. `nominal` is what `vsj identify` finds, `extended` what
`vsj diagnose --plant identify` adds to it: held out are the values of its causes, while the spring under them was identified from
all rows, so that `extended` without a cause is an error in sample. `linear` is the best linear output-error model of order 1 to 3,
and to 4. PySINDy and SysIdentPy are run on the last 40 % alone. `-`: not asked for, or diverged.
Where the first 60 % drift to their end, the zero of `nominal` is that of the first reading.

"
    .to_owned();
    let line = |row: &Row| {
        let percent = |error: Option<f64>| match error {
            Some(error) if error.is_finite() => format!("{:.2}", 100.0 * error / row.spread),
            _ => "-".to_owned(),
        };
        let causes = row.causes.iter().map(|(cause, probability)| format!("{cause} ({probability:.3})"));
        let causes: Vec<String> = std::iter::once(row.verdict.clone()).chain(causes).collect();
        let held_out = row.errors.iter().map(|errors| percent(errors.held_out));
        let last = row.errors[..2].iter().map(|errors| percent(errors.last));
        let other = |index: usize| percent(row.others.get(index).and_then(|answer| answer.rmse));
        let mut cells = vec![row.name.clone(), row.rows.to_string(), causes.join("; ")];
        cells.extend(held_out.chain(last).chain([other(0), other(1)]));
        cells.extend(row.seconds.map(|seconds| format!("{seconds:.2}")));
        cells
    };
    let header = [
        "record",
        "rows",
        "verdict, causes (probability)",
        "held out: nominal",
        "extended",
        "linear 3",
        "linear 4",
        "last 40 %: nominal",
        "extended",
        "PySINDy",
        "SysIdentPy",
        "CPU s: identify",
        "with diagnosis",
    ];
    text += &markdown::table(&header, rows.iter().map(line));
    let known = rows.iter().map(|row| vec![row.name.clone(), row.known.clone(), row.nominal.clone()]);
    text + "\n" + &markdown::table(&["record", "known to be in it", "nominal spring"], known)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record that cannot be read, or identified, is named; the others are judged all the same.
    #[test]
    fn bad_records_do_not_stop_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let steps = (0..200)
            .map(|row| format!("{},{},{}\n", row, row / 20 % 3, (row / 20 % 3) as f64 + 0.01 * (row % 7) as f64));
        let good = format!("t,u,y\n{}", steps.collect::<String>());
        let constant = format!("t,u,y\n{}", (0..200).map(|row| format!("{row},1,{row}\n")).collect::<String>());
        for (name, text) in [("a_bad", "t,u,y\n0,0,x\n"), ("b_constant", &constant), ("c_good", &good)] {
            fs::write(folder.path().join(name).with_extension("csv"), text).unwrap();
        }
        let (subjects, unread) = open(folder.path()).unwrap();
        let (rows, refused) = run(&subjects, false, &ProgressBar::hidden()).unwrap();
        let names = |refused: &[Refused]| refused.iter().map(|of| of.name.clone()).collect::<Vec<_>>();
        assert_eq!((names(&unread), names(&refused)), (vec!["a_bad".into()], vec!["b_constant".into()]));
        assert!(refused[0].reason.contains("voltage never changes"), "{}", refused[0].reason);
        assert_eq!(rows.iter().map(|row| row.name.as_str()).collect::<Vec<_>>(), ["c_good"]);
    }
}
