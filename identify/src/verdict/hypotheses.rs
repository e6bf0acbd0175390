//! The best sets of causes with their fits and covariances, and the experiment that they were fitted to, for the next experiment.

use simulation::record::Record;

use crate::answer::{Suspect, Verdict};
use crate::effects::effect::FitContext;
use crate::effects::model::{Block, Model};
use crate::effects::{EFFECTS, index_of};
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval;
use crate::hypotheses::{Coordinates, Experiment, FirstSpring, FittedBlock, FittedNoise, Interval, Rival, are_same};
use crate::record::data::Data;
use crate::search::effects;
use crate::stats::thresholds::probability::RIVAL_ODDS;
use crate::verdict::diagnosis::Diagnosis;
use crate::verdict::restore::parameter;

/// Largest number of sets beyond those that the report names, unless there are more suspects and findings.
const MOST_FURTHER: usize = 4;
/// Sets that are worse than the best by more than this number of times the odds against a rival are left out unless the report
/// names them or structure is left unexplained.
const TIMES_RIVAL_ODDS: f64 = 10.0;

/// Returns the rivals of a diagnosis that is not restored yet, and its experiment.
pub(crate) fn hypotheses(diagnosis: &Diagnosis, records: &[Record], reading_unit: &str) -> (Vec<Rival>, Experiment) {
    let experiment = experiment(diagnosis, records, reading_unit);
    if diagnosis.contenders.is_empty() {
        return (Vec::new(), experiment);
    }
    let best = &diagnosis.extended;
    let names = |model: &Model| effects(model).iter().map(|&effect| EFFECTS[effect].cause()).collect::<Vec<_>>();
    let named = |model: &Model| diagnosis.report.alternatives.iter().any(|set| are_same(set, &names(model)));
    let unexplained = diagnosis.unexplained_v > 0.0;
    let near = |score: f64| unexplained || score > diagnosis.score - TIMES_RIVAL_ODDS * RIVAL_ODDS;
    // The sets of the suspects, and those without a finding, in which a verdict that becomes `unexplained` later makes a suspect.
    let is_suspect = |causes: &[&str]| {
        let set = |suspect: &Suspect| suspect.with.iter().copied().chain([suspect.cause]).collect::<Vec<_>>();
        diagnosis.report.suspects.iter().any(|suspect| are_same(causes, &set(suspect)))
    };
    let without_finding = |causes: &[&str]| {
        diagnosis.ranking.iter().any(|it| !it.best_without.is_empty() && are_same(causes, &it.causes))
    };
    let in_doubt = |model: &Model| {
        let causes = names(model);
        diagnosis.report.verdict != Verdict::Ambiguous && (is_suspect(&causes) || without_finding(&causes))
    };
    let others = diagnosis.contenders.iter().filter(|it| it.fit.model.structure() != best.model.structure());
    let (asked, others): (Vec<_>, Vec<_>) = others.partition(|it| named(&it.fit.model));
    let (doubtful, others): (Vec<_>, Vec<_>) = others.into_iter().partition(|it| in_doubt(&it.fit.model));
    let most = MOST_FURTHER.saturating_sub(doubtful.len());
    let further = others.into_iter().filter(|it| near(it.score)).take(most);
    let mut engine = Engine::new(&diagnosis.data, &diagnosis.observed, &diagnosis.base);
    let mut rivals = vec![rival(&mut engine, best, 0.0)];
    for other in asked.into_iter().chain(doubtful).chain(further) {
        rivals.push(rival(&mut engine, &other.fit, (other.score - diagnosis.score).min(0.0)));
    }
    for set in &diagnosis.report.alternatives {
        if !rivals.iter().any(|rival| are_same(set, &rival.causes))
            && let Some(fit) = exchanged(&mut engine, best, set)
        {
            let nats = (fit.log_likelihood - best.log_likelihood).min(0.0);
            rivals.push(rival(&mut engine, &fit, nats));
        }
    }
    (rivals, experiment)
}

/// Fits a set of causes that the search did not evaluate: the blocks of the best fit that it shares, and the likeliest form of
/// each other cause. `None` if a cause is found in the readings alone, or has no form that can be fitted.
fn exchanged(engine: &mut Engine, best: &Fit, set: &[&str]) -> Option<Fit> {
    let wanted: Vec<usize> = set.iter().map(|cause| index_of(cause)).collect::<Option<_>>()?;
    let mut model = best.model.clone();
    model.blocks.retain(|(block, _)| wanted.contains(&block.effect));
    let mut fit = None;
    for effect in wanted.into_iter().filter(|&effect| !best.model.has(effect)) {
        let residual = engine.residual(&model);
        let context = FitContext { data: engine.data, residual: &residual, sigma: best.noise.sigma };
        let starts = (0..EFFECTS[effect].common_forms()).filter_map(|form| {
            let points = EFFECTS[effect].initial_points(form, &context);
            Some((Block { effect, form }, points.get(points.len() / 2)?.clone()))
        });
        let starts: Vec<(Block, Vec<f64>)> = starts.collect();
        let fits = starts.into_iter().map(|(block, point)| engine.fit(model.with(block, point), &best.noise));
        let likeliest = fits.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?;
        model = likeliest.model.clone();
        fit = Some(likeliest);
    }
    fit
}

/// Returns a fit as a rival that is `nats` better than the best set.
fn rival(engine: &mut Engine, fit: &Fit, nats: f64) -> Rival {
    // The coordinates of an identified relaxation, behind those of all blocks, stay as they are in the plan.
    let fitted = fit.model.blocks.iter().flat_map(|(block, _)| block.coordinates(engine.data));
    let fitted = fitted.filter(|coordinate| coordinate.fitted).count();
    let covariance = interval::covariance(engine, fit).map_or_else(Vec::new, |matrix| {
        matrix.row_iter().take(fitted).map(|row| row.iter().take(fitted).copied().collect()).collect()
    });
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    let mut parameters_of = |effect: usize| {
        let parameters = interval::parameters(engine, fit, effect).into_iter().map(|(name, mut it)| {
            parameter(&mut it, engine.data.scales());
            (name, Interval { value: finite(it.value), low: finite(it.low), high: finite(it.high), unit: it.unit })
        });
        parameters.collect()
    };
    let blocks = &fit.model.blocks;
    Rival {
        causes: blocks.iter().map(|(block, _)| block.cause().to_owned()).collect(),
        nats,
        parameters: blocks.iter().map(|(block, _)| (block.cause().to_owned(), parameters_of(block.effect))).collect(),
        blocks: blocks
            .iter()
            .map(|(block, point)| FittedBlock {
                cause: block.cause().to_owned(),
                form: block.form,
                point: point.clone(),
            })
            .collect(),
        covariance,
    }
}

/// Returns the experiment of a diagnosis that is not restored yet.
fn experiment(diagnosis: &Diagnosis, records: &[Record], reading_unit: &str) -> Experiment {
    let (data, noise) = (&diagnosis.data, &diagnosis.extended.noise);
    let voltages = || records.iter().flat_map(|record| record.rows.iter().map(|row| row.voltage_v));
    let scales = data.scales();
    let start = data.normalisation.start.map(|start| FirstSpring {
        gain: start.gain,
        tau_s: start.tau_s,
        share: start.share,
        offset: start.offset,
    });
    // An identified spring as it is under the causes that were found.
    let relaxation = diagnosis.extended.model.relaxation.clone();
    let plant = match relaxation.is_empty() {
        true => diagnosis.base.file().clone(),
        false => Model { relaxation, ..Model::default() }.extend(&diagnosis.base, data),
    };
    Experiment {
        plant: data.normalisation.restored_plant(&plant).to_toml().expect("a plant file's tables are TOML"),
        lowest_v: voltages().fold(f64::INFINITY, f64::min),
        highest_v: voltages().fold(f64::NEG_INFINITY, f64::max),
        sample_s: data.record_sample_s * scales.second_s,
        duration_s: data.duration_s() * scales.second_s,
        reading_unit: reading_unit.to_owned(),
        coordinates: coordinates(data, start),
        noise: FittedNoise {
            sigma: noise.sigma,
            tail: Some(noise.nu).filter(|nu| nu.is_finite()),
            ar: noise.autocorrelation.ar.clone(),
            power: noise.autocorrelation.power,
            half_step: noise.half_step,
            unexplained: diagnosis.unexplained_v,
            upper: diagnosis.observed.upper,
            lower: diagnosis.observed.lower,
        },
    }
}

fn coordinates(data: &Data, start: Option<FirstSpring>) -> Coordinates {
    let scales = data.scales();
    Coordinates {
        second_s: scales.second_s,
        volt_v: scales.volt_v,
        zero: scales.zero,
        reading: scales.reading,
        output: scales.output,
        share: data.normalisation.share,
        even: data.normalisation.even,
        start,
        full_scale_v: data.full_scale_v,
        largest_v: data.largest_v,
        origin_v: data.origin_v,
        sample_s: data.record_sample_s,
        uniform: data.uniform,
    }
}
