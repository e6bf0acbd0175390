//! What `vsj stair` is asked for: a spring, an amplifier, a controller and targets in, a finished run and its report out.

use anyhow::Result;
use model::{Amplifier, Compensation, ExtendedPlant, Gains, Plant, Settings};
use simulation::bad_input::BadInput;
use simulation::experiment::{Experiment, HasReference, Run, with_plant};
use simulation::plant_file::PlantFile;
use simulation::record::Record;
use simulation::schedule::{Between, Schedule};

use super::{Report, Rows};

/// The target over time.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// The report's stair, with its 0.1 s ramps, in steps of [`PlantFile::stair_step_v`].
    Stair,
    /// The report's stair as ideal steps, without the ramps.
    Step,
    /// The voltages of a record.
    Record(&'a Record, Between),
}

/// An experiment in closed loop.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The spring.
    pub plant: &'a PlantFile,
    /// True if the spring is the report's own, whose printed and measured values belong to the stair.
    pub paper: bool,
    /// The target.
    pub target: Target<'a>,
    /// The pre-compensator of the loop with a controller.
    pub compensation: Compensation,
    /// True if steps and limits are those of the loop with a controller, false for the loop without.
    pub controlled: bool,
    /// The amplifier; that of the plant file acts where it is stricter.
    pub amplifier: Amplifier,
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
}

/// A finished experiment.
#[derive(Debug)]
pub struct Answer {
    /// Target and settings, without the spring.
    pub experiment: Experiment<()>,
    /// Every tick.
    pub run: Run,
    /// The answer of `vsj stair --json`.
    pub report: Report,
}

impl Request<'_> {
    /// The settings of the tick, behind the stricter of the plant file's amplifier and the one asked for.
    fn settings(&self) -> Settings<ExtendedPlant<'_>> {
        Settings {
            rate_hz: self.rate_hz,
            plant: self.plant.extended(),
            compensation: self.compensation,
            amplifier: self.plant.behind(self.amplifier),
            feedback: None,
        }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// [`BadInput`] for settings that the tick rejects; its message begins with the name of the field.
    pub fn check(&self) -> Result<()> {
        match self.settings().validate() {
            Ok(_) => Ok(()),
            Err(error) => Err(BadInput(error.to_string()).into()),
        }
    }

    /// Runs the experiment; `progress` receives the number of ticks done, every few thousand, and their total.
    ///
    /// # Errors
    /// The errors of [`Request::check`], and [`BadInput`] for targets beyond the amplifier's range.
    pub fn run(&self, progress: impl FnMut(usize, usize)) -> Result<Answer> {
        let settings = self.settings();
        // Where the range ends below the limit asked for, only the sampled reference accepts targets at its end.
        match settings.plant.plain().filter(|_| settings.amplifier.max_v == self.amplifier.max_v) {
            Some(plant) => self.run_plant(with_plant(&settings, plant), is_the_reports, progress),
            None => self.run_plant(settings, |_| false, progress),
        }
    }

    /// Runs the experiment for one kind of spring; `is_the_reports` tells whether Table 3's simulated columns should be
    /// reproduced.
    fn run_plant<P: HasReference>(
        &self,
        settings: Settings<P>,
        is_the_reports: impl Fn(&Settings<P>) -> bool,
        progress: impl FnMut(usize, usize),
    ) -> Result<Answer> {
        let step_v = self.plant.stair_step_v(self.amplifier);
        let (name, schedule) = match self.target {
            Target::Stair => ("the stair".to_owned(), Schedule::stair_of(step_v)),
            Target::Step => ("the stair of ideal steps".to_owned(), Schedule::ideal_stair_of(step_v)),
            Target::Record(record, between) => {
                record.check_range(self.amplifier.min_v, self.amplifier.max_v)?;
                (record.name.clone(), Schedule::from_record(record, between))
            }
        };
        let experiment = Experiment { name, schedule, settings };
        let run = experiment.run(progress)?;
        let rows = match self.target {
            Target::Record(record, _) => Rows::Record(record),
            target => Rows::Table3 {
                same: matches!(target, Target::Stair) && is_the_reports(&experiment.settings),
                spring: self.paper,
                step_v,
            },
        };
        let report = Report::new(&experiment, &run, &rows, self.controlled)?;
        let Experiment { name, schedule, settings } = experiment;
        Ok(Answer { experiment: Experiment { name, schedule, settings: with_plant(&settings, ()) }, run, report })
    }
}

/// True if the settings are those of the report, so that Table 3's simulated columns should be reproduced.
fn is_the_reports(settings: &Settings) -> bool {
    settings.plant == Plant::PAPER
        && settings.compensation == Compensation::ProportionalIntegral(Gains::PAPER)
        && settings.amplifier.slew_v_per_s.is_none()
        && settings.amplifier.min_v == 0.0
        && settings.amplifier.max_v >= 700.0
}
