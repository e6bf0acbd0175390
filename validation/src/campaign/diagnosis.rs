//! Interface to the diagnosis: with `real`, the only module of this crate that calls `identify`.

use anyhow::Result;
use identify::Diagnosis;
use identify::effects::model::Model;
use identify::equation::problem::Problem;
use identify::equation::scale::Scale;
use identify::fit::budget::UNLIMITED;
use identify::fit::engine::Engine;
use identify::plan::{Basis, Request, plan};
use identify::plant::base::Base;
use identify::record::data::Data;
use identify::record::normalisation::Normalisation;
use identify::record::observed::Observed;
use identify::stats::scale::root_mean_square;
#[cfg(feature = "sensitivity")]
pub use identify::stats::thresholds::vary;
pub use identify::stats::thresholds::{Threshold, empirical::ALL as THRESHOLDS};
use identify::{Input, Options, examine};
use serde_json::Value;
use simulation::plant_file::PlantFile;
use simulation::record::Record;
use simulation::units::Units;

use super::subject::{Nominal, Subject};
use crate::ground_truth::LabelledRecord;

/// A diagnosis of a record, as the JSON of `vsj diagnose`; tests of the campaign replace it by an oracle.
pub type Diagnose<'a> = dyn Fn(&LabelledRecord) -> Result<Value> + Sync + 'a;

/// Report of `identify` on a record, as `vsj diagnose --json` prints it.
///
/// # Errors
/// The record is rejected.
pub fn diagnose(hidden: &LabelledRecord) -> Result<Value> {
    report(&hidden.record(), &Options::default())
}

fn report(record: &Record, options: &Options) -> Result<Value> {
    Ok(serde_json::to_value(identify::examine::diagnose(record, options)?)?)
}

/// Times in s and the voltages, in V, that are held from then on.
pub type Commands = Vec<(f64, f64)>;

/// The schedule that `vsj plan` computes from a report, and the probability that it predicts.
///
/// # Errors
/// The report or the duration is rejected.
pub fn planned(report: &Value, minutes: f64) -> Result<(Commands, Option<f64>)> {
    let basis: Basis = serde_json::from_value(report.clone())?;
    let plan = plan(&basis, &Request { minutes: Some(minutes), ..Request::default() }, "the report")?;
    Ok((plan.commands.iter().map(|command| (command.time_s, command.voltage_v)).collect(), plan.probability))
}

/// Report of `identify` on a record compared with a nominal spring, as JSON.
///
/// # Errors
/// The record or the spring is rejected.
pub fn compared_with(record: &Record, nominal: PlantFile) -> Result<Value> {
    report(record, &Options { base: Base::new(nominal)?, ..Options::default() })
}

/// Report of `identify` on a record compared with its nominal spring, as JSON.
///
/// # Errors
/// The record or the spring is rejected.
pub fn answer(subject: &Subject) -> Result<Value> {
    match &subject.nominal {
        Nominal::Paper => report(&subject.record, &Options::default()),
        Nominal::Known(nominal) => compared_with(&subject.record, (**nominal).clone()),
        Nominal::Identified => {
            let identified = identify::identify(std::slice::from_ref(&subject.record), Input::Hold, &Units::default())?;
            report(&subject.record, &Options::default().judging(identified)?)
        }
    }
}

/// Prediction of a whole record, in V, from its voltages alone by the model identified on its first `rows` rows, and
/// the causes that were named.
///
/// # Errors
/// The record is rejected.
pub fn predict(hidden: &LabelledRecord, rows: usize) -> Result<(Vec<f64>, Vec<&'static str>)> {
    let whole = hidden.record();
    let (residual, identified) = residual(&whole, rows, &Options::default())?;
    let read = whole.rows.iter().filter_map(|row| row.measured);
    let mut predicted: Vec<f64> = read.zip(&residual).map(|(read, residual)| read - residual).collect();
    // A limit that readings stopped at exactly is a finding, but not part of the model.
    let middle = identified.data.reading.iter().sum::<f64>() / rows as f64;
    for limit in identified
        .report
        .findings
        .iter()
        .filter_map(|finding| Some(finding.parameters.iter().find(|it| it.0 == "limit")?.1.value))
    {
        predicted.iter_mut().for_each(|y| *y = if limit > middle { y.min(limit) } else { y.max(limit) });
    }
    Ok((predicted, identified.report.findings.iter().map(|finding| finding.cause).collect()))
}

/// Verdict and equation of a diagnosis, which has an equation where it explains nothing.
pub struct Hypothesis {
    /// Verdict.
    pub verdict: String,
    /// The equation; `None` if there is none.
    pub equation: Option<String>,
    /// Codes of its blocks.
    pub blocks: Vec<String>,
    /// Held-out errors of the extended simulation, the best linear model and the equation, in V.
    pub held_out: [Option<f64>; 3],
}

/// The hypothesis of a diagnosis of a record.
///
/// # Errors
/// The record is rejected.
pub fn hypothesis(record: &Record) -> Result<Hypothesis> {
    let report = identify::examine::diagnose(record, &Options::default())?;
    let details = report.equation_details.as_ref();
    let extended = details.map_or(report.extended.quality.held_out_rmse, |of| of.held_out.extended);
    let linear = report.linear.map(|linear| linear.held_out_rmse);
    let blocks = details.map_or(&[][..], |of| &of.blocks);
    Ok(Hypothesis {
        verdict: serde_json::to_value(report.verdict)?.as_str().unwrap_or_default().to_owned(),
        blocks: blocks.iter().map(|&code| code.to_owned()).collect(),
        held_out: [Some(extended), linear, details.map(|of| of.held_out.equation)],
        equation: report.equation,
    })
}

/// Root mean square errors beyond the first `rows` rows of a record of what was found on these: of the extended simulation, of the
/// best linear model, and of the equation, or of the extended simulation if there is none; `None` if a free run diverged.
///
/// # Errors
/// The record is rejected.
pub fn hypothesis_beyond(record: &Record, rows: usize) -> Result<[Option<f64>; 3]> {
    let (mut left, identified) = residual(record, rows, &Options::default())?;
    let extended = root_mean_square(&left.split_off(rows));
    let whole = identify::nominal::best_linear(std::slice::from_ref(record), Input::Hold);
    let linear = whole.map(|linear| linear.error.last_40_percent_rmse);
    let equation = identified.equation.as_ref().map(|fit| {
        let normalisation = &identified.data.normalisation;
        let prepared = |record: &Record| Data::thinned(&normalisation.record(record), Input::Hold, 1, normalisation);
        let (first, data) = (prepared(&first(record, rows)), prepared(record));
        let observed = Observed::new(&data);
        let mut problem = Problem::new(&data, &observed, &UNLIMITED);
        problem.scale = Scale::of(&first);
        root_mean_square(&problem.residual(fit).split_off(rows)) * normalisation.scales.reading.abs()
    });
    let finite = |error: f64| Some(error).filter(|error| error.is_finite());
    Ok([finite(extended), linear.and_then(finite), finite(equation.unwrap_or(extended))])
}

/// Readings less predictions beyond the first `rows` rows of a record, in the reading's unit, of the spring in the options and of the
/// same extended by what was identified on these. An initial state that is not known is estimated from the rows in which it has not
/// decayed.
///
/// # Errors
/// The record is rejected.
pub fn residuals_beyond(record: &Record, rows: usize, options: &Options) -> Result<[Vec<f64>; 2]> {
    let identified = examine(&first(record, rows), options, |_| ())?;
    let nominal = nominal_errors(record, &first(record, rows), options);
    let rows = identified.data.rows();
    Ok([nominal, identified.errors_on(record, options.input)].map(|mut errors| errors.split_off(rows)))
}

/// Readings less predictions of a record by the nominal spring as it is, in the reading's unit; the coordinates are those of the first
/// rows.
fn nominal_errors(record: &Record, first: &Record, options: &Options) -> Vec<f64> {
    let mut normalisation = Normalisation::of(first, options.base.file(), options.input, options.units.clone());
    normalisation.unsettled = options.unsettled;
    let data = Data::thinned(&normalisation.record(record), options.input, 1, &normalisation);
    let (observed, base) = (Observed::new(&data), options.base.normalised(&normalisation));
    let residual = Engine::new(&data, &observed, &base).residual(&Model::default());
    residual.into_iter().map(|left| normalisation.scales.reading * left).collect()
}

/// The first rows of a record.
fn first(record: &Record, rows: usize) -> Record {
    Record { name: record.name.clone(), rows: record.rows[..rows].to_vec() }
}

/// Readings less predictions of a whole record by the model identified on its first `rows` rows, and the diagnosis of these.
fn residual(record: &Record, rows: usize, options: &Options) -> Result<(Vec<f64>, Diagnosis)> {
    let identified = examine(&first(record, rows), options, |_| ())?;
    Ok((identified.errors_on(record, options.input), identified))
}
