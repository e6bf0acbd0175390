//! From a record to an answer: search, then what each cause is worth, what rivals there are, what is left.

use crate::adequacy::absorbed_by_noise;
use crate::adequacy::in_step;
use crate::adequacy::informative::{Silent, no_spring, silent};
use crate::adequacy::spikes;
use crate::adequacy::unmodelled::{self, Leftover};
use crate::answer::{Extended, Finding, Report, SCHEMA, Verdict};
use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::record::data::Data;
use crate::record::observed::{Kind, Observed};
use crate::search::{Lead, Scored, Search, effects};
use crate::stats::scale::{FINEST_V, root_mean_square};
use crate::verdict::alternatives::{never_reverses, next_experiment, rivals, twin};
use crate::verdict::export;
use crate::verdict::finding::{explained, finding};
use crate::verdict::margins;
use crate::verdict::quality::{noise_report, quality, residual_report};
use crate::verdict::ranking::{self, Standing};
use crate::verdict::reading_findings::reading_findings;
use simulation::plant_file::PlantFile;

/// A model whose error is so many times that of the simulation as it was is none.
const WORSE: f64 = 1.005;
/// What must be left of the whitened residual's variance to be called unexplained.
const MATERIAL: f64 = 0.1;

/// A finished diagnosis: the report and what is needed to draw it.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The answer.
    pub report: Report,
    /// The record.
    pub data: Data,
    /// The simulation as it was.
    pub baseline: Fit,
    /// The simulation with the causes.
    pub extended: Fit,
    /// The extended spring.
    pub plant: PlantFile,
    /// Readings less what each of the two foretells on stretches that no fit has seen, in V.
    pub held_out: [Vec<f64>; 2],
    /// The best sets of causes beside each other, the best first.
    pub standings: Vec<Standing>,
    /// What its readings say of themselves.
    pub(crate) observed: Observed,
    /// What the causes are worth: held-out log-likelihood less their price, in nats.
    pub(crate) score: f64,
    /// For a search under another reading of the same rows.
    pub(crate) lead: Option<Lead>,
}

impl Diagnosis {
    /// True if readings that stopped at a bound did so because the spring goes beyond it, where a lattice lets them seem to.
    pub(crate) fn believes_its_bounds(&self) -> bool {
        let step = self.observed.grid.map_or(FINEST_V, |lattice| lattice.step);
        let beyond = |kind: Kind, sign: f64| {
            let rows = self.observed.kinds.iter().zip(&self.extended.residual).filter(|(of, _)| **of == kind);
            let beyond: Vec<f64> = rows.map(|(_, left)| -sign * left).collect();
            beyond.is_empty() || beyond.iter().sum::<f64>() > 0.5 * step * beyond.len() as f64
        };
        beyond(Kind::AtLeast, 1.0) && beyond(Kind::AtMost, -1.0)
    }
}

/// Runs the search and says what it found.
pub(crate) fn diagnose(
    data: Data,
    observed: &Observed,
    engine: &mut Engine,
    held: bool,
    given: Option<Lead>,
    progress: impl FnMut(&Scored),
) -> Diagnosis {
    let mut baseline = engine.evaluate(Model::default());
    if let Some(silent) = silent(engine, &baseline) {
        return unsearched(data, observed, engine, baseline, &silent);
    }
    let mut search = Search::new(engine);
    let mut best = match given {
        None => search.run(progress),
        Some(lead) => search.from(lead, progress),
    };
    // Likelier but farther off is no cure.
    let [before, after] = [&baseline, &best.fit].map(|fit| root_mean_square(&observed.errors(&fit.residual)));
    if after > WORSE * before {
        best = search.root();
    }
    if let Some(silent) = no_spring(search.judge(), &baseline, &best.fit, best.score) {
        return unsearched(data, observed, engine, baseline, &silent);
    }
    let mut alternatives = rivals(&search, &best);
    let mut weights = Vec::new();
    for effect in effects(&best.fit.model) {
        let left_out = search.left_out(&best, effect);
        weights.push((effect, search.best_without(effect), left_out));
    }
    let contenders = ranking::contenders(&search, &best);
    let lead = search.lead();
    let mut held_out = [&baseline, &best.fit].map(|fit| engine.held_out_residual(fit));
    let known = [(&baseline, &*held_out[0]), (&best.fit, &*held_out[1])];
    let standings = ranking::standings(engine, contenders, known);
    // The simulation as it was knows nothing of what is cut off.
    for left in baseline.residual.iter_mut().chain(&mut held_out[0]) {
        *left -= observed.truncation_v;
    }
    let spikes = spikes::test(engine, &best.fit);
    let alone = spikes.is_none();
    let left = absorbed_by_noise::test(&data, &observed.errors(&best.fit.residual), &best.fit.noise.autocorrelation)
        .or_else(|| in_step::test(engine, &best.fit))
        .or(spikes)
        .or_else(|| unmodelled::test(engine, &best.fit).filter(|left| left.significant))
        .filter(|left| left.rms > FINEST_V);
    let quality_before = quality(engine, &baseline, &held_out[0], false);
    let quality_after = quality(engine, &best.fit, &held_out[1], true);
    let mut findings: Vec<Finding> =
        weights.iter().map(|(effect, without, left_out)| finding(engine, &best, *effect, without, left_out)).collect();
    findings.extend(reading_findings(&data, observed, &best.fit, alone));
    findings.sort_by(|a, b| explained(b).total_cmp(&explained(a)));

    if never_reverses(&data) {
        alternatives.extend(twin(&findings));
    }
    let cure = export::of(engine, &best.fit.model, held);
    let material = left.as_ref().is_some_and(|left| left.share > MATERIAL);
    let would_show = (findings.is_empty() && !material).then(|| margins::margins(engine, &best.fit, lead.caution));
    let verdict = match () {
        () if material => Verdict::Unexplained,
        () if !alternatives.is_empty() => Verdict::Ambiguous,
        () if would_show.as_ref().is_some_and(|margins| !margins::informative(margins)) => Verdict::Insufficient,
        () if findings.is_empty() => Verdict::Consistent,
        () => Verdict::Explained,
    };
    let next_experiment = next_experiment(verdict, &findings, &alternatives, best.fit.strongly_autocorrelated());
    let leftover = left.map(|left| {
        let Leftover { place, share, rms, .. } = left;
        format!("{:.1} % of what is left ({rms:.3} V RMS) is no noise: it shows {place}", 100.0 * share)
    });
    let report = Report {
        schema: SCHEMA,
        rows: data.rows(),
        verdict,
        baseline: quality_before,
        extended: Extended {
            gain: if findings.is_empty() {
                0.0
            } else {
                1.0 - quality_after.held_out_rmse / quality_before.held_out_rmse.max(1e-12)
            },
            quality: quality_after,
            model: None,
            fixed_point_error_v: cure.fixed_point_error_v,
            tick_refuses: cure.tick_refuses,
        },
        findings,
        take_out: Vec::new(),
        would_show,
        alternatives,
        next_experiment,
        leftover,
        noise: noise_report(&best.fit.noise),
        residual: residual_report(&data, &best.fit),
    };
    Diagnosis {
        report,
        data,
        baseline,
        extended: best.fit,
        plant: cure.file,
        held_out,
        standings,
        observed: observed.clone(),
        score: best.score,
        lead: Some(lead),
    }
}

/// Of a record that can tell nothing of the spring.
fn unsearched(data: Data, observed: &Observed, engine: &Engine, baseline: Fit, silent: &Silent) -> Diagnosis {
    let unseen = baseline.residual.clone();
    let quality = quality(engine, &baseline, &unseen, false);
    let report = Report {
        schema: SCHEMA,
        rows: data.rows(),
        verdict: silent.verdict(),
        baseline: quality,
        findings: Vec::new(),
        take_out: Vec::new(),
        would_show: None,
        alternatives: Vec::new(),
        next_experiment: Some(silent.next_experiment().into()),
        extended: Extended { quality, gain: 0.0, model: None, fixed_point_error_v: None, tick_refuses: None },
        leftover: silent.leftover(),
        noise: noise_report(&baseline.noise),
        residual: residual_report(&data, &baseline),
    };
    Diagnosis {
        report,
        data,
        score: baseline.log_likelihood,
        extended: baseline.clone(),
        baseline,
        plant: engine.base().file().clone(),
        held_out: [unseen.clone(), unseen],
        standings: Vec::new(),
        observed: observed.clone(),
        lead: None,
    }
}
