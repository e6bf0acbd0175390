//! `vsj compare`: every controller on the same steps.

use anyhow::Result;
use clap::Args;
use host_sim::output::compare::text;
use host_sim::output::terminal::{json, print};
use model::Amplifier;
use simulation::bad_input;
use simulation::comparison::compare;
use simulation::plant_file;

use super::option_names::{SETTINGS, named};

/// Compare all controllers on the stair of ideal steps with each other and with the lower bound for any controller
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj compare                             none, paper, fast at 700 V and 1000 V
  vsj compare --limit-v 850 --slew-v-per-s 500
  vsj compare --plant spring.toml --json  on another spring")]
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
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Largest number of amplifiers; each takes a second.
const MOST_AMPLIFIERS: usize = 16;

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if arguments.limit_v.len() > MOST_AMPLIFIERS {
        bad_input!("--limit-v: {} amplifiers; expected at most {MOST_AMPLIFIERS}", arguments.limit_v.len());
    }
    let file = plant_file::load(&arguments.plant)?;
    let behind = |&limit_v: &f64| Amplifier { slew_v_per_s: arguments.slew_v_per_s, ..Amplifier::up_to(limit_v) };
    let amplifiers: Vec<Amplifier> = arguments.limit_v.iter().map(behind).collect();
    let comparison = compare(&file, arguments.rate_hz, &amplifiers).map_err(|error| named(error, SETTINGS))?;
    print(&if arguments.json { json(&comparison)? } else { text(&comparison) })
}
