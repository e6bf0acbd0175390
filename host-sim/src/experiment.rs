//! A schedule run through the fixed-point controller, tick by tick, beside the exact reference.
//!
//! Both with the pre-compensator and without it, so that each run shows what the controller is worth.

use anyhow::Result;
use model::{DacCode, Input, Limits, ScaledStiffness, Settings, Spring, Volts};

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::reference::{Loop, Solution};
use crate::schedule::{Reader, Schedule};

/// More ticks than this are refused: a run keeps 48 bytes of each.
const MOST_TICKS: f64 = 10e6;

/// What is run.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// What the schedule is called in messages.
    pub name: String,
    /// The voltages asked for.
    pub schedule: Schedule,
    /// Spring, gains and amplifier of the controlled loop.
    pub settings: Settings,
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

impl Experiment {
    /// Runs it; `progress` hears of the ticks done, every few thousand, and of their total.
    ///
    /// # Errors
    /// [`BadInput`] for settings that the model refuses and schedules beyond the amplifier's range.
    pub fn run(&self, mut progress: impl FnMut(usize, usize)) -> Result<Run> {
        let rate_hz = self.settings.rate_hz;
        let mut with = Both::new(&self.settings)?;
        let mut without = Both::new(&Settings { gains: None, ..self.settings })?;
        let (lowest, highest) = (self.settings.amplifier.min_v, self.settings.amplifier.max_v);
        self.schedule.check_range(&self.name, lowest, highest)?;

        let start_s = self.schedule.start_s();
        let last = ((self.schedule.end_s() - start_s) * rate_hz + 1e-6).floor();
        if last >= MOST_TICKS {
            bad_input!("{} takes {last} ticks at {rate_hz} Hz; expected at most {MOST_TICKS}", self.name);
        }
        let ticks = last as usize + 1;
        let mut run = Run { start_s, rate_hz, with: Vec::with_capacity(ticks), without: Vec::with_capacity(ticks) };
        let mut reader = self.schedule.reader();
        for tick in 0..ticks {
            if tick % 8192 == 0 {
                progress(tick, ticks);
            }
            let (now, next) = (run.time_s(tick), run.time_s(tick + 1));
            let target = reader.at(now);
            run.with.push(with.sample(target)?);
            run.without.push(without.sample(target)?);
            with.advance(reader.clone(), now, next);
            without.advance(reader.clone(), now, next);
        }
        progress(ticks, ticks);
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

    /// Largest difference between fixed point and reference over every tick of both loops, in V.
    pub fn max_fixed_point_error(&self) -> f64 {
        let errors = self.with.iter().chain(&self.without).map(|s| (s.stiffness.to_f64() - s.reference).abs());
        errors.fold(0.0, f64::max)
    }
}

/// The settings as the reference takes them.
pub fn continuous(settings: &Settings) -> Loop {
    Loop {
        share: settings.plant.share,
        time_constant_s: settings.plant.time_constant_s,
        gains: settings.gains.map(|gains| (gains.proportional, gains.integral_per_s)),
        range_v: (settings.amplifier.min_v, settings.amplifier.max_v),
        slew_v_per_s: settings.amplifier.slew_v_per_s.unwrap_or(f64::INFINITY),
    }
}

/// The report's leaf spring over the whole range of the model's amplifiers.
pub fn paper_spring() -> Result<Spring> {
    use model::stiffness::{Cantilever, YoungsModulus};
    Ok(Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 1000.0)?)
}

/// One loop in fixed point and its reference.
struct Both {
    config: model::Config,
    state: model::State,
    reference: Solution,
}

impl Both {
    fn new(settings: &Settings) -> Result<Self> {
        let config = settings.check().map_err(|error| BadInput(error.to_string()))?;
        let reference = continuous(settings).at_rest(1.0 / settings.rate_hz);
        Ok(Self { config, state: model::State::default(), reference })
    }

    fn sample(&mut self, target_v: f64) -> Result<Sample> {
        let target = Volts::new(target_v).map_err(|error| BadInput(error.to_string()))?;
        let output = self.config.tick(&mut self.state, Input { target });
        self.reference.jump(target_v);
        Ok(Sample {
            code: output.code,
            applied: output.applied,
            stiffness: output.stiffness,
            limits: output.limits,
            reference: self.reference.stiffness(),
        })
    }

    /// The reference goes on from one tick to the next.
    fn advance(&mut self, reader: Reader<'_>, now: f64, next: f64) {
        for stretch in reader.stretches(now, next) {
            if stretch.duration_s == next - now {
                self.reference.step(stretch.from_v, stretch.to_v());
            } else {
                self.reference.advance(stretch.from_v, stretch.slope, stretch.duration_s);
            }
        }
    }
}

/// The stiffness of the exact solution at increasing moments of a schedule, in V.
pub fn reference_at(system: Loop, schedule: &Schedule, times_s: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut solution = system.at_rest(1.0);
    let mut now = schedule.start_s();
    let mut reader = schedule.reader();
    let at = |time: f64| {
        let next = time.clamp(now, schedule.end_s());
        for stretch in reader.clone().stretches(now, next) {
            solution.advance(stretch.from_v, stretch.slope, stretch.duration_s);
        }
        now = next;
        solution.jump(reader.at(next));
        solution.stiffness()
    };
    times_s.into_iter().map(at).collect()
}
