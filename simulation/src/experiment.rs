//! Runs a schedule through the fixed-point controller, tick by tick, and compares it with a reference in double
//! precision.
//!
//! The reference of the plain spring is the exact solution in continuous time, that of the extended spring the loop at
//! the same rate. Every run has one loop with the pre-compensator and one without, which shows the effect of the
//! controller.

use anyhow::Result;
use model::estimator::Estimator;
use model::{Compensation, Config, Input, Output, Plant, Settings, Spring, State, Volts};

use crate::bad_input;
use crate::bad_input::{BadInput, number};
pub use crate::has_reference::{HasReference, StartsFrom, continuous, reference_at, with_plant};
pub use crate::run::{Run, Sample};
use crate::schedule::Schedule;

/// Largest number of ticks: a run keeps 48 bytes of each.
pub const MOST_TICKS: f64 = 10e6;

/// A schedule and the settings of the loop that it is run through.
#[derive(Clone, Debug)]
pub struct Experiment<P = Plant> {
    /// Name of the schedule in messages.
    pub name: String,
    /// The commanded voltage over time.
    pub schedule: Schedule,
    /// Spring, pre-compensator and amplifier of the controlled loop.
    pub settings: Settings<P>,
}

impl<P: HasReference> Experiment<P> {
    /// Runs both loops; `progress` receives the number of ticks done, every few thousand, and their total.
    ///
    /// # Errors
    /// [`BadInput`] for settings that the model rejects, schedules beyond the amplifier's range, and more than 10
    /// million ticks.
    pub fn run(&self, mut progress: impl FnMut(usize, usize)) -> Result<Run> {
        let rate_hz = self.settings.rate_hz;
        let uncontrolled = Settings { compensation: Compensation::None, ..self.settings };
        let controlled = self.settings.validate().map_err(BadInput::from)?.quantize();
        let alone = uncontrolled.validate().map_err(BadInput::from)?.quantize();
        let targets = self.targets()?;
        let ticks = targets.len();
        let mut run = Run { start_s: self.schedule.start_s(), rate_hz, with: Vec::new(), without: Vec::new() };
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

    /// Targets in V, one per tick.
    ///
    /// # Errors
    /// [`BadInput`] for schedules beyond the amplifier's range, and more than 10 million ticks.
    pub fn targets(&self) -> Result<Vec<f64>> {
        let rate_hz = self.settings.rate_hz;
        self.schedule.check_range(&self.name, self.settings.amplifier.min_v, P::highest_target(&self.settings))?;
        let last = self.schedule.last_tick(rate_hz);
        if last >= MOST_TICKS {
            let (name, ticks) = (&self.name, number(last));
            bad_input!("{name} takes {ticks} ticks at {rate_hz} Hz; expected at most {MOST_TICKS}");
        }
        Ok(self.schedule.at_ticks(rate_hz))
    }
}

/// Largest difference between fixed point and reference over all ticks of a loop, in V.
///
/// A tick makes its part of a slew in one jump, the reference during the time until the next tick; at the start of a
/// slew the tick is therefore ahead.
pub fn max_fixed_point_error(samples: &[Sample]) -> f64 {
    samples.iter().map(|sample| (sample.stiffness.to_f64() - sample.reference).abs()).fold(0.0, f64::max)
}

/// The report's leaf spring over the largest range of the model's amplifiers, 0 to 1000 V.
pub fn paper_spring() -> Result<Spring> {
    use model::stiffness::{Cantilever, YoungsModulus};
    Ok(Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 1000.0)?)
}

/// Runs the fixed-point loop over one target (V) per tick; the references of the samples are left at 0.
pub fn one_loop<E: Estimator>(
    config: &Config<E>,
    targets: &[f64],
    mut progress: impl FnMut(usize),
) -> Result<Vec<Sample>> {
    let mut state = State::default();
    let mut samples = Vec::with_capacity(targets.len());
    for (tick, &target) in targets.iter().enumerate() {
        if tick % 8192 == 0 {
            progress(tick);
        }
        let target = Volts::new(target).map_err(BadInput::from)?;
        let Output { code, applied, stiffness, limits, .. } =
            config.tick(&mut state, Input { target, ..Input::default() });
        samples.push(Sample { code, applied, stiffness, limits, reference: 0.0 });
    }
    Ok(samples)
}
