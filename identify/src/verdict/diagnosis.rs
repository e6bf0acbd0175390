//! From a record to a report: search, held-out errors, ranking, checks of the residual, findings, verdict, suspects.

use std::mem;

use crate::adequacy::{self, Unidentifiable};
use crate::answer::{Extended, Finding, Nominal, Quality, Report, SCHEMA, SearchReport, Verdict};
use crate::effects::model::Model;
use crate::equation::fitted::Fitted;
use crate::fit::engine::{Engine, Fit};
use crate::plant::base::Base;
use crate::record::data::Data;
use crate::record::feedback::is_in_feedback;
use crate::record::observed::{Kind, Observed};
use crate::search::{Scored, WarmStart};
use crate::stats::thresholds::empirical::{FINEST_V, STEPS_BEYOND_BOUND};
use crate::verdict::alternatives::{never_reverses, next_experiment, twin};
use crate::verdict::credibility;
use crate::verdict::doubt;
use crate::verdict::export::{export, restored};
use crate::verdict::finding::{explained, finding};
use crate::verdict::found::{self, Found};
use crate::verdict::margins;
use crate::verdict::quality::{noise_report, quality, residual_report};
use crate::verdict::ranking::{RankedCauses, ranking};
use crate::verdict::reading_findings::reading_findings;
use crate::verdict::suspects::suspects;
use simulation::plant_file::PlantFile;

/// A finished diagnosis: the report and what is needed to draw it. All numbers are in the file's units, but for the points of
/// the models and the laws of the noise, which are normalised ([`crate::record::normalisation`]).
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The report.
    pub report: Report,
    /// The record.
    pub data: Data,
    /// The simulation as it is given.
    pub baseline: Fit,
    /// The simulation extended by the named causes.
    pub extended: Fit,
    /// The extended simulation as a plant file, in the file's units.
    pub plant: PlantFile,
    /// Readings less predictions of `baseline` and of `extended` on held-out segments, in the reading's unit.
    pub held_out: [Vec<f64>; 2],
    /// The best sets of causes with their scores and errors, the best first.
    pub ranking: Vec<RankedCauses>,
    /// The equation of the report, fitted in the coordinates of the search; `None` without one.
    pub equation: Option<Fitted>,
    /// Zero offset of each of several records, in V; empty for a single record.
    pub(crate) zero_offsets: Vec<f64>,
    /// How each reading was taken: exact, at a bound or known up to an interval, on a quantisation grid, cut off.
    pub(crate) observed: Observed,
    /// How each reading was taken, without the outliers of `extended`.
    pub(crate) regular: Observed,
    /// Readings less predictions of `extended` on held-out segments with searched places known, in the reading's unit.
    pub(crate) held_out_in_place: Vec<f64>,
    /// Held-out log-likelihood of the extended simulation less the price of its causes, in nats.
    pub(crate) score: f64,
    /// The plant that was extended.
    pub(crate) base: Base,
    /// The best structures, one for each set of causes, those of the suspects included, the best first; empty if no search was
    /// run.
    pub(crate) contenders: Vec<Scored>,
    /// Root mean square of the structure that no cause explains, in normalised V.
    pub(crate) unexplained_v: f64,
    /// From which a search under another reading of the same rows starts; `None` if no search was run.
    pub(crate) warm_start: Option<WarmStart>,
}

impl Diagnosis {
    /// Changes the verdict of a finished diagnosis with all that follows from it: the next experiment, no suspects where the findings
    /// explain the record, and no margins where something was found.
    pub(crate) fn conclude(&mut self, verdict: Verdict) {
        let report = &mut self.report;
        let wanders = self.extended.strongly_autocorrelated();
        report.verdict = verdict;
        report.next_experiment = next_experiment(verdict, &report.findings, &report.alternatives, wanders);
        if verdict == Verdict::Explained {
            report.suspects.clear();
        }
        if !report.findings.is_empty() {
            report.would_show = None;
        }
    }

    /// True if the extended simulation goes beyond the bounds at which readings stopped; on a quantisation grid, a plateau may
    /// only look like a bound.
    pub(crate) fn confirms_bounds(&self) -> bool {
        let step = self.observed.grid.map_or(FINEST_V.get(), |grid| grid.step);
        let beyond = |kind: Kind, sign: f64| {
            let rows = self.observed.kinds.iter().zip(&self.extended.residual).filter(|(of, _)| **of == kind);
            let beyond: Vec<f64> = rows.map(|(_, left)| -sign * left).collect();
            beyond.is_empty() || beyond.iter().sum::<f64>() > STEPS_BEYOND_BOUND.get() * step * beyond.len() as f64
        };
        beyond(Kind::AtLeast, 1.0) && beyond(Kind::AtMost, -1.0)
    }
}

/// Searches the engine's record for causes, from a warm start if there is one, and reports them. `held` says that the voltage
/// is held between rows; `progress` receives each structure that becomes the best.
pub(crate) fn diagnose(
    engine: &mut Engine,
    held: bool,
    warm_start: Option<WarmStart>,
    progress: impl FnMut(&Scored),
) -> Diagnosis {
    let baseline = engine.evaluate(Model::default());
    match found::search(engine, &baseline, warm_start, progress) {
        Ok(found) => identified(engine, held, baseline, found),
        Err(reason) => unidentified(engine, baseline, &reason),
    }
}

/// Reports a finished search.
fn identified(engine: &mut Engine, held: bool, mut baseline: Fit, mut found: Found) -> Diagnosis {
    let (data, observed) = (engine.data, engine.observed);
    let extended = &found.best.fit;
    let mut held_out = [&baseline, extended].map(|fit| engine.held_out_residual(fit));
    let known = [(&baseline, &*held_out[0]), (extended, &*held_out[1])];
    let ranking = ranking(engine, &found.contenders, &found.causes, &found.regular, known);
    // The simulation as it is given does not include what the readings cut off.
    for left in baseline.residual.iter_mut().chain(&mut held_out[0]) {
        *left -= observed.truncation_v;
    }
    let held_out_in_place = engine.held_out_residual_in_place(extended);
    let unmodelled = adequacy::first_significant(engine, extended).filter(|found| found.rms > FINEST_V.get());
    let left = unmodelled.as_ref().map(|found| doubt::sentence(found, extended, data.scales()));
    let before = quality(engine, &baseline, &held_out[0], false);
    let after = quality(engine, extended, &held_out[1], true);

    let mut findings = findings(engine, &found);
    let doubt = doubt::weigh(engine, &found, unmodelled.as_ref(), &mut findings);
    if doubt.is_some() && data.uniform && is_in_feedback(&data.voltage_v, &data.reading) {
        return unidentified(engine, baseline, &Unidentifiable::Feedback);
    }
    let twin = never_reverses(data).then(|| twin(&findings)).flatten();
    let alone = credibility::likely_alone(&findings).filter(|alone| !found.rivals.contains(alone));
    let alternatives: Vec<Vec<&str>> = found.rivals.iter().cloned().chain(twin).chain(alone).collect();
    // What was identified from the same readings is no error that they would have shown.
    let would_show = (findings.is_empty() && doubt.is_none() && !data.normalisation.identified)
        .then(|| margins::margins(engine, extended, found.warm_start.penalty_factor));
    let insufficient = would_show.as_ref().is_some_and(|margins| !margins::informative(margins, engine.base()));
    let verdict = verdict(doubt.is_some(), &alternatives, insufficient, &findings);
    let may_be_suspect = |cause| match verdict {
        Verdict::Explained => false,
        // The open question is which of the alternatives it is.
        Verdict::Ambiguous => alternatives.iter().any(|set| set.contains(&cause)),
        Verdict::Consistent => unmodelled.is_some(),
        Verdict::Unexplained | Verdict::Insufficient => true,
    };
    let (suspects, sets): (Vec<_>, Vec<_>) = match verdict {
        Verdict::Explained => Default::default(),
        _ => suspects(engine, &found.best, &found.regular, mem::take(&mut found.explored), may_be_suspect)
            .into_iter()
            .unzip(),
    };
    let gain = if findings.is_empty() { 0.0 } else { 1.0 - after.held_out_rmse / before.held_out_rmse.max(1e-12) };
    let reading_map = engine.reading_map(found.model());
    let export = export(engine, found.model(), reading_map, held);

    let report = Report {
        extended: Extended {
            gain,
            quality: after,
            law_range_v: export.law_range_v,
            model: None,
            fixed_point_error_v: export.fixed_point_error_v,
            tick_refuses: export.tick_refuses,
        },
        next_experiment: next_experiment(verdict, &findings, &alternatives, extended.strongly_autocorrelated()),
        findings,
        suspects,
        would_show,
        alternatives,
        leftover: doubt.or(left),
        ..without_findings(data, extended, verdict, before)
    };
    found.add_contenders(sets);
    Diagnosis {
        report,
        data: data.clone(),
        baseline,
        plant: export.file,
        held_out,
        ranking,
        equation: None,
        zero_offsets: engine.zero_offsets(&found.best.fit),
        observed: observed.clone(),
        regular: found.regular,
        held_out_in_place,
        score: found.best.score,
        base: engine.base().clone(),
        contenders: found.contenders,
        unexplained_v: unmodelled.map_or(0.0, |found| found.rms),
        warm_start: Some(found.warm_start),
        extended: found.best.fit,
    }
}

/// The report of a record before anything is found, with the noise and the residual of a fit; `quality` is of the simulation as it is given.
fn without_findings(data: &Data, fit: &Fit, verdict: Verdict, quality: Quality) -> Report {
    Report {
        schema: SCHEMA,
        rows: data.rows(),
        complete: true,
        search: SearchReport::default(),
        verdict,
        nominal: Nominal::default(),
        baseline: quality,
        findings: Vec::new(),
        suspects: Vec::new(),
        take_out: Vec::new(),
        would_show: None,
        alternatives: Vec::new(),
        next_experiment: None,
        extended: Extended {
            quality,
            gain: 0.0,
            law_range_v: None,
            model: None,
            fixed_point_error_v: None,
            tick_refuses: None,
        },
        linear: None,
        equation: None,
        equation_details: None,
        leftover: None,
        noise: noise_report(&fit.noise),
        residual: residual_report(data, fit),
        records: Vec::new(),
        rivals: Vec::new(),
        experiment: None,
    }
}

/// All findings, the one that explains the largest mean square error first.
fn findings(engine: &mut Engine, found: &Found) -> Vec<Finding> {
    let (data, observed, fit) = (engine.data, engine.observed, &found.best.fit);
    let mut findings: Vec<Finding> = found.causes.iter().map(|cause| finding(engine, found, cause)).collect();
    let isolated = adequacy::spikes(engine, fit).is_none();
    for mut shown in reading_findings(data, observed, fit, isolated) {
        take_over(&mut shown, &mut findings);
        findings.push(shown);
    }
    findings.sort_by(|a, b| explained(b).total_cmp(&explained(a)));
    findings
}

/// Removes the finding of the same cause that the search made, such as the knee of a bound that the readings prove, and takes over those
/// of its parameters that are missing.
fn take_over(shown: &mut Finding, searched: &mut Vec<Finding>) {
    if let Some(place) = searched.iter().position(|finding| finding.cause == shown.cause && !finding.proved) {
        for (name, parameter) in searched.remove(place).parameters {
            if shown.parameters.iter().all(|(known, _)| *known != name) {
                shown.parameters.push((name, parameter));
            }
        }
    }
}

/// The verdict, by the first that applies: unexplained structure, alternatives, margins too wide, no findings.
fn verdict(unexplained: bool, alternatives: &[Vec<&'static str>], insufficient: bool, findings: &[Finding]) -> Verdict {
    match () {
        () if unexplained => Verdict::Unexplained,
        () if !alternatives.is_empty() => Verdict::Ambiguous,
        () if insufficient => Verdict::Insufficient,
        () if findings.is_empty() => Verdict::Consistent,
        () => Verdict::Explained,
    }
}

/// Reports a record that identifies no spring.
fn unidentified(engine: &Engine, baseline: Fit, reason: &Unidentifiable) -> Diagnosis {
    let data = engine.data;
    let held_out = baseline.residual.clone();
    let quality = quality(engine, &baseline, &held_out, false);
    let report = Report {
        next_experiment: Some(reason.next_experiment().into()),
        leftover: reason.leftover(),
        ..without_findings(data, &baseline, reason.verdict(), quality)
    };
    Diagnosis {
        report,
        data: data.clone(),
        score: baseline.log_likelihood,
        extended: baseline.clone(),
        baseline,
        plant: restored(engine, engine.base().file()),
        held_out_in_place: held_out.clone(),
        held_out: [held_out.clone(), held_out],
        ranking: Vec::new(),
        equation: None,
        zero_offsets: vec![0.0; data.rows_of_records().len()],
        observed: engine.observed.clone(),
        regular: engine.observed.clone(),
        base: engine.base().clone(),
        contenders: Vec::new(),
        unexplained_v: 0.0,
        warm_start: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Parameter;
    use crate::dimension::Dimension;

    #[test]
    fn a_bound_that_the_readings_prove_takes_over_the_knee_that_the_search_found() {
        let of = |names: &[(&str, f64)], proved| Finding {
            cause: "sensor-saturation",
            probability: if proved { 1.0 } else { 0.4 },
            parameters: names.iter().map(|(name, value)| ((*name).to_owned(), parameter(*value))).collect(),
            rmse_before: 2.0,
            rmse_after: 1.0,
            evidence: String::new(),
            proved,
        };
        let mut searched = vec![of(&[("limit", 399.0), ("knee", 7.0)], false)];
        let mut shown = of(&[("limit", 400.0)], true);
        take_over(&mut shown, &mut searched);
        let values: Vec<_> = shown.parameters.iter().map(|(name, it)| (name.as_str(), it.value)).collect();
        assert!(searched.is_empty() && values == [("limit", 400.0), ("knee", 7.0)], "{values:?}");
        // The other bound is a finding of its own.
        let mut both = vec![shown];
        take_over(&mut of(&[("limit", 20.0)], true), &mut both);
        assert_eq!(both.len(), 1);
    }

    fn parameter(value: f64) -> Parameter {
        let [low, high] = [value - 1.0, value + 1.0];
        let (dimension, unit) = (Dimension::Reading, String::new());
        Parameter { value, low, high, unit, at_bound: false, extrapolated_from_v: None, dimension }
    }
}
