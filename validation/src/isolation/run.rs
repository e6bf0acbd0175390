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
/// Number of ticks of a run.
const TICKS: u32 = (RUN_S * RATE_HZ) as u32;
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
    /// Half width of the 95 % interval of an unbiased estimate from all readings since the fault began that knows all but the size
    /// (Cramer and Rao), in the unit of the cause; `None` for one that has no other size than 1.
    pub least_half_width: Option<f64>,
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
    let mut scene = Scene::new(known, fault, size, percent, seed)?;
    let alarm_nats = Settings::PAPER.alarm_nats;
    let mut rival = LeastSquares::new(bank::block_ticks(RATE_HZ), RATE_HZ);
    let mut outcome = Outcome {
        alarm_s: None,
        limit_s: None,
        first: None,
        isolable_s: None,
        size: None,
        least_half_width: None,
        last: Decision::Quiet,
        one_of_two: false,
        rival_s: None,
        rival_right: false,
        deviations: [0.0; 3],
    };
    // For the limits: the bank without noise, and a spring under the same voltage with a slightly different size of the fault.
    let mut exact = scene.watched.reference();
    let changed = scene.effect.as_ref().map(|effect| effect.at(CHANGED * effect.size));
    let mut other: Option<Live> = None;
    let (mut information, mut nats) = (0.0, 0.0);
    for tick in 0..TICKS {
        if scene.begins(tick) {
            exact.start();
            other = Some(scene.watched.with(&with(known, &changed)));
        }
        let Tick { applied, model, read, expected } = scene.tick(tick)?;
        let (now_s, since_s) = (f64::from(tick) / RATE_HZ, scene.since_s(tick));
        let ends_block = rival.tick(applied, read);
        if ends_block && now_s > SETTLED_S {
            let off = rival.deviations();
            outcome.deviations = std::array::from_fn(|i| outcome.deviations[i].max(off[i].abs()));
        }
        // Repeated where the reading is.
        exact.tick(applied, model, Some(expected + 1e-9 * (read - expected)));
        if let Some(other) = &mut other {
            let (_, changed) = other.hold(applied, 1.0 / RATE_HZ);
            information += ((changed.expected - expected) / scene.watched.noise_v).powi(2);
            if outcome.isolable_s.is_none()
                && ends_block
                && fault.cause().is_some_and(|cause| exact.excludes_others(cause))
            {
                outcome.isolable_s = Some(since_s);
            }
            nats += 0.5 * ((expected - model) / scene.watched.noise_v).powi(2);
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
        let verdict = scene.watched.verdict();
        if verdict != Verdict::Quiet && outcome.alarm_s.is_none() {
            outcome.alarm_s = Some(since_s);
        }
        if outcome.first.is_none() && matches!(verdict, Verdict::Named(_)) {
            outcome.first = Some((since_s, decision(verdict, fault) == Decision::Right));
        }
    }
    let verdict = scene.watched.verdict();
    outcome.last = decision(verdict, fault);
    outcome.size = scene.size();
    let truth = |effect: &Option<Effect>| fault.size(effect.as_ref()?, Settings::PAPER.range_v);
    outcome.least_half_width = truth(&scene.effect)
        .zip(truth(&changed))
        .map(|(truth, changed)| 1.96 * (changed - truth).abs() / information.sqrt());
    outcome.one_of_two = matches!(verdict, Verdict::Ambiguous(a, b) if [a.name(), b.name()].contains(&fault.name()));
    Ok(outcome)
}

/// Does what [`run`] does without its limits and its rival, which take most of the time. Returns the size that is reported at the end if
/// the name is right.
///
/// # Errors
/// The model rejects the settings.
pub fn reported(fault: Fault, size: f64, percent: f64, seed: u64) -> Result<Option<Size>, OutOfRange> {
    let mut scene = Scene::new(&Known::default(), fault, size, percent, seed)?;
    for tick in 0..TICKS {
        scene.tick(tick)?;
    }
    Ok(scene.size())
}

/// The effects of a spring that is `known`, and the fault.
fn with(known: &Known, fault: &Option<Effect>) -> Vec<Effect> {
    known.errors.iter().chain(fault).cloned().collect()
}

/// The controller, its targets, the spring in which the fault begins, and the bank.
struct Scene {
    fault: Fault,
    /// The fault's effect on the spring or its sensor, if it has one.
    effect: Option<Effect>,
    /// The effects of the spring from the beginning of the fault on.
    faulty: Vec<Effect>,
    watched: Watched,
    onset_s: f64,
    targets: Vec<(f64, f64)>,
    /// Number of targets that are over.
    past: usize,
}

impl Scene {
    /// A scene before its first tick.
    fn new(known: &Known, fault: Fault, size: f64, percent: f64, seed: u64) -> Result<Self, OutOfRange> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let effect = fault.effect(&mut random, size);
        let onset_s = random.random_range(SETTLED_S..2.0 * SETTLED_S);
        let targets = targets(&mut random);
        let mut watched = Watched::new(percent, Settings::PAPER.alarm_nats, known.tolerance, seed, TICKS)?;
        if !known.errors.is_empty() {
            watched.change(&known.errors);
        }
        let faulty = with(known, &effect);
        Ok(Self { fault, effect, faulty, watched, onset_s, targets, past: 0 })
    }

    /// Time since the fault began, in s, at the beginning of a tick.
    fn since_s(&self, tick: u32) -> f64 {
        f64::from(tick) / RATE_HZ - self.onset_s
    }

    /// True if the fault begins with this tick.
    fn begins(&self, tick: u32) -> bool {
        tick == (self.onset_s * RATE_HZ).ceil() as u32
    }

    /// Runs a tick.
    fn tick(&mut self, tick: u32) -> Result<Tick, OutOfRange> {
        if self.begins(tick) {
            self.watched.change(&self.faulty);
            self.watched.stuck = self.fault == Fault::Stuck;
        }
        while self.targets[self.past].0 < f64::from(tick) / RATE_HZ {
            self.past += 1;
        }
        self.watched.tick(Volts::new(self.targets[self.past].1)?)
    }

    /// The size that the bank reports, if it has named the fault.
    fn size(&self) -> Option<Size> {
        let found =
            self.watched.finding().filter(|_| decision(self.watched.verdict(), self.fault) == Decision::Right)?;
        let truth = self.fault.size(self.effect.as_ref()?, Settings::PAPER.range_v)?;
        Some(Size { truth, error: found.size - truth, half_width: found.half_width })
    }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;
    use crate::ground_truth::Cause;
    use crate::statistics::median;

    /// No name comes before the readings can show it, and no interval is narrower than that of Cramer and Rao.
    #[test]
    fn a_name_and_a_size_are_no_better_than_their_limits() {
        let open = Thresholds([f64::INFINITY; 3]);
        for (cause, percent) in [(Cause::GainError, 0.2), (Cause::TimeConstant, 1.0), (Cause::Delay, 0.2)] {
            let fault = Fault::Effect(cause);
            let Outcome { first, isolable_s, size, least_half_width, last, .. } =
                run(fault, 0.5, percent, 1, &open).unwrap();
            let (first_s, isolable_s, size) = (first.unwrap().0, isolable_s.unwrap(), size.unwrap());
            println!("{cause}: name after {first_s} s, limit {isolable_s} s, {size:?}");
            assert_eq!(last, Decision::Right, "{cause}");
            assert!(isolable_s > 0.0 && isolable_s <= first_s, "{cause}: name after {first_s} s, limit {isolable_s} s");
            let (Size { truth, error, half_width }, least_half_width) = (size, least_half_width.unwrap());
            assert!(error.abs() < 0.2 * truth.abs(), "{cause}: {size:?}");
            assert!(least_half_width > 0.0 && least_half_width < 1.01 * half_width, "{cause}: {size:?}");
        }
    }

    /// Of the sizes that are reported with the right name, at least 93 % are within their 95 % intervals, those of each cause but one at
    /// most; half of the intervals of faults of a quarter of full size are narrower than a tenth of it.
    #[test]
    fn intervals_contain_the_true_size() {
        let faults = Fault::all().into_iter().filter(|fault| fault.has_signature());
        let (mut inside, mut all, mut widths) = (0, 0, Vec::new());
        // Noise of its own in each run.
        for (fault, first) in faults.zip((400_000..).step_by(4)) {
            let size = |seed: u64| if seed < first + 2 { 1.0 } else { 0.25 };
            let sizes: Vec<(f64, Size)> = (first..first + 4)
                .into_par_iter()
                .filter_map(|seed| Some((size(seed), reported(fault, size(seed), 0.2, seed).unwrap()?)))
                .collect();
            let right = sizes.iter().filter(|(_, size)| size.error.abs() <= size.half_width).count();
            assert!(right + 1 >= sizes.len(), "{fault:?}: {sizes:?}");
            (inside, all) = (inside + right, all + sizes.len());
            let relative = |(_, size): &(f64, Size)| size.half_width / size.truth.abs();
            widths.extend(sizes.iter().filter(|(size, _)| *size < 1.0).map(relative));
        }
        println!("{inside} of {all}");
        assert!(all > 35 && 100 * inside >= 93 * all, "{inside} of {all}");
        let middle = median(&widths).unwrap();
        assert!(middle < 0.1, "{middle}");
    }
}
