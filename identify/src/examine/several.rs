//! The diagnosis of several records of one spring.
//!
//! Each record has its own initial state, zero offset and noise.
//!
//! 1. Each record is diagnosed on its own: a cause that no record shows is not looked for in all of them, where a fault of one record
//!    would find a cause that explains a part of it.
//! 2. Of these causes, those that the records share are found in all of them, each record held out as a whole.
//! 3. All causes are searched in all of them. Those that no record shows alone are kept if they predict most records better than
//!    without them, by a fit to the others: what all records share, each of them too weakly.
//! 4. Each record is diagnosed on its own against the spring with the shared causes; what is found there is in that record only: a
//!    fault, not a property of the spring.

use std::borrow::Cow;
use std::ops::Range;

use anyhow::Result;

use simulation::plant_file::PlantFile;
use simulation::record::Record;

use crate::answer::{Finding, RecordReport, Report, Verdict};
use crate::dimension::Dimension;
use crate::effects::{EFFECTS, index_of};
use crate::examine::options::Options;
use crate::examine::passes::{self, Normalised, diagnose_together, examine, informative, reports_changes, withhold};
use crate::plant::base::Base;
use crate::record::clock::with_times_of_clock;
use crate::record::held::{Held, held};
use crate::stats::scale::root_mean_square;
use crate::stats::thresholds::empirical::FINEST_V;
use crate::stats::thresholds::probability::CLEARLY_LIKELIER;
use crate::verdict::credibility;
use crate::verdict::diagnosis::Diagnosis;
use crate::verdict::held_findings::add_held;
use crate::verdict::linear_rival::compare;
use crate::verdict::quality::fit_percent;

/// Causes that are looked for in each record alone: a hum has a phase of its own in each, and each has a zero of its own.
const OF_ONE_RECORD: [&str; 2] = ["hum", "reading-offset"];
/// Largest number of times that the shared causes are found again, without the faults of single records.
const ROUNDS: usize = 3;

/// Finds out what the simulation gets wrong on several records of one spring, together and, in the report's `records`, each
/// beyond the shared causes; `progress` receives the names of the best causes so far, separated by commas. A single record is
/// diagnosed as by [`examine`].
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a record with fewer than eight readings.
pub fn examine_several(records: &[Record], options: &Options, mut progress: impl FnMut(&str)) -> Result<Diagnosis> {
    if let [record] = records {
        return examine(record, options, progress);
    }
    // A gain and a relaxation that all records share, and a zero for each, are not estimated anew for every set of causes.
    let options = &options.with_fixed_plant();
    let rows = records.iter().flat_map(|record| &record.rows).filter(|row| row.measured.is_some()).count();
    let timed = with_times_of_clock(records);
    let records = &timed[..];
    let held: Vec<Option<Held>> = records.iter().map(held).collect();
    let informative: Vec<Record> =
        records.iter().zip(&held).map(|(record, held)| informative(record, held.as_ref()).into_owned()).collect();
    let records = &informative[..];
    let (linear, mut shown) = (passes::linear(records, options), Vec::new());
    for record in records {
        let record = std::slice::from_ref(record);
        let alone = diagnose_together(record, options, options.causes(), &mut |causes| {
            progress(&format!("{}: {causes}", record[0].name))
        })?;
        shown.extend(alone.found.report.findings.iter().map(|finding| finding.cause));
    }
    shown.retain(|cause| !OF_ONE_RECORD.contains(cause));
    let reports = |held: &Option<Held>| reports_changes(held.as_ref());
    let mut together = shared(records, records, options, &shown, &mut progress)?;
    let mut each = of_each(records, &together, options, &mut progress)?;
    // A fault of one record biases what is found in all of them, and that in turn the fault.
    let mut faultless = Cow::Borrowed(records);
    for _ in 0..ROUNDS {
        if !is_biased(&together, &each) {
            break;
        }
        let less = without_faults(records, &together, &each);
        if less == *faultless {
            break;
        }
        faultless = Cow::Owned(less);
        together = shared(&faultless, records, options, &shown, &mut progress)?;
        each = of_each(records, &together, options, &mut progress)?;
    }
    if let Cow::Owned(faultless) = &faultless {
        with_faults(&mut together, records, faultless);
    }
    // How many readings a link loses, and when, is a matter of each record; a sensor that reports changes does so in all of them.
    let longest = held.iter().flatten().max_by_key(|held| held.rows.len());
    if let Some(shared) = longest.filter(|_| held.iter().all(reports)) {
        add_held(&mut together, &records[0], shared, options.input, &options.units);
    }
    for (index, (alone, held)) in each.into_iter().zip(&held).enumerate() {
        let record = &records[index];
        let mut alone = alone.without_rivals(std::slice::from_ref(record));
        let offset = together.zero_offsets[index] + alone.zero_offsets[0];
        if let Some(held) = held {
            add_held(&mut alone, record, held, options.input, &options.units);
        }
        together.report.complete &= alone.report.complete;
        let of = of_record(&together, &alone, &record.name, offset);
        // A linear model of all records follows a fault of one, so that the causes are judged with it as well.
        if let Some(part) = together.data.parts.get(index).filter(|_| !of.findings.is_empty()) {
            together.held_out_in_place[part.rows.clone()].copy_from_slice(&alone.held_out_in_place);
        }
        together.report.records.push(of);
    }
    let verdict = verdict(&together);
    if verdict != together.report.verdict {
        if verdict == Verdict::Unexplained {
            credibility::in_unexplained(&mut together.report.findings, 0.0);
        }
        together.conclude(verdict);
    }
    together.report.rows = rows;
    withhold(&mut together, options);
    together.report.leftover =
        together.report.records.iter().find_map(|of| Some(format!("{}: {}", of.name, of.leftover.as_ref()?)));
    compare(&mut together, linear.as_ref().filter(|_| !held.iter().any(reports)));
    credibility::unlikely_to_suspects(&mut together.report);
    Ok(together)
}

/// Returns the records without the likely causes that are found in one of them only. A cause of the spring that is found again in a record
/// is what the bias left there.
fn without_faults(records: &[Record], joint: &Diagnosis, each: &[Normalised]) -> Vec<Record> {
    let has = |alone: &Normalised, cause: &str| {
        alone.found.report.findings.iter().any(|finding| finding.cause == cause && finding.is_likely())
    };
    let is_fault =
        |cause: &str| !is_in_spring(joint, cause) && each.iter().filter(|alone| has(alone, cause)).count() == 1;
    let less = |(record, alone): (&Record, &Normalised)| {
        alone.without_faults(record, |cause| has(alone, cause) && is_fault(cause))
    };
    records.iter().zip(each).map(less).collect()
}

/// Gives the errors of the simulation as it is given the faults back, without which the records were compared with it.
fn with_faults(joint: &mut Diagnosis, records: &[Record], faultless: &[Record]) {
    let readings = |of: &[Record]| -> Vec<f64> {
        of.iter().flat_map(|record| record.rows.iter().filter_map(|row| row.measured)).collect()
    };
    let (read, less) = (readings(records), readings(faultless));
    for residual in [&mut joint.baseline.residual, &mut joint.held_out[0]] {
        residual.iter_mut().zip(&read).zip(&less).for_each(|((left, read), less)| *left += read - less);
    }
    let [rmse, held_out_rmse] =
        [&joint.baseline.residual, &joint.held_out[0]].map(|residual| root_mean_square(residual));
    let finest = joint.data.scales().restored(Dimension::ReadingSize, FINEST_V.get());
    let Report { baseline, extended, findings, .. } = &mut joint.report;
    (baseline.rmse, baseline.held_out_rmse) = (rmse, held_out_rmse);
    baseline.fit_percent = fit_percent(rmse, &read, finest);
    if !findings.is_empty() {
        extended.gain = 1.0 - extended.quality.held_out_rmse / held_out_rmse.max(1e-12);
    }
}

/// True if some record has a fault, and either no causes explain all records or one of them is found in that record again.
fn is_biased(joint: &Diagnosis, each: &[Normalised]) -> bool {
    let mut likely = each.iter().flat_map(|alone| &alone.found.report.findings).filter(|finding| finding.is_likely());
    let explained = matches!(joint.report.verdict, Verdict::Explained | Verdict::Consistent);
    if explained { likely.any(|finding| is_in_spring(joint, finding.cause)) } else { likely.next().is_some() }
}

/// The causes that all records share, those of `shown` or clearly likelier ones; `files` are the records as they were read.
fn shared(
    records: &[Record],
    files: &[Record],
    options: &Options,
    shown: &[&'static str],
    progress: &mut dyn FnMut(&str),
) -> Result<Diagnosis> {
    let strong = diagnose_together(records, options, Some(shown), progress)?;
    let all: Vec<&'static str> =
        EFFECTS.iter().map(|effect| effect.cause()).filter(|cause| !OF_ONE_RECORD.contains(cause)).collect();
    let all = options.causes().map_or(all, <[_]>::to_vec);
    let weak = diagnose_together(records, options, Some(&all), progress)?;
    let clearly_likelier = weak.found.score > strong.found.score + CLEARLY_LIKELIER;
    let is_weak = clearly_likelier && predicts_most_records_better(&weak.found, &strong.found);
    let found = if is_weak { weak } else { strong };
    Ok(found.with_rivals(files, options))
}

/// The diagnosis of each record on its own, against the spring with the causes that all records share, and from its zero.
fn of_each(
    records: &[Record],
    joint: &Diagnosis,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Normalised>> {
    let plant = "the spring with the shared causes".to_owned();
    // What no plant file holds is found again in each record.
    let base = spring(joint).unwrap_or_else(|| options.base.clone());
    let options = Options { plant, base, zero_unknown: true, ..options.clone() };
    let alone = |(record, offset): (&Record, &f64)| {
        let from_zero = Record { rows: record.rows.iter().map(|row| row.less(*offset)).collect(), ..record.clone() };
        let mut of_this = |causes: &str| progress(&format!("{}: {causes}", record.name));
        diagnose_together(std::slice::from_ref(&from_zero), &options, options.causes(), &mut of_this)
    };
    records.iter().zip(&joint.zero_offsets).map(alone).collect()
}

/// True if a diagnosis predicts more than half of the records better than another one, each by a fit to the other records.
fn predicts_most_records_better(one: &Diagnosis, other: &Diagnosis) -> bool {
    let parts = &one.data.parts;
    let error = |of: &Diagnosis, rows: &Range<usize>| root_mean_square(&of.held_out_in_place[rows.clone()]);
    let better = parts.iter().filter(|part| error(one, &part.rows) < error(other, &part.rows)).count();
    2 * better > parts.len()
}

/// The extended spring without what no plant file holds; `None` if it is no spring that can be simulated.
fn spring(joint: &Diagnosis) -> Option<Base> {
    Base::new(PlantFile { unmodelled: None, ..joint.plant.clone() }).ok()
}

/// True if the extended spring, as a plant file, holds a cause that all records share.
fn is_in_spring(joint: &Diagnosis, cause: &str) -> bool {
    let is_in_model = index_of(cause).is_some_and(|effect| joint.extended.model.has(effect));
    let is_unmodelled = joint.plant.unmodelled.as_ref().is_some_and(|causes| causes.contains_key(cause));
    is_in_model && !is_unmodelled && spring(joint).is_some()
}

/// What is found in one record beyond the causes that all records share. One that the extended spring holds is found in a record again
/// only if it is larger or smaller there.
fn of_record(joint: &Diagnosis, alone: &Diagnosis, name: &str, offset: f64) -> RecordReport {
    let is_shared = |of: &Finding| joint.report.findings.iter().any(|it| it.cause == of.cause && it.is_likely());
    let shared = |finding: &Finding| is_shared(finding) && !is_in_spring(joint, finding.cause);
    let report = &alone.report;
    RecordReport {
        name: name.to_owned(),
        rows: report.rows,
        offset,
        sigma: report.noise.sigma,
        rmse: report.extended.quality.rmse,
        verdict: report.verdict,
        findings: report.findings.iter().filter(|finding| !shared(finding)).cloned().collect(),
        leftover: report.leftover.clone(),
    }
}

/// The verdict on all records: a structure that a fault of one record left in the joint fit counts only if that record's own
/// diagnosis leaves it as well.
fn verdict(joint: &Diagnosis) -> Verdict {
    let report = &joint.report;
    let any = |verdict| report.records.iter().any(|of| of.verdict == verdict);
    let faults = report.records.iter().any(|of| !of.findings.is_empty());
    match report.verdict {
        _ if any(Verdict::Unexplained) => Verdict::Unexplained,
        Verdict::Ambiguous => Verdict::Ambiguous,
        Verdict::Insufficient if !faults => Verdict::Insufficient,
        _ if any(Verdict::Ambiguous) => Verdict::Ambiguous,
        _ if report.findings.is_empty() && !faults => Verdict::Consistent,
        _ => Verdict::Explained,
    }
}
