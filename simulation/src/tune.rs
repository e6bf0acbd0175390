//! Tunes both controllers for a spring and an amplifier, and evaluates their sensitivity to model errors.
//!
//! - Proportional-integral controller: the gains with the shortest t97 of the slowest step of the ideal stair, subject to a
//!   limit on the overshoot of every step and to the margins [`Margins::LEAST`] of the linearised loop. Found on the
//!   fixed-point tick, limits included, by a grid and a compass search.
//! - Time-optimal controller: the longest approach time constant whose steps stay within [`WITHIN`] of the dead-beat t97
//!   and within the overshoot limit, which is the smoothest that is nearly as fast as dead-beat.
//! - [`trade`]: both controllers on springs that differ from their model.
//! - [`uncertainty`]: what the controllers keep of their performance on a spring that is known only to within errors.

pub mod margins;
pub mod trade;
pub mod uncertainty;
mod worst;

use anyhow::Result;
use model::{Amplifier, Approach, Compensation, ExtendedPlant, Gains, Settings};
use serde::Serialize;

use crate::bad_input::BadInput;
use crate::experiment::{Run, one_loop};
use crate::plant_file::PlantFile;
use crate::response::{Response, measure};
use crate::schedule::Schedule;

pub use margins::Margins;
pub use trade::Trade;
pub use uncertainty::{Knowledge, Uncertainty, Within};
pub use worst::Worst;

/// Largest ratio of a step's t97 to that of the dead-beat controller.
pub const WITHIN: f64 = 1.05;

/// The spring, amplifier and limits to tune for.
#[derive(Clone, Debug)]
pub struct Specification<'a> {
    /// The spring.
    pub file: &'a PlantFile,
    /// The amplifier.
    pub amplifier: Amplifier,
    /// Ticks per second, in Hz.
    pub rate_hz: f64,
    /// Largest overshoot of any step, in percent.
    pub overshoot_percent: f64,
    /// How well the spring is known; `None` if nobody asks.
    pub knowledge: Option<Knowledge>,
}

/// The answer of `vsj tune --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Tuning {
    /// Highest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// Gains of the proportional-integral controller; `None` if no gains meet the limits.
    pub proportional_integral: Option<TunedGains>,
    /// Settings of the time-optimal controller.
    pub fast: TunedApproach,
    /// Responses under model errors.
    pub trade: Vec<Trade>,
    /// Performance within the errors to within which the spring is known, if they were given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Uncertainty>,
}

/// Gains and their performance.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TunedGains {
    /// Proportional gain, dimensionless, for `--kp`.
    pub proportional: f64,
    /// Integral gain, in 1/s, for `--ki`.
    pub integral_per_s: f64,
    /// Stability margins of the linearised loop.
    pub margins: Margins,
    /// Worst response on the stair.
    #[serde(flatten)]
    pub worst: Worst,
}

/// An approach time constant and its performance.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct TunedApproach {
    /// Time constant of the approach, in s, for `--approach-s`.
    pub approach_s: f64,
    /// Worst response on the stair.
    #[serde(flatten)]
    pub worst: Worst,
}

impl Specification<'_> {
    fn settings(&self, compensation: Compensation) -> Settings<ExtendedPlant<'_>> {
        Settings {
            rate_hz: self.rate_hz,
            plant: self.file.extended(),
            compensation,
            amplifier: self.amplifier,
            feedback: None,
        }
    }

    /// The stair of ideal steps.
    fn stair(&self) -> Schedule {
        Schedule::ideal_stair_of(self.file.stair_step_v(self.amplifier))
    }

    /// Runs the fixed-point loop over the ideal stair; the stiffness is that of its own model.
    ///
    /// # Errors
    /// [`BadInput`] for settings that the tick rejects.
    fn run(&self, compensation: Compensation) -> Result<Run> {
        let config = self.settings(compensation).validate().map_err(BadInput::from)?.quantize();
        let schedule = self.stair();
        let with = one_loop(&config, &schedule.at_ticks(self.rate_hz), |_| ())?;
        Ok(Run { start_s: schedule.start_s(), rate_hz: self.rate_hz, with, without: Vec::new() })
    }

    fn responses(&self, run: &Run) -> Vec<Response> {
        self.stair().changes().iter().map(|change| measure(run, &run.with, change, None)).collect()
    }

    /// The worst response of a run over the stair.
    fn worst_of(&self, run: &Run) -> Worst {
        Worst::of(self.stair().changes().iter().map(|change| Worst::of_step(run, &run.with, change)))
    }

    /// The worst response on the stair; `None` if the tick rejects the settings.
    fn worst(&self, compensation: Compensation) -> Option<Worst> {
        Some(self.worst_of(&self.run(compensation).ok()?))
    }

    /// The gains with the shortest t97; `None` if no gains meet the limits.
    fn gains(&self) -> Option<TunedGains> {
        let tried = |proportional, integral_per_s| {
            let gains = Gains { proportional, integral_per_s };
            let margins = Margins::of(self.file, &gains, self.rate_hz);
            let worst =
                margins.sufficient().then(|| self.worst(Compensation::ProportionalIntegral(gains))).flatten()?;
            let t97 = worst.t97_s.filter(|_| worst.overshoot_percent <= self.overshoot_percent)?;
            Some((t97, TunedGains { proportional, integral_per_s, margins, worst }))
        };
        // In decades of the gain and of the reset time.
        let at_point = |[gain, reset]: [f64; 2]| tried(10f64.powf(gain), 10f64.powf(gain - reset));
        let better = |one: &(f64, TunedGains), other: &(f64, TunedGains)| one.0.total_cmp(&other.0);
        let grid = (0..9).flat_map(|row| {
            (0..9).map(move |column| [-1.0 + 0.375 * f64::from(row), -1.0 + 0.375 * f64::from(column)])
        });
        let (mut at, mut best) =
            grid.filter_map(|point| Some((point, at_point(point)?))).min_by(|one, other| better(&one.1, &other.1))?;
        let mut step = 0.2;
        while step > 0.01 {
            let around = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]];
            let next = around.map(|[by_gain, by_reset]| [at[0] + by_gain, at[1] + by_reset]);
            let next = next.into_iter().filter_map(|point| Some((point, at_point(point)?)));
            match next.min_by(|one, other| better(&one.1, &other.1)) {
                Some((point, found)) if found.0 < best.0 => (at, best) = (point, found),
                _ => step *= 0.5,
            }
        }
        // Rounded to three digits, if they still meet the limits.
        let rounded = tried(three_digits(best.1.proportional), three_digits(best.1.integral_per_s));
        rounded.or(Some(best)).map(|(_, found)| found)
    }

    /// The longest approach that meets the limits.
    fn approach(&self) -> Result<TunedApproach> {
        let with = |time_constant_s| Compensation::TimeOptimal(Approach { time_constant_s });
        let steps = |compensation| self.run(compensation).map(|run| self.responses(&run));
        let dead_beat = steps(with(0.0))?;
        let good_enough = |approach_s: f64| -> Result<bool> {
            let mut pairs = steps(with(approach_s))?.into_iter().zip(&dead_beat);
            Ok(pairs.all(|(step, fastest)| {
                let most = fastest.t97_s.map_or(f64::INFINITY, |t97| WITHIN * t97);
                step.t97_s.unwrap_or(f64::INFINITY) <= most
                    && step.overshoot_percent <= self.overshoot_percent.max(fastest.overshoot_percent)
            }))
        };
        let mut approach_s = 0.0;
        for tried in [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
            if !good_enough(tried)? {
                break;
            }
            approach_s = tried;
        }
        Ok(TunedApproach { approach_s, worst: self.worst_of(&self.run(with(approach_s))?) })
    }
}

/// Tunes both controllers.
///
/// # Errors
/// [`BadInput`] for a spring or amplifier that the tick rejects.
pub fn tune(specification: &Specification<'_>) -> Result<Tuning> {
    let fast = specification.approach()?;
    let proportional_integral = specification.gains();
    let approach = Compensation::TimeOptimal(Approach { time_constant_s: fast.approach_s });
    let compensations = [
        proportional_integral.map(|TunedGains { proportional, integral_per_s, .. }| {
            Compensation::ProportionalIntegral(Gains { proportional, integral_per_s })
        }),
        Some(approach),
    ];
    let runs = compensations.map(|compensation| compensation.map(|it| specification.run(it)).transpose());
    let [with_gains, with_approach] = runs;
    let trade = trade::over_model_errors(specification, with_gains?.as_ref(), with_approach?.as_ref());
    let evaluated = |knowledge| uncertainty::evaluate(specification, approach, knowledge);
    let uncertainty = specification.knowledge.as_ref().map(evaluated).transpose()?;
    Ok(Tuning { limit_v: specification.amplifier.max_v, proportional_integral, fast, trade, uncertainty })
}

fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
