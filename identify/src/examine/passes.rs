//! The passes of a diagnosis, in the order in which they run.
//!
//! | pass | question | runs | its result is kept |
//! | --- | --- | --- | --- |
//! | `promises_more` | were readings rounded to their grid, or cut off? | on a grid | it only chooses the next pass |
//! | `first_as_cut_off` | which causes, if they were cut off to it? | if they probably were | if clearly likelier than rounded with these causes |
//! | `as_rounded` | which causes, if readings were rounded to their grid? | otherwise | unless a later pass replaces it |
//! | `as_cut_off` | which, if they were cut off to their grid? | after it, if a quick fit prefers it | if clearly likelier |
//! | `with_missing_codes` | which, if a missing code is read as one of its neighbours? | if codes are missing | if that code is always the same one |
//! | `as_unbounded` | which, if a plateau is no bound of the sensor? | if the model does not reach beyond the bound | always |
//! | `without_unsupported_terms` | which parts of the plant file does the spring lack? | if a search was run | if clearly likelier |
//!
//! All passes work on a normalised record; the diagnosis is converted back to the file's units at the end. Every pass runs a
//! `search`, which on a long record first searches a part of its rows. "Clearly likelier" means a score that is higher by
//! `CLEARLY_LIKELIER` nats. A pass that is kept replaces the diagnosis of the pass before it, and starts from that one's best
//! models.

use std::borrow::Cow;

use anyhow::Result;

use simulation::bad_input;
use simulation::plant_file::{PlantFile, Reading};
use simulation::record::Record;

use crate::answer::{Nominal, Report, SearchReport, Verdict};
use crate::effects::index_of;
use crate::effects::model::Model;
use crate::examine::hypothesis::hypothesise;
use crate::examine::merits::Merits;
use crate::examine::options::Options;
use crate::fit::budget::Budget;
use crate::fit::engine::Engine;
use crate::fit::simulator::Simulator;
use crate::nominal::{BestLinear, best_linear};
use crate::plant::base::Base;
use crate::record::clock::with_times_of_clock;
use crate::record::data::Data;
use crate::record::held::{Held, held};
use crate::record::input::Input;
use crate::record::normalisation::Normalisation;
use crate::record::observed::{Kind, Observed};
use crate::search::{Scored, Search, WarmStart};
use crate::stats::scale::variance;
use crate::stats::thresholds::empirical::{LARGEST_ERROR_RATIO, LONG_RECORD_ROWS, ROWS_TO_DIAGNOSE, ROWS_TO_SEARCH};
use crate::stats::thresholds::probability::CLEARLY_LIKELIER;
use crate::verdict::credibility;
use crate::verdict::diagnosis::{self, Diagnosis};
use crate::verdict::doubt;
use crate::verdict::held_findings::add_held;
use crate::verdict::hypotheses::hypotheses;
use crate::verdict::linear_rival::compare;

/// Finds out what the simulation gets wrong on a record.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a record with fewer than eight readings.
pub fn diagnose(record: &Record, options: &Options) -> Result<Report> {
    examine(record, options, |_| ()).map(|diagnosis| diagnosis.report)
}

/// Finds out what the simulation gets wrong on a record, and returns the report with all that is needed to draw it; `progress`
/// receives the names of the best causes so far, separated by commas.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a record with fewer than eight readings.
pub fn examine(record: &Record, options: &Options, mut progress: impl FnMut(&str)) -> Result<Diagnosis> {
    let timed = with_times_of_clock(std::slice::from_ref(record));
    let record = &timed[0];
    let held = held(record);
    let informative = informative(record, held.as_ref());
    let records = std::slice::from_ref(&*informative);
    let mut found = diagnose_together(records, options, options.causes(), &mut progress)?.with_rivals(records, options);
    let linear = linear(records, options);
    found.report.linear = linear.as_ref().map(|linear| linear.error);
    // New readings are ahead of the response, because noise decides when they are sent: a linear model of them is no judge.
    let judge = linear.as_ref().filter(|_| !reports_changes(held.as_ref()));
    compare(&mut found, judge);
    credibility::unlikely_to_suspects(&mut found.report);
    withhold(&mut found, options);
    hypothesise(&mut found, &records[0], options, judge);
    if let Some(held) = &held {
        add_held(&mut found, record, held, options.input, &options.units);
    }
    Ok(found)
}

/// Makes a verdict `insufficient` that says nothing of the record.
pub(super) fn withhold(diagnosis: &mut Diagnosis, options: &Options) {
    if options.says_nothing(diagnosis.report.verdict) {
        diagnosis.conclude(Verdict::Insufficient);
    }
}

/// Returns the record without the held readings that say nothing of the response.
pub(super) fn informative<'r>(record: &'r Record, held: Option<&Held>) -> Cow<'r, Record> {
    match held {
        Some(of) if !reports_changes(held) => Cow::Owned(of.left_out(record)),
        _ => Cow::Borrowed(record),
    }
}

/// Returns true for the record of a sensor that reports changes.
pub(super) fn reports_changes(held: Option<&Held>) -> bool {
    held.is_some_and(|held| held.reported_change().is_some())
}

/// The best linear model of some records.
pub(super) fn linear(records: &[Record], options: &Options) -> Option<BestLinear> {
    options.linear.clone().or_else(|| best_linear(records, options.input))
}

/// A diagnosis of records in the coordinates of the search.
pub(super) struct Normalised {
    pub(super) found: Diagnosis,
    normalisations: Vec<Normalisation>,
}

impl Normalised {
    fn merits(&self) -> Merits {
        let Diagnosis { report, observed, extended, score, .. } = &self.found;
        let unit = self.normalisations[0].scales.reading.abs();
        // What is rounded, or known up to an interval, has a probability, whatever the unit.
        let is_dense = extended.noise.half_step == 0.0;
        let dense = observed.kinds.iter().filter(|kind| is_dense && **kind == Kind::Exact).count();
        Merits {
            names_causes: !report.findings.is_empty(),
            explains: matches!(report.verdict, Verdict::Consistent | Verdict::Explained | Verdict::Ambiguous),
            held_out_rmse: unit * report.extended.quality.held_out_rmse,
            score: score - dense as f64 * unit.ln(),
            intervals: observed.intervals(),
        }
    }

    /// Returns this diagnosis under a simpler nominal spring or the other one, whichever has more merits; the work of both is counted.
    fn or(mut self, mut other: Self) -> Self {
        let is_better = self.merits().are_preferred_to(&other.merits());
        let (one, two) = (&mut self.found.report, &mut other.found.report);
        let work = one.search.work + two.search.work;
        let allowed = one.search.work + two.search.allowed;
        let complete = one.complete && two.complete;
        for report in [one, two] {
            (report.search.work, report.search.allowed, report.complete) = (work, allowed, complete);
        }
        if is_better { self } else { other }
    }

    /// Returns the record of this diagnosis as it would be without those of the causes that were found for which `is_fault` is true.
    pub(super) fn without_faults(&self, record: &Record, is_fault: impl Fn(&str) -> bool) -> Record {
        let Diagnosis { data, base, extended, .. } = &self.found;
        let mut simulator = Simulator::new(data, base);
        let [mut with, mut without] = [Vec::new(), Vec::new()];
        simulator.run(&extended.model, &mut with);
        let mut rest = extended.model.clone();
        rest.blocks.retain(|(block, _)| !is_fault(block.cause()));
        simulator.run(&rest, &mut without);
        let reading = data.scales().reading;
        let mut changes = with.iter().zip(&without).map(|(with, without)| reading * (with - without));
        let mut less = record.clone();
        for measured in less.rows.iter_mut().filter_map(|row| row.measured.as_mut()) {
            *measured -= changes.next().unwrap_or(0.0);
        }
        less
    }

    /// Returns the diagnosis in the units of its records, without the rival sets of causes.
    pub(super) fn without_rivals(self, records: &[Record]) -> Diagnosis {
        self.found.restored(records, &self.normalisations)
    }

    /// Returns the diagnosis in the units of its records, with the fits of the rival sets of causes for the plan of the next
    /// experiment.
    pub(super) fn with_rivals(self, records: &[Record], options: &Options) -> Diagnosis {
        let (rivals, experiment) = hypotheses(&self.found, records, &options.units.reading);
        let mut found = self.without_rivals(records);
        (found.report.rivals, found.report.experiment) = (rivals, Some(experiment));
        found
    }
}

/// Finds out what the simulation gets wrong on all of several records of one spring; `only` limits the search to some causes.
///
/// # Errors
/// The errors of [`examine`], for the first record that has one.
pub(super) fn diagnose_together(
    records: &[Record],
    options: &Options,
    only: Option<&[&'static str]>,
    progress: &mut dyn FnMut(&str),
) -> Result<Normalised> {
    let rows = records.iter().flat_map(|record| &record.rows).filter(|row| row.measured.is_some()).count();
    let Some(simpler) = &options.simpler else {
        let budget = Budget::new(options.effort, rows, options.stop.clone());
        return under(&options.base, records, options, only, &budget, progress);
    };
    let budget = Budget::part(SHARE_OF_SIMPLER, options.effort, rows, options.stop.clone());
    let simple = under(simpler, records, options, only, &budget, progress)?;
    if options.held_out_rmse.is_some_and(|of_full| simple.merits().need_no_other(of_full)) {
        return Ok(simple);
    }
    let budget = Budget::left(options.effort, rows, budget.spent_of_own(), rows, options.stop.clone());
    let full = under(&options.base, records, options, only, &budget, progress)?;
    Ok(simple.or(full))
}

/// The diagnosis under one nominal spring.
fn under(
    base: &Base,
    records: &[Record],
    options: &Options,
    only: Option<&[&'static str]>,
    budget: &Budget,
    progress: &mut dyn FnMut(&str),
) -> Result<Normalised> {
    let mut normalisations = Normalisation::of_each(records, base.file(), options.input, &options.units);
    for of in &mut normalisations {
        (of.unsettled, of.decays) = (options.unsettled, options.decays);
        (of.identified, of.zero_unknown) = (options.identified, options.zero_unknown);
    }
    let normalised: Vec<Record> = records.iter().zip(&normalisations).map(|(record, of)| of.record(record)).collect();
    let nominal = nominal(&options.plant, base);
    let base = base.normalised(&normalisations[0]);
    let prepare = |(record, of)| Data::thinned(record, options.input, 1, of);
    let prepared: Vec<Data> = normalised.iter().zip(&normalisations).map(prepare).collect();
    for (record, data) in records.iter().zip(&prepared) {
        if data.rows() < ROWS_TO_DIAGNOSE.count() {
            bad_input!(
                "{}: {} row(s) with a reading; expected at least {} to tell causes apart",
                record.name,
                data.rows(),
                ROWS_TO_DIAGNOSE.count()
            );
        }
    }
    let data = Data::joined(prepared);
    let progress = &mut |scored: &Scored| {
        let causes: Vec<&str> = scored.fit.model.blocks.iter().map(|(block, _)| block.cause()).collect();
        progress(&causes.join(", "));
    };
    let examined = ExaminedRecord { records: &normalised, input: options.input, data: &data, budget, only };
    let found = of_readings(&examined, &base, progress);
    let mut found = without_unsupported_terms(&examined, &base, found, progress);
    found.report.nominal = nominal;
    found.report.complete = !budget.is_stopped();
    found.report.search = SearchReport {
        effort: options.effort.name(),
        work: budget.spent(),
        allowed: budget.total(),
        finished: !budget.was_cut(),
    };
    Ok(Normalised { found, normalisations })
}

/// The nominal spring for the report, called `plant`.
fn nominal(plant: &str, base: &Base) -> Nominal {
    let Reading { gain, zero } = base.file().reading.unwrap_or_default();
    let PlantFile { relaxation, amplifier, modes, .. } = base.file();
    Nominal {
        plant: plant.to_owned(),
        gain,
        zero,
        share: relaxation.share,
        tau_s: relaxation.tau_s.clone(),
        delay_s: amplifier.as_ref().and_then(|amplifier| amplifier.delay_s).unwrap_or(0.0),
        freq_hz: modes.iter().map(|mode| mode.freq_hz).collect(),
    }
}

/// Share of the work for the diagnosis under a simpler nominal spring.
const SHARE_OF_SIMPLER: f64 = 0.35;
/// Share of the work that is left for one search, the others for its report and for later passes.
const SHARE_OF_SEARCH: f64 = 0.87;
/// Share of the work that is left for the search on a part of the rows of a long record.
const SHARE_OF_PART: f64 = 0.4;
/// Share of the work that is left for a search that only adds one cause after the other.
const SHARE_OF_TRIAL: f64 = 0.15;

/// One normalised record, or several of one spring, as all passes take them.
struct ExaminedRecord<'r> {
    records: &'r [Record],
    input: Input,
    data: &'r Data,
    budget: &'r Budget,
    /// Causes that are searched; `None` for all.
    only: Option<&'r [&'static str]>,
}

/// Receives each structure that becomes the best.
type Progress<'p> = &'p mut dyn FnMut(&Scored);

/// The passes over the readings, with one simulation.
fn of_readings(record: &ExaminedRecord, base: &Base, progress: Progress) -> Diagnosis {
    let rounded = Observed::new(record.data);
    let found = match rounded.truncated().filter(|cut| promises_more(record, base, cut, &rounded, progress)) {
        Some(cut) => first_as_cut_off(record, base, &cut, &rounded, progress),
        None => {
            let found = as_rounded(record, base, &rounded, progress);
            as_cut_off(record, base, found, progress)
        }
    };
    let found = with_missing_codes(record, base, found, progress);
    as_unbounded(record, base, found, progress)
}

/// True if causes that are added one after the other fit readings that were cut off clearly better than rounded ones, which need causes.
fn promises_more(record: &ExaminedRecord, base: &Base, cut: &Observed, rounded: &Observed, progress: Progress) -> bool {
    let mut trial = |observed| {
        let nothing = WarmStart { models: Vec::new(), penalty_factor: 1.0 };
        let (score, found) = best_score(record, base, observed, nothing, progress);
        (score, found.models.first().is_none_or(|best| best.blocks.is_empty()))
    };
    let (as_rounded, needs_no_cause) = trial(rounded);
    !needs_no_cause && trial(cut).0 > as_rounded + CLEARLY_LIKELIER
}

/// Searches with readings cut off to their grid, then with the same causes and rounded readings. Taken as rounded first, readings that
/// were cut off would take another cause for their shift.
fn first_as_cut_off(
    record: &ExaminedRecord,
    base: &Base,
    cut: &Observed,
    rounded: &Observed,
    progress: Progress,
) -> Diagnosis {
    let cut = search(record, base, cut, None, progress);
    let rounded = search(record, base, rounded, cut.warm_start.clone(), progress);
    if cut.score > rounded.score + CLEARLY_LIKELIER { cut } else { rounded }
}

/// Searches with readings rounded to their grid, if they lie on one, and with plateaus at the highest and lowest
/// reading taken as bounds of the sensor.
fn as_rounded(record: &ExaminedRecord, base: &Base, rounded: &Observed, progress: Progress) -> Diagnosis {
    search(record, base, rounded, None, progress)
}

/// Searches with readings cut off to their grid, which the readings alone cannot distinguish from rounding.
fn as_cut_off(record: &ExaminedRecord, base: &Base, found: Diagnosis, progress: Progress) -> Diagnosis {
    let may = |_: &Observed| !record.budget.is_over();
    let cut = found.observed.truncated().filter(may).filter(|cut| prefers(record, base, cut, &found));
    let Some(cut) = cut else { return found };
    let cut = search(record, base, &cut, found.warm_start.clone(), progress);
    if cut.score > found.score + CLEARLY_LIKELIER { cut } else { found }
}

/// True if the causes that were found fit readings that were cut off better; without a shift of the readings, which may stand
/// in for what was cut off.
fn prefers(record: &ExaminedRecord, base: &Base, cut: &Observed, found: &Diagnosis) -> bool {
    let shift = index_of("reading-offset").expect("an effect");
    let model = found.extended.model.without(shift);
    likelihood(record, base, cut, &model) > likelihood(record, base, &found.observed, &model)
}

/// Returns the log-likelihood of a model that is fitted to the readings as they are observed, in nats.
fn likelihood(record: &ExaminedRecord, base: &Base, observed: &Observed, model: &Model) -> f64 {
    let mut engine = Engine::within(record.data, observed, base, record.budget).limited_to(record.only);
    engine.fit_twice(model.clone()).log_likelihood
}

/// Searches with the missing codes of a converter read as their lower or their upper neighbours, if the causes that were found
/// fit one of these as well as any: a reading that may be either says less, and on one side of a code only.
fn with_missing_codes(record: &ExaminedRecord, base: &Base, found: Diagnosis, progress: Progress) -> Diagnosis {
    let model = &found.extended.model;
    let sides = [true, false].into_iter().filter(|_| !record.budget.is_over());
    let sides = sides.filter_map(|below| found.observed.reading_missing_codes_as(below));
    let best = sides.map(|side| (likelihood(record, base, &side, model), side)).max_by(|a, b| a.0.total_cmp(&b.0));
    // Where either neighbour may be read, each has half of the probability.
    let either = found.extended.log_likelihood
        - std::f64::consts::LN_2 * found.observed.count_missing(&found.extended.residual) as f64;
    match best.filter(|(likelihood, _)| *likelihood > either) {
        Some((_, side)) => search(record, base, &side, found.warm_start, progress),
        None => found,
    }
}

/// Searches without bounds of the sensor, where the model does not go beyond the plateau that looked like one.
fn as_unbounded(record: &ExaminedRecord, base: &Base, found: Diagnosis, progress: Progress) -> Diagnosis {
    if record.budget.is_over() || found.confirms_bounds() {
        return found;
    }
    search(record, base, &found.observed.without_bounds(), found.warm_start, progress)
}

/// Removes parts of the plant file that the record does not support, then repeats the passes over the readings.
///
/// Causes are added to a simulation. A part that the spring lacks would need the opposite of a cause, which does not exist for
/// hysteresis; combinations of other causes stand in for it. So each optional part is removed in turn, and stays removed if
///
/// ```text
/// score(best causes without the part) > score(best causes) + CLEARLY_LIKELIER
/// ```
fn without_unsupported_terms(record: &ExaminedRecord, base: &Base, found: Diagnosis, progress: Progress) -> Diagnosis {
    let Some(mut warm_start) = found.warm_start.clone() else { return found };
    let (mut score, mut base) = (found.score, base.clone());
    let mut unsupported_terms = Vec::new();
    while !record.budget.is_over() {
        let tried = base.without_each().map(|(part, base)| {
            let (score, warm_start) = best_score(record, &base, &found.observed, warm_start.clone(), progress);
            (part, base, score, warm_start)
        });
        let best = tried.max_by(|a, b| a.2.total_cmp(&b.2)).filter(|best| best.2 > score + CLEARLY_LIKELIER);
        let Some((part, without, better, found)) = best else { break };
        unsupported_terms.push(part);
        (base, score, warm_start) = (without, better, found);
    }
    if unsupported_terms.is_empty() {
        return found;
    }
    let without = of_readings(record, &base, progress);
    // Autocorrelated noise may make a spring likelier that predicts worse.
    let held_out = |diagnosis: &Diagnosis| diagnosis.report.extended.quality.held_out_rmse;
    if held_out(&without) > LARGEST_ERROR_RATIO.get() * held_out(&found) {
        return found;
    }
    compared_with(found, without, unsupported_terms)
}

/// The best score of a search from a warm start, in nats, with the warm start for the next one.
fn best_score(
    record: &ExaminedRecord,
    base: &Base,
    observed: &Observed,
    warm_start: WarmStart,
    progress: Progress,
) -> (f64, WarmStart) {
    let mut engine = Engine::within(record.data, observed, base, record.budget).limited_to(record.only);
    record.budget.grant(SHARE_OF_TRIAL);
    let mut search = Search::new(&mut engine);
    let best = search.run_from(warm_start, progress);
    let found = (best.score, search.warm_start());
    record.budget.close();
    found
}

/// The diagnosis `without` some parts of the plant file, with the simulation that has them as its baseline.
fn compared_with(with: Diagnosis, mut without: Diagnosis, unsupported_terms: Vec<&'static str>) -> Diagnosis {
    let report = &mut without.report;
    report.baseline = with.report.baseline;
    report.extended.gain = 1.0 - report.extended.quality.held_out_rmse / report.baseline.held_out_rmse.max(1e-12);
    let mut verdict = report.verdict;
    // Of an identified spring there is no file to take a part out of.
    if !without.data.normalisation.identified {
        if verdict == Verdict::Consistent {
            verdict = Verdict::Explained;
        }
        report.take_out = unsupported_terms;
    }
    // What stands in for a part of the plant file counts by what it removes beyond that part.
    for finding in &mut report.findings {
        finding.rmse_before = finding.rmse_before.min(report.baseline.rmse).max(finding.rmse_after);
    }
    let undetected = credibility::undetected(&without.observed, verdict == Verdict::Unexplained);
    credibility::with_unknown_laws(&mut report.findings, variance(&without.data.reading), undetected);
    if let Some(alone) = credibility::likely_alone(&report.findings).filter(|_| verdict == Verdict::Explained) {
        verdict = Verdict::Ambiguous;
        report.alternatives.push(alone);
    }
    if doubt::is_unearned(&report.findings, &without.extended) {
        verdict = Verdict::Unexplained;
        report.leftover.get_or_insert_with(|| doubt::UNEARNED.to_owned());
    }
    if verdict != report.verdict {
        without.conclude(verdict);
    }
    without.baseline = with.baseline;
    let [before, _] = with.held_out;
    without.held_out[0] = before;
    without
}

/// Searches and reports what was found, from a warm start or, on a long record, from a search on a part of its rows.
fn search(
    record: &ExaminedRecord,
    base: &Base,
    observed: &Observed,
    warm_start: Option<WarmStart>,
    progress: Progress,
) -> Diagnosis {
    let budget = record.budget;
    let warm_start = warm_start.or_else(|| on_part_of_rows(record, base, observed, progress));
    budget.grant(SHARE_OF_SEARCH);
    let mut engine = Engine::within(record.data, observed, base, budget).limited_to(record.only);
    diagnosis::diagnose(&mut engine, record.input == Input::Hold, warm_start, progress)
}

/// Searches a part of the rows of a long record, evenly spaced; `None` if the record is not long.
fn on_part_of_rows(record: &ExaminedRecord, base: &Base, observed: &Observed, progress: Progress) -> Option<WarmStart> {
    let rows = record.data.rows();
    if rows <= LONG_RECORD_ROWS.count() {
        return None;
    }
    let every = rows.div_ceil(ROWS_TO_SEARCH.count());
    let normalisation = &record.data.normalisation;
    let part = record.records.iter().map(|of| Data::thinned(of, record.input, every, normalisation));
    let part = Data::joined(part.collect());
    let observed = Observed::new(&part).with_conclusions_of(observed);
    let mut engine = Engine::within(&part, &observed, base, record.budget).limited_to(record.only);
    record.budget.grant(SHARE_OF_PART);
    let mut search = Search::new(&mut engine);
    search.run_once(progress);
    Some(search.warm_start())
}
