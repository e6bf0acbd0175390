//! A schedule run through the fixed-point controller, tick by tick, beside a reference in double precision.
//!
//! The plain spring's reference is the exact solution in continuous time, the extended spring's the loop at the same rate.
//! Both with the pre-compensator and without it, so that each run shows what the controller is worth.

use anyhow::Result;
use model::estimator::{Estimator, Model};
use model::{
    Config, DacCode, ExtendedPlant, Input, Limits, Output, Plant, ScaledStiffness, Settings, Spring, State, Volts,
};

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::reference::{Loop, Moment};
use crate::sampled::SampledLoop;
use crate::schedule::Schedule;

/// More ticks than this are refused: a run keeps 48 bytes of each.
const MOST_TICKS: f64 = 10e6;

/// What is run.
#[derive(Clone, Debug)]
pub struct Experiment<P = Plant> {
    /// What the schedule is called in messages.
    pub name: String,
    /// The voltages asked for.
    pub schedule: Schedule,
    /// Spring, gains and amplifier of the controlled loop.
    pub settings: Settings<P>,
}

/// One tick of one loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What the DAC was told.
    pub code: DacCode,
    /// The voltage of that code.
    pub applied: Volts,
    /// The fixed-point estimate just after.
    pub stiffness: ScaledStiffness,
    /// The limits that acted.
    pub limits: Limits,
    /// The reference's stiffness at the same moment, in V.
    pub reference: f64,
}

/// A finished run: one sample a tick, first and last moment included.
#[derive(Clone, Debug)]
pub struct Run {
    /// Time of the first tick, in s.
    pub start_s: f64,
    /// Ticks per second.
    pub rate_hz: f64,
    /// With the pre-compensator.
    pub with: Vec<Sample>,
    /// The target put out as it is.
    pub without: Vec<Sample>,
}

/// A spring whose fixed-point run is laid beside a reference.
pub trait Judged: Model {
    /// The highest voltage that may be asked for: what the reference treats as the tick does.
    fn highest_target(settings: &Settings<Self>) -> f64;

    /// The reference's stiffness at every tick, in V, for one target a tick.
    fn reference_at_ticks(settings: &Settings<Self>, schedule: &Schedule, targets: &[f64]) -> Vec<f64>;

    /// The same at increasing moments; `samples` are those of the loop.
    fn reference_at(
        settings: &Settings<Self>,
        schedule: &Schedule,
        run: &Run,
        samples: &[Sample],
        times_s: &[f64],
    ) -> Vec<f64>;

    /// The loop in continuous time, where it can be solved exactly.
    fn exact(settings: &Settings<Self>) -> Option<Loop>;
}

impl Judged for Plant {
    fn highest_target(settings: &Settings) -> f64 {
        settings.amplifier.max_v
    }

    fn reference_at_ticks(settings: &Settings, schedule: &Schedule, targets: &[f64]) -> Vec<f64> {
        exact_at_ticks(continuous(settings), schedule, settings.rate_hz, targets)
    }

    fn reference_at(settings: &Settings, schedule: &Schedule, _: &Run, _: &[Sample], times_s: &[f64]) -> Vec<f64> {
        exact_at(continuous(settings), schedule, times_s)
    }

    fn exact(settings: &Settings) -> Option<Loop> {
        Some(continuous(settings))
    }
}

/// In steps of the tick: between ticks the last one counts.
impl Judged for ExtendedPlant<'_> {
    /// Where the amplifier ends below its full scale, both take a higher target at that end.
    fn highest_target(settings: &Settings<Self>) -> f64 {
        settings.amplifier.full_scale_v
    }

    fn reference_at_ticks(settings: &Settings<Self>, _: &Schedule, targets: &[f64]) -> Vec<f64> {
        let sampled = SampledLoop::from(settings);
        let mut state = sampled.at_rest();
        let at = |&target: &f64| {
            let voltage = sampled.drive(&mut state, target);
            sampled.apply(&mut state, voltage)
        };
        targets.iter().map(at).collect()
    }

    fn reference_at(_: &Settings<Self>, _: &Schedule, run: &Run, samples: &[Sample], times_s: &[f64]) -> Vec<f64> {
        times_s.iter().map(|&time| samples[run.tick_at(time)].reference).collect()
    }

    fn exact(settings: &Settings<Self>) -> Option<Loop> {
        settings.plant.plain().map(|plant| continuous(&with_plant(settings, plant)))
    }
}

/// The settings with another spring.
pub fn with_plant<P, Q>(settings: &Settings<P>, plant: Q) -> Settings<Q> {
    Settings { rate_hz: settings.rate_hz, plant, gains: settings.gains, amplifier: settings.amplifier }
}

impl<P: Judged> Experiment<P> {
    /// Runs it; `progress` hears of the ticks done, every few thousand, and of their total.
    ///
    /// # Errors
    /// [`BadInput`] for settings that the model refuses and schedules beyond the amplifier's range.
    pub fn run(&self, mut progress: impl FnMut(usize, usize)) -> Result<Run> {
        let rate_hz = self.settings.rate_hz;
        let uncontrolled = Settings { gains: None, ..self.settings };
        let controlled = self.settings.check().map_err(|error| BadInput(error.to_string()))?;
        let alone = uncontrolled.check().map_err(|error| BadInput(error.to_string()))?;
        self.schedule.check_range(&self.name, self.settings.amplifier.min_v, P::highest_target(&self.settings))?;

        let start_s = self.schedule.start_s();
        let last = ((self.schedule.end_s() - start_s) * rate_hz + 1e-6).floor();
        if last >= MOST_TICKS {
            bad_input!("{} takes {last} ticks at {rate_hz} Hz; expected at most {MOST_TICKS}", self.name);
        }
        let ticks = last as usize + 1;
        let mut reader = self.schedule.reader();
        let targets: Vec<f64> = (0..ticks).map(|tick| reader.at(start_s + tick as f64 / rate_hz)).collect();
        let mut run = Run { start_s, rate_hz, with: Vec::new(), without: Vec::new() };
        run.with = one_loop(&controlled, &targets, |done| progress(done, 2 * ticks))?;
        run.without = one_loop(&alone, &targets, |done| progress(ticks + done, 2 * ticks))?;
        for (settings, samples) in [(&self.settings, &mut run.with), (&uncontrolled, &mut run.without)] {
            let references = P::reference_at_ticks(settings, &self.schedule, &targets);
            for (sample, reference) in samples.iter_mut().zip(references) {
                sample.reference = reference;
            }
        }
        Ok(run)
    }
}

impl Run {
    /// Time of a tick, in s.
    pub fn time_s(&self, tick: usize) -> f64 {
        self.start_s + tick as f64 / self.rate_hz
    }

    /// The last tick at or before `time_s`.
    pub fn tick_at(&self, time_s: f64) -> usize {
        let tick = ((time_s - self.start_s) * self.rate_hz + 1e-6).floor().max(0.0) as usize;
        tick.min(self.with.len() - 1)
    }
}

/// Largest difference between fixed point and reference over every tick of a loop, in V.
///
/// A tick makes its share of a slew at once, the reference in the time up to the next tick: the tick that starts a slew
/// is ahead by as much.
pub fn max_fixed_point_error(samples: &[Sample]) -> f64 {
    samples.iter().map(|sample| (sample.stiffness.to_f64() - sample.reference).abs()).fold(0.0, f64::max)
}

/// The settings as the reference takes them.
pub fn continuous(settings: &Settings) -> Loop {
    Loop {
        share: settings.plant.share,
        time_constant_s: settings.plant.time_constant_s,
        gains: settings.gains.map(|gains| (gains.proportional, gains.integral_per_s)),
        range_v: (settings.amplifier.min_v, settings.amplifier.max_v),
        slew_v_per_s: slew(settings),
    }
}

/// The amplifier's slew, in V/s; what it makes within a tick is no limit to it.
fn slew<P>(settings: &Settings<P>) -> f64 {
    let amplifier = &settings.amplifier;
    let acts = |slew: &f64| slew / settings.rate_hz < amplifier.full_scale_v;
    amplifier.slew_v_per_s.filter(acts).unwrap_or(f64::INFINITY)
}

impl From<&Settings<ExtendedPlant<'_>>> for SampledLoop {
    fn from(settings: &Settings<ExtendedPlant<'_>>) -> Self {
        Self {
            sample_s: 1.0 / settings.rate_hz,
            spring: settings.plant.into(),
            gains: settings.gains.map(|gains| (gains.proportional, gains.integral_per_s)),
            range_v: (settings.amplifier.min_v, settings.amplifier.max_v),
            slew_v_per_s: slew(settings),
        }
    }
}

/// The report's leaf spring over the whole range of the model's amplifiers.
pub fn paper_spring() -> Result<Spring> {
    use model::stiffness::{Cantilever, YoungsModulus};
    Ok(Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 1000.0)?)
}

/// The fixed-point loop over one target a tick; its reference is not known yet.
fn one_loop<E: Estimator>(config: &Config<E>, targets: &[f64], mut progress: impl FnMut(usize)) -> Result<Vec<Sample>> {
    let mut state = State::default();
    let mut samples = Vec::with_capacity(targets.len());
    for (tick, &target) in targets.iter().enumerate() {
        if tick % 8192 == 0 {
            progress(tick);
        }
        let target = Volts::new(target).map_err(|error| BadInput(error.to_string()))?;
        let Output { code, applied, stiffness, limits, .. } = config.tick(&mut state, Input { target });
        samples.push(Sample { code, applied, stiffness, limits, reference: 0.0 });
    }
    Ok(samples)
}

/// The stiffness of the exact solution at every tick, in V.
fn exact_at_ticks(system: Loop, schedule: &Schedule, rate_hz: f64, targets: &[f64]) -> Vec<f64> {
    let mut stiffness = vec![0.0; targets.len()];
    let mut solution = system.at_rest(1.0 / rate_hz);
    let time = |tick: usize| schedule.start_s() + tick as f64 / rate_hz;
    // Where the target goes straight from tick to tick, and does not jump at the next, whole runs of ticks are one call.
    let mut reader = schedule.reader();
    let mut straight = |tick: usize| {
        reader.at(time(tick));
        let mut stretches = reader.clone().stretches(time(tick), time(tick + 1));
        let first = stretches.next();
        stretches.next().is_none() && first.is_some_and(|first| (first.to_v() - targets[tick + 1]).abs() < 1e-9)
    };
    let mut moments = vec![Moment::default(); targets.len()];
    // Goes along, like the other: found from the start each time, a long file would take the square of its rows.
    let mut behind = schedule.reader();
    let mut tick = 0;
    while tick < targets.len() {
        solution.jump(targets[tick]);
        stiffness[tick] = solution.moment().stiffness;
        let end = (tick..targets.len() - 1).find(|&tick| !straight(tick)).unwrap_or(targets.len() - 1);
        solution.run(&targets[tick..=end], &mut moments[tick..end]);
        for at in tick..end {
            stiffness[at + 1] = moments[at].stiffness;
        }
        behind.at(time(end));
        for stretch in behind.clone().stretches(time(end), time(end + 1)) {
            solution.advance(stretch.from_v, stretch.slope, stretch.duration_s);
        }
        tick = end + 1;
    }
    stiffness
}

/// The stiffness of the exact solution at increasing moments of a schedule, in V.
fn exact_at(system: Loop, schedule: &Schedule, times_s: &[f64]) -> Vec<f64> {
    let mut solution = system.at_rest(1e-3);
    let mut now = schedule.start_s();
    let mut reader = schedule.reader();
    let at = |&time: &f64| {
        let next = time.clamp(now, schedule.end_s());
        for stretch in reader.clone().stretches(now, next) {
            solution.advance(stretch.from_v, stretch.slope, stretch.duration_s);
        }
        now = next;
        solution.jump(reader.at(next));
        solution.moment().stiffness
    };
    times_s.iter().map(at).collect()
}
