//! `vsj dynamics`: the report's dynamic models.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, wrote};
use host_sim::output::{dynamics, figure};
use paper::dynamics::input::Input;
use paper::dynamics::plant::PlantGains;
use paper::dynamics::report::{self, Model, Setup};
use paper::dynamics::zener::{Changes, Start, Zener};
use simulation::option_names::named;
use simulation::schedule::Between;

use super::choice::{BETWEEN, CHANGES, MODEL, one_of};

/// Run one of the report's dynamic models, and give the equivalent parameters of the others
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj dynamics spring-damper           the report's input: 1, 4, 7, 1, 30 s each
  vsj dynamics zener --changes both --out out/zener
  vsj dynamics analogue --json         the same springs as a circuit
  vsj dynamics pi-plant --input stair  the plant alone on the stair of Table 3
  vsj dynamics zener --k1 5 --k2 0.5 --input levels.csv --between linear")]
pub(crate) struct Arguments {
    /// The dynamic model
    #[arg(value_parser = one_of(MODEL))]
    model: Model,
    /// Series spring at level 1, in N/m
    #[arg(long, default_value_t = 10.0, value_name = "N/M", allow_negative_numbers = true)]
    k1: f64,
    /// Damped spring at level 1, in N/m
    #[arg(long, default_value_t = 1.0, value_name = "N/M", allow_negative_numbers = true)]
    k2: f64,
    /// Damper, in N s/m
    #[arg(long, default_value_t = 10.0, value_name = "N_S/M", allow_negative_numbers = true)]
    damper: f64,
    /// Constant force, in N
    #[arg(long, default_value_t = 10.0, value_name = "N", allow_negative_numbers = true)]
    force: f64,
    /// Relaxed length of spring and damper, in m
    #[arg(long, default_value_t = 1.0, value_name = "M", allow_negative_numbers = true)]
    length: f64,
    /// The springs of the Zener model that follow the level
    #[arg(long, default_value = "k2", value_parser = one_of(CHANGES))]
    changes: Changes,
    /// Proportional gain of the plant
    #[arg(long, default_value_t = 0.1, value_name = "GAIN", allow_negative_numbers = true)]
    kp: f64,
    /// Integral gain of the plant, in 1/s
    #[arg(long, default_value_t = 0.2, value_name = "GAIN", allow_negative_numbers = true)]
    ki: f64,
    /// The report's levels, the stair, or a file with columns time_s,voltage_v
    #[arg(long, default_value = "report", value_name = "report|stair|FILE.csv")]
    input: String,
    /// Interpolation of the level between two rows of an input file
    #[arg(long, default_value = "hold", value_parser = one_of(BETWEEN))]
    between: Between,
    /// Start in equilibrium under the force and the first level, instead of just loaded
    #[arg(long)]
    settled: bool,
    /// Time between two rows, in s
    #[arg(long, default_value_t = 5.0, value_name = "S", allow_negative_numbers = true)]
    every: f64,
    /// Write response.csv and response.svg to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let setup = Setup {
        model: arguments.model,
        zener: Zener {
            k1_n_per_m: arguments.k1,
            k2_n_per_m: arguments.k2,
            damper_n_s_per_m: arguments.damper,
            force_n: arguments.force,
            changes: arguments.changes,
        },
        length_m: arguments.length,
        gains: PlantGains { proportional: arguments.kp, integral_per_s: arguments.ki },
        input: Input::open(&arguments.input, arguments.between)?,
        start: if arguments.settled { Start::Settled } else { Start::Unloaded },
        every_s: arguments.every,
    };
    let report = report::Report::new(&setup).map_err(|error| named(error, OPTIONS))?;
    let mut written = String::new();
    if let Some(folder) = &arguments.out {
        let mut files = Files::new(folder)?;
        files.add("response.csv", |out| out.write_all(dynamics::csv(&report).as_bytes()))?;
        files.add("response.svg", |out| out.write_all(figure::svg(&report.figure()).as_bytes()))?;
        written = wrote(&files.finish()?);
    }
    print(&if arguments.json { json(&report)? } else { dynamics::text(&report) + &written })
}

/// The option of each field that an error may begin with.
const OPTIONS: &[(&str, &str)] = &[
    ("k1_n_per_m", "--k1"),
    ("k2_n_per_m", "--k2"),
    ("damper_n_s_per_m", "--damper"),
    ("force_n", "--force"),
    ("length_m", "--length"),
    ("proportional", "--kp"),
    ("integral_per_s", "--ki"),
    ("every_s", "--every"),
];
