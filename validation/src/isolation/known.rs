//! Springs whose model is known to within intervals: alarms without a fault, and what is named, without and with the tolerance.

use model::isolation::Tolerance;
use model::{OutOfRange, Plant};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::fault::Fault;
use super::least_squares::Thresholds;
use super::run::{Decision, Known, Outcome, run_with};
use crate::ground_truth::{Cause, Effect};
use crate::markdown;

/// Half widths of the 95 % intervals of time constant, share and gain, relative.
const WIDTHS: [f64; 3] = [0.002, 0.005, 0.02];
/// Noise, in percent of 500 V.
const PERCENT: f64 = 0.2;
/// Springs without a fault for each run of a fault.
const HEALTHY: u64 = 5;
/// Random stream of the errors: another one than those of the faults.
const STREAM: u64 = 7;

/// The spring of a seed: its parameters are drawn from normal distributions around the model's with these 95 % intervals.
fn known(half_width: f64, tolerated: bool, seed: u64) -> Known {
    let draw = |random: &mut ChaCha8Rng| -> f64 {
        let unit: f64 = StandardNormal.sample(random);
        unit * half_width / 1.96
    };
    with_errors(draw, if tolerated { half_width } else { 0.0 }, seed)
}

/// The spring of a seed: each parameter is anywhere within its tolerance.
pub(super) fn within(tolerated: f64, seed: u64) -> Known {
    with_errors(|random| tolerated * random.random_range(-1.0..1.0), tolerated, seed)
}

/// The spring of a seed with a tolerance; `draw` draws the relative error of a parameter.
fn with_errors(draw: impl Fn(&mut ChaCha8Rng) -> f64, tolerated: f64, seed: u64) -> Known {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(STREAM);
    let mut error = |cause: Cause, neutral: f64| {
        let full_size = vec![neutral * (1.0 + draw(&mut random))];
        Effect { cause, form: 0, full_size, neutral: vec![neutral], size: 1.0 }
    };
    let Plant { share, time_constant_s } = Plant::PAPER;
    let errors = vec![
        error(Cause::TimeConstant, time_constant_s),
        error(Cause::InstantaneousShare, share),
        error(Cause::GainError, 1.0),
    ];
    Known { errors, tolerance: Tolerance::from_values([tolerated; 3]) }
}

/// The table: springs without a fault, and each fault with a signature at full size.
///
/// # Errors
/// The model rejects the settings.
pub(super) fn table(first_seed: u64, runs: u64) -> Result<String, OutOfRange> {
    let open = Thresholds([f64::INFINITY; 3]);
    let run = |half_width, tolerated, fault, seed| {
        run_with(&known(half_width, tolerated, seed), fault, 1.0, PERCENT, seed, &open)
    };
    let faults: Vec<Fault> = Fault::all().into_iter().filter(|fault| fault.has_signature()).collect();
    let cases = WIDTHS.into_iter().flat_map(|half_width| [false, true].map(|tolerated| (half_width, tolerated)));
    let row = |(half_width, tolerated): (f64, bool)| {
        let seeds = first_seed..first_seed + HEALTHY * runs;
        let healthy: Vec<Outcome> = seeds
            .into_par_iter()
            .map(|seed| run(half_width, tolerated, Fault::None, seed))
            .collect::<Result<_, OutOfRange>>()?;
        let of_fault = |fault: &Fault| {
            (first_seed..first_seed + runs).map(|seed| run(half_width, tolerated, *fault, seed)).collect::<Vec<_>>()
        };
        let faulty: Vec<Outcome> = faults.par_iter().flat_map(of_fault).collect::<Result<_, _>>()?;
        let part = |outcomes: &[Outcome], what: &dyn Fn(&Outcome) -> bool| {
            let count = outcomes.iter().filter(|outcome| what(outcome)).count();
            format!("{:.1} %", 100.0 * count as f64 / outcomes.len() as f64)
        };
        let ended = |decision: Decision| part(&faulty, &|outcome| outcome.last == decision);
        let one_of_two = part(&faulty, &|outcome| outcome.one_of_two);
        Ok(vec![
            format!("{:.1} %", 100.0 * half_width),
            (if tolerated { "that" } else { "none" }).to_owned(),
            format!(
                "{} of {}",
                healthy.iter().filter(|outcome| outcome.last != Decision::Quiet).count(),
                healthy.len()
            ),
            part(&healthy, &|outcome| outcome.first.is_some()),
            faulty.len().to_string(),
            ended(Decision::Right),
            format!("{} ({one_of_two})", ended(Decision::Ambiguous)),
            ended(Decision::Unknown),
            ended(Decision::Wrong),
            part(&faulty, &|outcome| matches!(outcome.last, Decision::Quiet | Decision::Alarm)),
            part(&faulty, &|outcome| outcome.first.is_some_and(|(_, right)| !right)),
        ])
    };
    let rows: Vec<Vec<String>> = cases.map(row).collect::<Result<_, OutOfRange>>()?;
    let header = [
        "half width",
        "tolerance",
        "healthy: alarm",
        "healthy: a name",
        "with a fault",
        "right",
        "ambiguous (one is right)",
        "unknown",
        "wrong",
        "none",
        "first name wrong",
    ];
    Ok(markdown::table(&header, rows))
}
