//! One run: the controller with its sensor moves a spring between random levels, and a fault begins.

use model::isolation::{Settings, Tolerance, Verdict, bank};
use model::{OutOfRange, Volts};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::fault::Fault;
use super::least_squares::{LeastSquares, Thresholds};
use super::watched::{RATE_HZ, Tick, Watched};
use crate::ground_truth::{Effect, Live};

/// Length of a run, in s.
pub(super) const RUN_S: f64 = 180.0;
/// Ratio of the sizes of two faults whose readings give the sensitivity to the size.
const CHANGED: f64 = 1.01;
/// Time for which the rival may settle, in s; no fault begins before.
pub(super) const SETTLED_S: f64 = 30.0;

/// Decision of the bank, compared with the fault that is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// No alarm.
    Quiet,
    /// An alarm without a decision.
    Alarm,
    /// The right name.
    Right,
    /// Two names.
    Ambiguous,
    /// None of the causes.
    Unknown,
    /// A wrong name.
    Wrong,
}

/// Outcome of a run; times in s after the fault began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Time of the alarm.
    pub alarm_s: Option<f64>,
    /// Time at which the log-likelihood ratio of the true change is expected to reach the alarm threshold.
    pub limit_s: Option<f64>,
    /// Time of the first name, and whether it was right.
    pub first: Option<(f64, bool)>,
    /// Time from which readings without noise exclude every other cause by the naming rule.
    pub isolable_s: Option<f64>,
    /// The size that is reported at the end, if the name is right.
    pub size: Option<Size>,
    /// Decision at the end of the run.
    pub last: Decision,
    /// True if the decision at the end is ambiguous, and the right name is one of the two.
    pub one_of_two: bool,
    /// Time at which the rival leaves its band.
    pub rival_s: Option<f64>,
    /// True if the rival then names the right parameter.
    pub rival_right: bool,
    /// Largest deviations of the rival's parameters.
    pub deviations: [f64; 3],
}

/// A reported size, in the unit of its cause.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// The true size.
    pub truth: f64,
    /// Reported size less the true one.
    pub error: f64,
    /// Half width of the reported 95 % interval.
    pub half_width: f64,
    /// Half width of the 95 % interval of an unbiased estimate from all readings since the fault began that knows all but the size
    /// (Cramer and Rao).
    pub least_half_width: f64,
}

fn decision(verdict: Verdict, fault: Fault) -> Decision {
    match verdict {
        Verdict::Quiet => Decision::Quiet,
        Verdict::Alarm => Decision::Alarm,
        Verdict::Unknown => Decision::Unknown,
        Verdict::Ambiguous(..) => Decision::Ambiguous,
        Verdict::Named(cause) if cause.name() == fault.name() => Decision::Right,
        Verdict::Named(_) => Decision::Wrong,
    }
}

/// Steps between random levels from 0 to 500 V, in s and V.
fn targets(random: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
    let hold = random.random_range(4.0..12.0);
    let mut until = 0.0;
    let mut list = Vec::new();
    while until < RUN_S {
        until += hold * random.random_range(0.6..1.4);
        list.push((until, 100.0 * f64::from(random.random_range(0..=5u32))));
    }
    list
}

/// How the spring differs from the model from the beginning on, and which errors of the model are no fault. By default the model is
/// exact, and known to be so.
#[derive(Clone, Debug, Default)]
pub(super) struct Known {
    /// Errors of the model, as effects of the spring.
    pub(super) errors: Vec<Effect>,
    /// Errors of the model that are no fault.
    pub(super) tolerance: Tolerance,
}

/// Runs a fault of a size, a fraction of full size, in white noise of a percentage of 500 V. It begins after 30 to 60 s.
///
/// # Errors
/// The model rejects the settings.
pub fn run(fault: Fault, size: f64, percent: f64, seed: u64, thresholds: &Thresholds) -> Result<Outcome, OutOfRange> {
    run_with(&Known::default(), fault, size, percent, seed, thresholds)
}

/// Does what [`run`] does, on a spring that is `known`.
pub(super) fn run_with(
    known: &Known,
    fault: Fault,
    size: f64,
    percent: f64,
    seed: u64,
    thresholds: &Thresholds,
) -> Result<Outcome, OutOfRange> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let effect = fault.effect(&mut random, size);
    let onset_s = random.random_range(SETTLED_S..2.0 * SETTLED_S);
    let targets = targets(&mut random);
    let ticks = (RUN_S * RATE_HZ) as u32;
    let alarm_nats = Settings::PAPER.alarm_nats;
    let mut watched = Watched::new(percent, alarm_nats, known.tolerance, seed, ticks)?;
    if !known.errors.is_empty() {
        watched.change(&known.errors);
    }
    let mut rival = LeastSquares::new(bank::block_ticks(RATE_HZ), RATE_HZ);
    let mut outcome = Outcome {
        alarm_s: None,
        limit_s: None,
        first: None,
        isolable_s: None,
        size: None,
        last: Decision::Quiet,
        one_of_two: false,
        rival_s: None,
        rival_right: false,
        deviations: [0.0; 3],
    };
    // For the limits: the bank without noise, and a spring under the same voltage with a slightly different size of the fault.
    let mut exact = watched.reference();
    let changed = effect.as_ref().map(|effect| effect.at(CHANGED * effect.size));
    let mut other: Option<Live> = None;
    let mut information = 0.0;
    let (mut begun, mut at, mut nats) = (false, 0, 0.0);
    for tick in 0..ticks {
        let now_s = f64::from(tick) / RATE_HZ;
        if now_s >= onset_s && !begun {
            begun = true;
            let effects: Vec<Effect> = known.errors.iter().cloned().chain(effect.clone()).collect();
            watched.change(&effects);
            watched.stuck = fault == Fault::Stuck;
            exact.start();
            let effects: Vec<Effect> = known.errors.iter().cloned().chain(changed.clone()).collect();
            other = Some(watched.with(&effects));
        }
        while targets[at].0 < now_s {
            at += 1;
        }
        let Tick { applied, model, read, expected } = watched.tick(Volts::new(targets[at].1)?)?;
        let ends_block = rival.tick(applied, read);
        if ends_block && now_s > SETTLED_S {
            let off = rival.deviations();
            outcome.deviations = std::array::from_fn(|i| outcome.deviations[i].max(off[i].abs()));
        }
        let since_s = now_s - onset_s;
        // Repeated where the reading is.
        exact.tick(applied, model, Some(expected + 1e-9 * (read - expected)));
        if let Some(other) = &mut other {
            let (_, changed) = other.hold(applied, 1.0 / RATE_HZ);
            information += ((changed.expected - expected) / watched.noise_v).powi(2);
        }
        if begun {
            if outcome.isolable_s.is_none()
                && ends_block
                && fault.cause().is_some_and(|cause| exact.excludes_others(cause))
            {
                outcome.isolable_s = Some(since_s);
            }
            nats += 0.5 * ((expected - model) / watched.noise_v).powi(2);
            if outcome.limit_s.is_none() && nats >= alarm_nats {
                outcome.limit_s = Some(since_s);
            }
            if outcome.rival_s.is_none()
                && ends_block
                && let Some(name) = rival.fault(thresholds)
            {
                (outcome.rival_s, outcome.rival_right) = (Some(since_s), name == fault.name());
            }
        }
        let verdict = watched.verdict();
        if verdict != Verdict::Quiet && outcome.alarm_s.is_none() {
            outcome.alarm_s = Some(since_s);
        }
        if outcome.first.is_none() && matches!(verdict, Verdict::Named(_)) {
            outcome.first = Some((since_s, decision(verdict, fault) == Decision::Right));
        }
    }
    let verdict = watched.verdict();
    outcome.last = decision(verdict, fault);
    if let (Decision::Right, Some(found)) = (outcome.last, watched.finding()) {
        let range_v = Settings::PAPER.range_v;
        let size = |effect: &Option<Effect>| effect.as_ref().and_then(|effect| fault.size(effect, range_v));
        outcome.size = size(&effect).zip(size(&changed)).map(|(truth, changed)| Size {
            truth,
            error: found.size - truth,
            half_width: found.half_width,
            least_half_width: 1.96 * (changed - truth).abs() / information.sqrt(),
        });
    }
    outcome.one_of_two = matches!(verdict, Verdict::Ambiguous(a, b) if [a.name(), b.name()].contains(&fault.name()));
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_truth::Cause;

    /// No name comes before the readings can show it, and no interval is narrower than that of Cramer and Rao.
    #[test]
    fn a_name_and_a_size_are_no_better_than_their_limits() {
        let open = Thresholds([f64::INFINITY; 3]);
        for (cause, percent) in [(Cause::GainError, 0.2), (Cause::TimeConstant, 1.0), (Cause::Delay, 0.2)] {
            let fault = Fault::Effect(cause);
            let Outcome { first, isolable_s, size, last, .. } = run(fault, 0.5, percent, 1, &open).unwrap();
            let (first_s, isolable_s, size) = (first.unwrap().0, isolable_s.unwrap(), size.unwrap());
            println!("{cause}: name after {first_s} s, limit {isolable_s} s, {size:?}");
            assert_eq!(last, Decision::Right, "{cause}");
            assert!(isolable_s > 0.0 && isolable_s <= first_s, "{cause}: name after {first_s} s, limit {isolable_s} s");
            let Size { truth, error, half_width, least_half_width } = size;
            assert!(error.abs() < 0.2 * truth.abs(), "{cause}: {size:?}");
            assert!(least_half_width > 0.0 && least_half_width < 1.01 * half_width, "{cause}: {size:?}");
        }
    }
}
