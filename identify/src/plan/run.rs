//! A plan from a diagnosis: what is undecided, the best schedule, and what it is predicted to show.

use anyhow::Result;
use simulation::plant_file::parse_for_host;
use simulation::units::Unit;

use crate::dimension::Dimension;
use crate::effects::model::Model;
use crate::fit::engine::Engine;
use crate::hypotheses::{Rival, are_same};
use crate::noise::Noise;
use crate::plan::answer::{Command, Part, Plan, Response, Separation};
use crate::plan::candidate::{Candidate, Commands};
use crate::plan::design::Hypothesis;
use crate::plan::grid::normalisation;
use crate::plan::intervals::intervals;
use crate::plan::library::{Random, library};
use crate::plan::odds;
use crate::plan::predictor::{Predictor, Whitening};
use crate::plan::request::{Basis, Request};
use crate::plan::search;
use crate::plan::separation::{Design, Evaluation};
use crate::plan::suspects::{UNEXPLAINED, suspected, weighed};
use crate::plant::base::Base;
use crate::record::observed::{Kind, Observed};
use crate::stats::thresholds::probability::RIVAL_ODDS;

/// Sets that the diagnosis does not name count if they are behind by less than this number of times the odds against a rival.
const TIMES_RIVAL_ODDS: f64 = 2.0;
/// First number of the pseudo-random sequence.
const SEED: u64 = 20_261_123;
/// Contribution of a part to a separation below which it is not named.
const LEAST_CONTRIBUTION: f64 = 0.01;
/// Significant digits of a commanded voltage, as steps of the range.
const STEPS_OF_RANGE: f64 = 1e4;

/// Computes the next experiment after a diagnosis; `name` is what errors call its file.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] if the diagnosis is of another version, or the request cannot be met.
pub fn plan(basis: &Basis, request: &Request, name: &str) -> Result<Plan> {
    let mut random = Random(SEED);
    let (mut design, mut remarks) = design(basis, request, name, &mut random)?;
    let library = library(&design.frame, &mut random);
    design.probes = design.probes(&library[0]);
    let best = search::best(&design, library, &mut random);
    let commands = best.commands(&design.frame);
    let mut evaluation = design.evaluate(&commands, false);
    refit(&design, &commands, &mut evaluation);
    if !evaluation.pairs.is_empty() && request.limit_v.is_none() {
        remarks.extend(at_limit(&design, &commands));
    }
    let suspects = suspected(basis, &design, &evaluation);
    Ok(Plan { suspects, ..finished(&design, &best, &commands, &evaluation, remarks) })
}

/// Returns what is the same for every candidate, without probes, and remarks on it.
fn design(basis: &Basis, request: &Request, name: &str, random: &mut Random) -> Result<(Design, Vec<String>)> {
    let experiment = basis.experiment(name)?;
    let plant = parse_for_host(&format!("{name}, field experiment.plant"), &experiment.plant)?;
    let command_unit = Unit::of_voltage(plant.units.as_ref().and_then(|units| units.voltage.as_deref()).unwrap_or("V"));
    let frame = request.frame(experiment, &command_unit, &plant)?;
    let coordinates = experiment.coordinates;
    let base = Base::new(plant)?.normalised(&normalisation(&coordinates));
    let whitening = Whitening::new(&experiment.noise, &frame);
    let mut design = Design {
        frame,
        coordinates,
        noise: experiment.noise.clone(),
        reading_unit: experiment.reading_unit.clone(),
        command_unit,
        base,
        whitening,
        hypotheses: Vec::new(),
        draws: Vec::new(),
        bends: Vec::new(),
        probes: Vec::new(),
    };
    let (data, _) = design.record(&Candidate { segments: Vec::new(), tail: 1.0 }.commands(&frame), false);
    let mut remarks = Vec::new();
    let undecided = |rival: &Rival| {
        rival.nats == 0.0
            || basis.verdict == UNEXPLAINED
            || basis.alternatives.iter().any(|set| are_same(set, &rival.causes))
    };
    let near = |rival: &Rival| basis.verdict == "ambiguous" && rival.nats > -TIMES_RIVAL_ODDS * RIVAL_ODDS;
    for rival in weighed(basis).iter().filter(|rival| undecided(rival) || near(rival)) {
        let hypothesis = Hypothesis::of(rival, undecided(rival), &data, name)?;
        if let Some(other) = design.hypotheses.iter().find(|other| other.same_spring(&hypothesis)) {
            remarks.extend(hypothesis.named.then(|| {
                format!(
                    "{} and {} differ in one record's readings alone: run the same schedule again",
                    set(&other.causes),
                    set(&hypothesis.causes)
                )
            }));
            continue;
        }
        design.hypotheses.push(hypothesis);
    }
    if design.hypotheses.is_empty() {
        let (causes, model) = (Vec::new(), Model::default());
        let nothing = Hypothesis { causes, nats: 0.0, named: true, model, covariance: None };
        design.hypotheses.push(nothing);
    }
    for hypothesis in &design.hypotheses {
        design.draws.push(hypothesis.draws(&data, random));
        design.bends.push(hypothesis.bends(&data, design.base.relaxation.tau_s));
    }
    Ok((design, remarks))
}

/// Returns a set of causes in words.
fn set(causes: &[String]) -> String {
    if causes.is_empty() { "no cause".to_owned() } else { causes.join(" and ") }
}

/// Reduces the separations where a rival that is fitted again without linearising it comes closer to the truth.
fn refit(design: &Design, commands: &Commands, evaluation: &mut Evaluation) {
    let (mut data, grid) = design.record(commands, false);
    let likelier = grid.weights.iter().map(|weight| 0.5 * weight.ln()).sum::<f64>() / grid.weights.len() as f64;
    let observed = Observed {
        kinds: vec![Kind::Exact; grid.rows.len()],
        grid: None,
        upper: None,
        lower: None,
        scatter_v: design.noise.sigma,
        truncation_v: 0.0,
        missing_codes: 0,
        sign: 1.0,
        weights: Some(grid.weights.iter().map(|weight| weight.sqrt() / likelier.exp()).collect()),
    };
    let (readings, nominal) = {
        let mut predictor = Predictor::new(&data, &design.base, &grid, &design.whitening, &design.noise);
        let readings: Vec<Vec<f64>> = design.draws.iter().map(|draws| predictor.readings(&draws[0])).collect();
        (readings, predictor.readings(&Model::default()))
    };
    for pair in &mut evaluation.pairs {
        data.reading.clone_from(&readings[pair.truth]);
        let hypothesis = &design.hypotheses[pair.rival];
        let mut model = hypothesis.model.clone();
        for bend in &design.bends[pair.rival] {
            if bend.extra.is_some_and(|cause| !design.hypotheses[pair.truth].claims(cause)) {
                let extra = bend.model.blocks.iter().filter(|(block, _)| !hypothesis.model.has(block.effect));
                for (block, point) in extra {
                    model = model.with(*block, point.clone());
                }
            }
        }
        if model.blocks.is_empty() {
            continue;
        }
        let fitted = Engine::new(&data, &observed, &design.base).fit(model, &Noise::default_robust()).model;
        let mut predictor = Predictor::new(&data, &design.base, &grid, &design.whitening, &design.noise);
        let closest = predictor.readings(&fitted);
        let difference = predictor.whitened_difference(&readings[pair.truth], &closest);
        let part = design.part(predictor.mean_square(&readings[pair.truth], &nominal));
        let nats = 0.5 * part * difference.iter().map(|value| value * value).sum::<f64>();
        let factor = (nats / pair.nats[0].max(f64::MIN_POSITIVE)).min(1.0);
        pair.nats.iter_mut().for_each(|nats| *nats *= factor);
    }
}

/// Returns a remark if the schedule uses the whole range of the record, beyond which it might decide more.
fn at_limit(design: &Design, commands: &Commands) -> Option<String> {
    let frame = &design.frame;
    let top_v = frame.high_v.max(-frame.low_v);
    let used = commands.held.iter().any(|held| (held.1.abs() - top_v).abs() < 1e-6 * top_v);
    let Unit { name, si } = &design.command_unit;
    let limit = top_v * design.coordinates.volt_v / si;
    used.then(|| {
        format!(
            "the voltage stays within the {limit:.4} {name} of the record; --limit-v allows more if the spring does"
        )
    })
}

/// Puts the plan together, in the units of files.
fn finished(
    design: &Design,
    best: &Candidate,
    commands: &Commands,
    evaluation: &Evaluation,
    remarks: Vec<String>,
) -> Plan {
    let (frame, coordinates) = (&design.frame, &design.coordinates);
    let sample_s = frame.sample_s * coordinates.second_s;
    let nats: Vec<f64> = design.hypotheses.iter().map(|hypothesis| hypothesis.nats).collect();
    let causes = |index: usize| design.hypotheses[index].causes.clone();
    let separations = evaluation.pairs.iter().filter(|pair| pair.named).map(|pair| Separation {
        truth: causes(pair.truth),
        rival: causes(pair.rival),
        nats: pair.nats.iter().copied().fold(f64::INFINITY, f64::min),
        probability: odds::of_pair(pair, &nats),
    });
    let named: Vec<usize> = (0..nats.len()).filter(|&index| design.hypotheses[index].named).collect();
    let undecided = named.len() > 1;
    let volts = |normalised: f64| {
        let step = (frame.high_v - frame.low_v) * coordinates.volt_v / STEPS_OF_RANGE;
        let exact = normalised * coordinates.volt_v;
        // Rounding would exceed a slew rate.
        let rounded = if frame.slew_v_per_row.is_finite() { exact } else { (exact / step).round() * step };
        let digits = format!("{rounded:.9e}").parse().unwrap_or(rounded);
        f64::clamp(digits, frame.low_v * coordinates.volt_v, frame.high_v * coordinates.volt_v)
    };
    let time = |row: usize| {
        let digits = format!("{:.9e}", row as f64 * sample_s);
        digits.parse().unwrap_or(row as f64 * sample_s)
    };
    let held = commands.held.iter().map(|&(row, voltage)| Command { time_s: time(row), voltage_v: volts(voltage) });
    let end = Command { time_s: time(frame.rows), voltage_v: 0.0 };
    Plan {
        schedule: None,
        decides: if undecided { named.iter().map(|&index| causes(index)).collect() } else { Vec::new() },
        probability: undecided.then(|| odds::of_all(&evaluation.pairs, &nats, &named)),
        minutes: time(frame.rows) / 60.0,
        range_v: [volts(frame.low_v), volts(frame.high_v)],
        suspects: Vec::new(),
        separations: separations.collect(),
        parts: parts(design, best, commands, evaluation, &time, &volts),
        intervals: intervals(design, commands),
        commands: held.chain([end]).collect(),
        responses: responses(design, commands),
        reading_unit: design.reading_unit.clone(),
        command_unit: design.command_unit.clone(),
        remarks,
    }
}

/// Returns the parts of the schedule, each with the pair that it separates most.
fn parts(
    design: &Design,
    best: &Candidate,
    commands: &Commands,
    evaluation: &Evaluation,
    time: &impl Fn(usize) -> f64,
    volts: &impl Fn(f64) -> f64,
) -> Vec<Part> {
    let place = |index: usize| design.hypotheses[..index].iter().filter(|hypothesis| hypothesis.named).count();
    let of_pairs: Vec<([usize; 2], Vec<f64>)> = evaluation
        .pairs
        .iter()
        .filter(|pair| pair.named)
        .map(|pair| ([pair.truth, pair.rival].map(place), design.contributions(commands, pair.truth, pair.rival)))
        .collect();
    let ramps = |level: f64| {
        let of_level = |segment: &&crate::plan::candidate::Segment| {
            let own = design.frame.low_v + segment.level * (design.frame.high_v - design.frame.low_v);
            segment.ramp && (own - level).abs() < 1e-9
        };
        best.segments.iter().any(|segment| of_level(&segment))
    };
    let of_part = |(index, &(from, to, level)): (usize, &(usize, usize, f64))| {
        let largest = of_pairs.iter().max_by(|a, b| a.1[index].total_cmp(&b.1[index]));
        let largest = largest.filter(|(_, parts)| parts[index] > LEAST_CONTRIBUTION);
        let several = commands.held.iter().filter(|held| (from + 1..to).contains(&held.0)).count() > 1;
        Part {
            from_s: time(from),
            to_s: time(to),
            voltage_v: volts(level),
            ramp: several && ramps(level),
            separates: largest.map(|(pair, _)| *pair),
            contribution: largest.map_or(0.0, |(_, parts)| parts[index]),
        }
    };
    commands.parts.iter().enumerate().map(of_part).collect()
}

/// Returns the readings that every hypothesis predicts.
fn responses(design: &Design, commands: &Commands) -> Vec<Response> {
    let (data, grid) = design.record(commands, false);
    let mut predictor = Predictor::new(&data, &design.base, &grid, &design.whitening, &design.noise);
    let scales = &data.normalisation.scales;
    let of = |hypothesis: &Hypothesis| Response {
        causes: hypothesis.causes.clone(),
        time_s: data.time_s.iter().map(|time| scales.restored(Dimension::Time, *time)).collect(),
        reading: predictor
            .readings(&hypothesis.model)
            .into_iter()
            .map(|reading| scales.restored(Dimension::Reading, reading))
            .collect(),
    };
    design.hypotheses.iter().map(of).collect()
}
