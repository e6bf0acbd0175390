//! From a record to an answer: search, then what each cause is worth, what rivals there are, what is left.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::cure;
use super::data::Data;
use super::effect::{Quantity, Scene};
use super::effects::{EFFECTS, index_of};
use super::fit::{Engine, Fit, normal_equations};
use super::leftover::{self, Leftover};
use super::model::{Block, Model};
use super::noise::{Noise, scale_of_squares};
use super::observed::{Kind, Observed};
use super::report::{Extended, Finding, NoiseReport, Parameter, Quality, Report, ResidualReport, SCHEMA, Verdict};
use super::search::{Lead, Scored, Search, effects};
use super::standing::{self, Standing};
use super::swallowed;
use crate::plant_file::PlantFile;

/// A model whose error is so many times that of the simulation as it was is none.
const WORSE: f64 = 1.05;
/// Odds under which a rival set counts as possible, in nats.
const RIVAL: f64 = 3.0;
/// Rivals that are listed.
const MOST_RIVALS: usize = 3;
/// What must be left of the whitened residual's variance to be called unexplained.
const MATERIAL: f64 = 0.1;
/// A step of the readings this many of the noise's scales wide is worth naming.
const COARSE_STEP: f64 = 0.5;
/// A reading this many of the noise's scales off is an outlier, once there are outliers.
const FAR: f64 = 4.0;
/// 97.5 % of the standard normal.
const Z: f64 = 1.96;
/// Lags of the residual's correlations.
const LAGS: usize = 20;

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
    observed: Observed,
}

impl Diagnosis {
    /// True if readings that stopped at a bound did so because the spring goes beyond it, where a lattice lets them seem to.
    pub(super) fn believes_its_bounds(&self) -> bool {
        let Some(step) = self.observed.step else { return true };
        let beyond = |kind: Kind, sign: f64| {
            let rows = self.observed.kinds.iter().zip(&self.extended.residual).filter(|(of, _)| **of == kind);
            let beyond: Vec<f64> = rows.map(|(_, left)| -sign * left).collect();
            beyond.is_empty() || beyond.iter().sum::<f64>() > 0.5 * step * beyond.len() as f64
        };
        beyond(Kind::AtLeast, 1.0) && beyond(Kind::AtMost, -1.0)
    }
}

/// Runs the search and says what it found.
pub(super) fn diagnose(
    data: Data,
    observed: &Observed,
    engine: &mut Engine,
    held: bool,
    given: Option<Lead>,
    progress: impl FnMut(&Scored),
) -> Diagnosis {
    let baseline = engine.at(Model::default());
    if !informative(engine) {
        let unseen = baseline.residual.clone();
        let report = insufficient(&data, &baseline, engine, &unseen);
        return Diagnosis {
            report,
            data,
            extended: baseline.clone(),
            baseline,
            plant: engine.simulator.base.file().clone(),
            held_out: [unseen.clone(), unseen],
            standings: Vec::new(),
            observed: observed.clone(),
        };
    }
    let mut search = Search::new(engine);
    let mut best = match given {
        None => search.run(progress),
        Some(lead) => search.from(lead, progress),
    };
    // Likelier but farther off is no cure.
    let [before, after] = [&baseline, &best.fit].map(|fit| scale_of_squares(&observed.errors(&fit.residual)));
    if after > WORSE * before {
        best = search.root();
    }
    let rivals = rivals(&search, &best);
    let mut weights = Vec::new();
    for effect in effects(&best.fit.model) {
        let left_out = search.left_out(&best, effect);
        weights.push((effect, search.best_without(effect), left_out));
    }
    let contenders = standing::contenders(&search, &best);
    let standings = standing::standings(engine, contenders);
    let readings = reading_findings(&data, observed, &best.fit);
    let left = swallowed::test(&observed.errors(&best.fit.residual), &best.fit.noise.memory)
        .or_else(|| leftover::test(engine, &best.fit).filter(|left| left.significant));
    let held_out = [&baseline, &best.fit].map(|fit| engine.foretold(fit));
    let quality_before = quality(engine, &baseline, &held_out[0], false);
    let quality_after = quality(engine, &best.fit, &held_out[1], true);
    let mut findings: Vec<Finding> =
        weights.iter().map(|(effect, without, left_out)| finding(engine, &best, *effect, without, left_out)).collect();
    findings.extend(readings);
    findings.sort_by(|a, b| explained(b).total_cmp(&explained(a)));

    let mut alternatives = rivals;
    let cure = cure::of(engine, &best.fit.model, held);
    let monotone = never_reverses(&data);
    if monotone {
        alternatives.extend(twin(&findings));
    }
    let material = left.as_ref().is_some_and(|left| left.share > MATERIAL);
    let verdict = match () {
        () if material => Verdict::Unexplained,
        () if !alternatives.is_empty() => Verdict::Ambiguous,
        () if findings.is_empty() => Verdict::Consistent,
        () => Verdict::Explained,
    };
    let next_experiment = next_experiment(verdict, &findings, &alternatives);
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
        },
        findings,
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
    }
}

fn explained(finding: &Finding) -> f64 {
    finding.rmse_before.powi(2) - finding.rmse_after.powi(2)
}

/// True if gain and time constant would show in this record at all.
fn informative(engine: &mut Engine) -> bool {
    let data = engine.data;
    let moves = |values: &[f64]| values.iter().any(|value| *value != values[0]);
    // Under one voltage all the time, what the spring does may be its start as well as its answer.
    if !moves(&data.voltage_v) || !moves(&data.reading) {
        return false;
    }
    let probe = ["gain-error", "time-constant"].iter().filter_map(|cause| index_of(cause)).fold(
        Model::default(),
        |model, effect| {
            let point =
                if EFFECTS[effect].cause() == "gain-error" { 1.0 } else { engine.simulator.base.relaxation.tau_s.ln() };
            model.with(Block { effect, form: 0 }, vec![point])
        },
    );
    // The noise as it is at best, the information as it is where the search starts.
    let best = engine.fit(probe.clone(), &Noise::first_look());
    let residual = engine.residual(&probe);
    let start = Fit { model: probe, residual, noise: best.noise, ..best };
    let Some(covariance) = covariance(engine, &start) else { return false };
    // Half of the gain, or a factor of e in the time constant, is no knowledge.
    covariance[(0, 0)].sqrt() < 0.5 && covariance[(1, 1)].sqrt() < 1.0
}

fn insufficient(data: &Data, baseline: &Fit, engine: &Engine, unseen: &[f64]) -> Report {
    let quality = quality(engine, baseline, unseen, false);
    Report {
        schema: SCHEMA,
        rows: data.rows(),
        verdict: Verdict::Insufficient,
        baseline: quality,
        findings: Vec::new(),
        alternatives: Vec::new(),
        next_experiment: Some(
            "run a stair over the whole range up and down again, each step held for five time constants: from \
             this record the gain or the time constant could be almost anything"
                .into(),
        ),
        extended: Extended { quality, gain: 0.0, model: None, fixed_point_error_v: None },
        leftover: None,
        noise: noise_report(&baseline.noise),
        residual: residual_report(data, baseline),
    }
}

/// Sets of causes that are nearly as good, without being the best with more.
fn rivals(search: &Search, best: &Scored) -> Vec<Vec<&'static str>> {
    let own = effects(&best.fit.model);
    search
        .ranked()
        .into_iter()
        .take_while(|other| other.score > best.score - RIVAL)
        .map(|other| effects(&other.fit.model))
        .filter(|set| !own.iter().all(|effect| set.contains(effect)))
        .take(MOST_RIVALS)
        .map(|set| set.into_iter().map(|effect| EFFECTS[effect].cause()).collect())
        .collect()
}

/// On a record that only rises (or falls), memory and a law without memory are one.
fn twin(findings: &[Finding]) -> Option<Vec<&'static str>> {
    let swapped = |cause| match cause {
        "static-nonlinearity" => Some("hysteresis"),
        "hysteresis" => Some("static-nonlinearity"),
        _ => None,
    };
    let causes: Vec<&'static str> = findings.iter().map(|finding| finding.cause).collect();
    causes
        .iter()
        .any(|cause| swapped(*cause).is_some())
        .then(|| causes.iter().map(|&cause| swapped(cause).unwrap_or(cause)).collect())
}

/// True if the voltage never turns back by more than a fiftieth of its range.
fn never_reverses(data: &Data) -> bool {
    let mut extremes = (f64::MAX, f64::MIN);
    let (mut falls, mut rises) = (false, false);
    let slack = 0.02 * data.full_scale_v;
    for &voltage in &data.voltage_v {
        falls |= voltage < extremes.1 - slack;
        rises |= voltage > extremes.0 + slack;
        extremes = (extremes.0.min(voltage), extremes.1.max(voltage));
    }
    !(falls && rises)
}

fn next_experiment(verdict: Verdict, findings: &[Finding], alternatives: &[Vec<&'static str>]) -> Option<String> {
    match verdict {
        Verdict::Ambiguous => {
            let named: Vec<&str> = findings.iter().map(|finding| finding.cause).collect();
            let rival = alternatives.iter().flatten().find(|cause| !named.contains(cause));
            let ours = named.iter().find(|cause| !alternatives.iter().all(|set| set.contains(cause)));
            let cause = rival.or(ours)?;
            let experiment = EFFECTS[index_of(cause)?].experiment();
            Some(format!("run {experiment}"))
        }
        Verdict::Unexplained => Some(
            "run the same schedule again: what comes back is the spring's, what does not is the readings'".to_owned(),
        ),
        _ => None,
    }
}

/// What the readings themselves show.
fn reading_findings(data: &Data, observed: &Observed, fit: &Fit) -> Vec<Finding> {
    let mut findings = Vec::new();
    let raw = scale_of_squares(&fit.residual);
    let stopped_raw = scale_of_squares(&observed.errors(&fit.residual));
    let predicted: Vec<f64> = data.reading.iter().zip(&fit.residual).map(|(reading, left)| reading - left).collect();
    let single = |name: &str, value: f64, low: f64, high: f64, unit| {
        BTreeMap::from([(name.to_owned(), Parameter { value, low, high, unit })])
    };
    if let Some(step) = observed.step
        && step > COARSE_STEP * stopped_raw
    {
        let grid = data.reading[0];
        let after: Vec<f64> = data
            .reading
            .iter()
            .zip(&predicted)
            .map(|(reading, predicted)| reading - (((predicted - grid) / step).round() * step + grid))
            .collect();
        findings.push(Finding {
            cause: "quantisation",
            probability: 1.0,
            parameters: single("step", step, step * (1.0 - 1e-6), step * (1.0 + 1e-6), "V"),
            rmse_before: raw,
            rmse_after: scale_of_squares(&after).min(raw),
            evidence: format!(
                "every reading is a multiple of {step:.6} V from the first, {:.1} times the error that is left",
                step / raw
            ),
        });
    }
    for (bound, upper) in [(observed.upper, true), (observed.lower, false)] {
        let Some(bound) = bound else { continue };
        let stopped = data.reading.iter().filter(|&&reading| reading == bound).count();
        findings.push(Finding {
            cause: "sensor-saturation",
            probability: 1.0,
            parameters: single("limit", bound, bound - 1e-6 * bound.abs(), bound + 1e-6 * bound.abs(), "V"),
            rmse_before: raw,
            rmse_after: stopped_raw,
            evidence: format!(
                "{stopped} readings are exactly {bound}, the {} of all",
                if upper { "highest" } else { "lowest" }
            ),
        });
    }
    if let Some((_, wide)) = fit.noise.wide {
        let errors = observed.errors(&fit.residual);
        let white = fit.noise.whitened(&errors);
        let (far, kept): (Vec<usize>, Vec<usize>) =
            (0..white.len()).partition(|&row| white[row].abs() > FAR * fit.noise.sigma);
        let kept: Vec<f64> = kept.into_iter().map(|row| errors[row]).collect();
        let fraction = far.len() as f64 / white.len() as f64;
        let spread = (fraction * (1.0 - fraction) / white.len() as f64).sqrt();
        findings.push(Finding {
            cause: "outliers",
            probability: 1.0,
            parameters: single("fraction", fraction, (fraction - Z * spread).max(0.0), fraction + Z * spread, ""),
            rmse_before: stopped_raw,
            rmse_after: scale_of_squares(&kept),
            evidence: format!(
                "{} readings are off by {wide:.2} V, {:.0} times the noise: two scales fit far better than one heavy tail",
                far.len(),
                wide / fit.noise.sigma
            ),
        });
    }
    findings
}

/// `without` is the best structure without the effect, others in its place; `left_out` the best with nothing in its place.
fn finding(engine: &mut Engine, best: &Scored, effect: usize, without: &Scored, left_out: &Scored) -> Finding {
    let odds = best.score - without.score;
    let [before, rival, after] = [left_out, without, best].map(|scored| rms(engine, &scored.fit));
    let others: Vec<&str> = effects(&without.fit.model).into_iter().map(|other| EFFECTS[other].cause()).collect();
    let against = if others.is_empty() { "the simulation as it was".to_owned() } else { others.join(" and ") };
    let better = if best.fit.model.searched(effect, engine.data) {
        format!("the readings are {odds:.1} nats likelier, all places that were searched charged,")
    } else {
        format!("on held-out stretches this is {odds:.1} nats better")
    };
    Finding {
        cause: EFFECTS[effect].cause(),
        probability: 1.0 / (1.0 + (-odds.clamp(-40.0, 40.0)).exp()),
        parameters: parameters(engine, &best.fit, effect),
        rmse_before: before.max(after),
        rmse_after: after,
        evidence: format!("{}: {better} than the best without it ({against}, {rival:.3} V)", EFFECTS[effect].meaning()),
    }
}

fn rms(engine: &Engine, fit: &Fit) -> f64 {
    scale_of_squares(&engine.observed.errors(&fit.residual))
}

/// Inverse of the information on the fitted coordinates.
fn covariance(engine: &mut Engine, fit: &Fit) -> Option<DMatrix<f64>> {
    let jacobian = engine.jacobian(&fit.model, &fit.noise, &fit.residual);
    let terms = engine.terms(&fit.noise, &fit.residual);
    let (normal, _) = normal_equations(&jacobian, &terms);
    // Reweighting overstates what a heavy tail tells; the scores' own variance does not.
    let squares: f64 = terms.iter().map(|term| (term.weight * term.residual).powi(2)).sum();
    let weights: f64 = terms.iter().map(|term| term.weight).sum();
    let factor = if fit.noise.cell > 0.0 { 1.0 } else { (squares / weights).min(1.0) };
    (normal * factor).try_inverse().filter(|matrix| matrix.iter().all(|value| value.is_finite()))
}

/// The user's parameters of an effect with their intervals, by the delta method.
fn parameters(engine: &mut Engine, fit: &Fit, effect: usize) -> BTreeMap<String, Parameter> {
    let data = engine.data;
    let covariance = covariance(engine, fit);
    let bounds = fit.model.coordinates(data);
    let places: Vec<usize> = (0..bounds.len()).filter(|&place| bounds[place].fitted).collect();
    let mut start = 0;
    let mut found = BTreeMap::new();
    for (block, point) in &fit.model.blocks {
        if block.effect == effect {
            let quantities = |point: &[f64]| block.effect().quantities(block.form, point, data);
            let values = quantities(point);
            for (index, Quantity { name, unit, value }) in values.into_iter().enumerate() {
                let slope: Vec<f64> = places
                    .iter()
                    .map(|&place| {
                        if !(start..start + point.len()).contains(&place) {
                            return 0.0;
                        }
                        let mut moved = point.clone();
                        let step = 1e-5 * (1.0 + point[place - start].abs());
                        moved[place - start] += step;
                        (quantities(&moved)[index].value - value) / step
                    })
                    .collect();
                let error = covariance.as_ref().map_or(f64::INFINITY, |matrix| {
                    let slope = nalgebra::DVector::from_vec(slope);
                    (slope.transpose() * matrix * &slope)[(0, 0)].max(0.0).sqrt()
                });
                let reach = reach(block, point, data, index);
                found.insert(name, interval(value, error, unit, reach));
            }
            let residual = engine.residual(&fit.model.without(effect));
            let scene = Scene { data, residual: &residual, sigma: fit.noise.sigma };
            for (name, low, high) in block.effect().searched_range(block.form, point, &scene) {
                if let Some(parameter) = found.get_mut(&name) {
                    (parameter.low, parameter.high) = (low.min(parameter.value), high.max(parameter.value));
                }
            }
        }
        start += point.len();
    }
    found
}

/// Lowest and highest that a quantity can be: one coordinate after the other at its bounds.
fn reach(block: &Block, point: &[f64], data: &Data, index: usize) -> (f64, f64) {
    let mut reach = (f64::INFINITY, f64::NEG_INFINITY);
    for (place, bounds) in block.coordinates(data).iter().enumerate() {
        for bound in [bounds.lowest, point[place], bounds.highest] {
            let mut moved = point.to_vec();
            moved[place] = bound;
            let value = block.effect().quantities(block.form, &moved, data)[index].value;
            reach = (reach.0.min(value), reach.1.max(value));
        }
    }
    reach
}

/// Symmetric, but for what is only a size: that never crosses zero. Within the quantity's reach, unless the value is its end:
/// an amplitude of two parts is smallest between their bounds.
fn interval(value: f64, error: f64, unit: &'static str, reach: (f64, f64)) -> Parameter {
    let error = if error.is_finite() { error } else { 10.0 * value.abs() };
    let (mut low, mut high) = (value - Z * error, value + Z * error);
    if value > 0.0 && low < 0.0 && reach.0 >= 0.0 {
        let factor = (Z * error / value).min(50.0).exp();
        (low, high) = (value / factor, value * factor);
    }
    if reach.0 < value {
        low = low.max(reach.0);
    }
    if reach.1 > value {
        high = high.min(reach.1);
    }
    Parameter { value, low, high, unit }
}

/// `unseen` is the residual on held-out stretches; `stops` if the simulation knows of bounds at which readings stop.
fn quality(engine: &Engine, fit: &Fit, unseen: &[f64], stops: bool) -> Quality {
    let observed = engine.observed;
    let error = |residual: &[f64]| scale_of_squares(&if stops { observed.errors(residual) } else { residual.into() });
    let rmse = error(&fit.residual);
    let reading = &engine.data.reading;
    let mean = reading.iter().sum::<f64>() / reading.len() as f64;
    let spread = scale_of_squares(&reading.iter().map(|value| value - mean).collect::<Vec<_>>());
    Quality {
        rmse,
        fit_percent: 100.0 * (1.0 - rmse / spread.max(1e-12)),
        held_out_rmse: error(unseen),
        one_step_rmse: error(&fit.noise.whitened(&fit.residual)),
    }
}

fn noise_report(noise: &Noise) -> NoiseReport {
    NoiseReport {
        sigma: noise.sigma,
        tail: noise.nu.is_finite().then_some(noise.nu),
        memory_rows: noise.memory.ar.len(),
    }
}

fn residual_report(data: &Data, fit: &Fit) -> ResidualReport {
    let white = fit.noise.whitened(&fit.residual);
    let changes: Vec<f64> = (0..data.rows())
        .map(|row| if row == 0 { 0.0 } else { data.voltage_v[row] - data.voltage_v[row - 1] })
        .collect();
    let correlation = |a: &[f64], b: &[f64], lag: usize| {
        let lag = lag.min(a.len());
        let product: f64 = a[lag..].iter().zip(b).map(|(a, b)| a * b).sum();
        let size = (a.iter().map(|a| a * a).sum::<f64>() * b.iter().map(|b| b * b).sum::<f64>()).sqrt();
        product / size.max(1e-300)
    };
    ResidualReport {
        autocorrelation: (1..=LAGS).map(|lag| correlation(&white, &white, lag)).collect(),
        input_correlation: (0..=LAGS).map(|lag| correlation(&white, &changes, lag)).collect(),
        band: Z / (data.rows().max(1) as f64).sqrt(),
    }
}
