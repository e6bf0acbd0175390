//! `vsj adapt`: the controller on a spring that changes while it runs.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::adapt::text;
use host_sim::output::terminal::{json, print};
use model::adaptation::Settings;
use model::{Amplifier, Compensation, controller};
use simulation::adaptation::{Happens, Question, SensorFault, run as answer, sensor};
use simulation::bad_input;
use simulation::control_loop::{Controller, Options};
use simulation::option_names::{SETTINGS, named};
use simulation::plant_file::load_plain;
use simulation::spring_error::{Parameter, SpringError};

use super::choice::{CONTROLLER, Choices, one_of};
use super::compare::sensor_noise_v;
use super::identified::errors;
use super::spring_error::{ErrorOf, Known, together};

/// Run the controller with its sensor on a spring that changes, or whose sensor fails, and show how the model adapts
///
/// The controller moves the spring up and down in steps of 100 V, 10 s each. After a round the spring changes or the sensor fails. The
/// isolation bank names what has changed, and the model takes it over: slowly, within bounds, and back if it was wrong. Each step is
/// shown as the stored model makes it, as the adapted one does, and as the adapted one does without the sensor (`alone`).
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj adapt --spring-error tau=20        a time constant that grows by 20 %
  vsj adapt --spring-error gain=-10 --controller paper
  vsj adapt --sensor-fault drift         a sensor that drifts: nothing changes
  vsj adapt --spring-error tau=20 --within tau=10   more than its bound allows
  vsj adapt --spring-error share=20 --json | jq .alone_in_time_from")]
pub(crate) struct Arguments {
    /// The stored model: `paper`, or a plant file of at most 1 MiB with a share and one time constant only
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Controller, unless --known chooses the robust one
    #[arg(long, value_parser = one_of(CONTROLLER), default_value = "fast")]
    controller: Controller,
    #[command(flatten)]
    known: Known,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 1000.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// The spring changes: `tau`, `gain` or `share` becomes larger by this, -90 to 900 %; repeatable
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    spring_error: Vec<ErrorOf>,
    /// The sensor fails
    #[arg(long, value_parser = one_of(SENSOR_FAULT), value_name = "FAULT")]
    sensor_fault: Option<SensorFault>,
    /// Standard deviation of the white noise of the sensor, which is read in each tick, in percent of 500 V, 0.01 to 10
    #[arg(long, default_value_t = 0.2, value_name = "PERCENT", allow_negative_numbers = true)]
    sensor_noise: f64,
    /// Bound of the adaptation: `tau`, `gain` or `share` stays within this of the stored model, both ways, 0 to 50 %; repeatable;
    /// default: tau and share 25 %, gain 15 %
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    within: Vec<ErrorOf>,
    /// The bounds are the 95 % intervals of this file, what `vsj identify --json` prints; at most 16 MiB
    #[arg(long, value_name = "FILE.json", conflicts_with = "within")]
    identified: Option<PathBuf>,
    /// Number of steps after the change, 1 to 100
    #[arg(long, default_value_t = 15, value_name = "N")]
    steps: usize,
    /// Seed of the noise
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// `--sensor-fault`.
const SENSOR_FAULT: Choices<SensorFault> = &[
    ("stuck", "It repeats its last reading", SensorFault::Stuck),
    ("offset", "It reads 20 V too much", SensorFault::Offset),
    ("drift", "Its gain grows by 0.1 % in a second", SensorFault::Drift),
    ("noise", "Its noise has four times the standard deviation", SensorFault::Noise),
];

/// Largest number of steps.
const MOST_STEPS: usize = 100;

impl Arguments {
    fn bounds(&self) -> Result<Settings> {
        let typical = Settings::TYPICAL;
        let mut within = errors("--within", &self.within, self.identified.as_deref())?;
        if self.identified.is_none() {
            let defaults = [
                (Parameter::TimeConstant, typical.time_constant),
                (Parameter::Share, typical.share),
                (Parameter::Gain, typical.gain),
            ];
            for (parameter, default) in defaults {
                if *within.of(parameter) == 0.0 {
                    within = within.with(parameter, default);
                }
            }
        }
        let SpringError { time_constant, share, gain, .. } = within;
        Ok(Settings { time_constant, share, gain, ..typical })
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { controller, limit_v, sensor_fault, steps, seed, .. } = *arguments;
    if !(1..=MOST_STEPS).contains(&steps) {
        bad_input!("--steps {steps}: expected 1 to {MOST_STEPS}");
    }
    let spring_error = together("--spring-error", &arguments.spring_error)?;
    let options = Options { controller, ..Options::PAPER };
    let rate_hz = options.rate_hz;
    let noise_v = sensor_noise_v(arguments.sensor_noise)?;
    let control = controller::Settings {
        rate_hz,
        plant: load_plain(&arguments.plant)?,
        compensation: arguments.known.margin()?.map_or(options.compensation(), Compensation::Robust),
        amplifier: Amplifier::up_to(limit_v),
        feedback: Some(sensor(noise_v, rate_hz)),
    };
    let adaptation = arguments.bounds()?;
    let happens = Happens { spring_error, sensor_fault };
    let question = Question { control, adaptation, happens, steps, seed };
    let names = [
        ("adaptation.", if arguments.identified.is_some() { "--identified" } else { "--within" }),
        ("noise_v", "--sensor-noise"),
        ("range_v", "--limit-v"),
        ("plant.", "--plant"),
    ];
    let answer = answer(&question).map_err(|error| named(named(error, SETTINGS), &names))?;
    print(&if arguments.json { json(&answer)? } else { text(&answer) })
}
