//! `vsj compare`: every controller on the same steps.

use anyhow::Result;
use clap::Args;
use host_sim::output::compare::text;
use host_sim::output::terminal::{json, print, remark};
use model::Amplifier;
use simulation::bad_input;
use simulation::comparison::{Actual, compare};
use simulation::option_names::{SETTINGS, named};

use super::plant;
use super::spring_error::{ErrorOf, Known, together};

/// Compare all controllers on the stair of ideal steps with each other and with the lower bound for any controller
///
/// The steps are of 100 V, up to 500 V; smaller where the range of a plant file's record, amplifier, law or command is too small
/// for them.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj compare                             none, paper, fast at 700 V and 1000 V
  vsj compare --limit-v 850 --slew-v-per-s 500
  vsj compare --plant spring.toml --json  on another spring
  vsj compare --spring-error tau=10       time constant 10 % above the model's
  vsj compare --spring-error gain=-5 --sensor-noise 0.2  with a stiffness sensor
  vsj compare --spring-error tau=3 --known tau=5  and a controller for it")]
pub(crate) struct Arguments {
    /// The spring: `paper`, or a plant file of at most 1 MiB; its recorded amplifier applies where it is stricter
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Highest voltages of the amplifier, in V; at most 16
    #[arg(long, default_values_t = [700.0, 1000.0], value_delimiter = ',', value_name = "V,V", allow_negative_numbers = true)]
    limit_v: Vec<f64>,
    /// Slew limit of the amplifier, in V/s; default: none
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// Ticks per second, 100 to 10 000
    #[arg(long, default_value_t = 1000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
    /// The spring differs from the controllers' model: `tau`, `gain` or `share` is larger by this, -90 to 900 %; repeatable
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    spring_error: Vec<ErrorOf>,
    /// A stiffness sensor is read in each tick, with white noise of this standard deviation in percent of 500 V, 0.001 to 10
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true)]
    sensor_noise: Option<f64>,
    #[command(flatten)]
    known: Known,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Largest number of amplifiers; each takes a second.
const MOST_AMPLIFIERS: usize = 16;

/// Voltage of which the noise of a sensor is a percentage: the highest target of the stair.
const FULL_SCALE_V: f64 = 500.0;
/// Smallest and largest noise of a sensor, in percent.
const NOISE_PERCENT: (f64, f64) = (0.001, 10.0);

/// The noise of a sensor in V; in percent on the command line.
pub(super) fn sensor_noise_v(percent: f64) -> Result<f64> {
    if !(NOISE_PERCENT.0..=NOISE_PERCENT.1).contains(&percent) {
        bad_input!("--sensor-noise {percent}: expected {} to {}", NOISE_PERCENT.0, NOISE_PERCENT.1);
    }
    Ok(percent / 100.0 * FULL_SCALE_V)
}

impl Arguments {
    /// The spring and its sensor, where they differ from the model.
    fn actual(&self) -> Result<Option<Actual>> {
        let spring_error = together("--spring-error", &self.spring_error)?;
        let sensor_noise_v = self.sensor_noise.map(sensor_noise_v).transpose()?;
        let differs = !self.spring_error.is_empty() || sensor_noise_v.is_some();
        Ok(differs.then_some(Actual { spring_error, sensor_noise_v }))
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if arguments.limit_v.len() > MOST_AMPLIFIERS {
        bad_input!("--limit-v: {} amplifiers; expected at most {MOST_AMPLIFIERS}", arguments.limit_v.len());
    }
    let file = plant::load(&arguments.plant)?;
    let behind = |&limit_v: &f64| Amplifier { slew_v_per_s: arguments.slew_v_per_s, ..Amplifier::up_to(limit_v) };
    let amplifiers: Vec<Amplifier> = arguments.limit_v.iter().map(behind).collect();
    plant::remark_on_stair(&arguments.plant, &file, &amplifiers);
    let actual = arguments.actual()?;
    let margin = arguments.known.margin()?;
    let comparison = compare(&file, arguments.rate_hz, &amplifiers, actual.as_ref(), margin)
        .map_err(|error| named(error, SETTINGS))?;
    comparison.remarks.iter().for_each(|text| remark(text));
    print(&if arguments.json { json(&comparison)? } else { text(&comparison) })
}
