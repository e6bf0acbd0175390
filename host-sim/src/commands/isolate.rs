//! `vsj isolate`: the MCU's bank of fault signatures over a record.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::isolate::text;
use host_sim::output::terminal::{json, print};
use model::isolation::{Settings, Tolerance};
use simulation::bad_input;
use simulation::isolation::readings::equivalent;
use simulation::isolation::trace::{self, noise_v};
use simulation::option_names::{SETTINGS, named};
use simulation::plant_file;
use simulation::spring_error::SpringError;

use super::identified::errors;
use super::record_arguments::FormatArguments;
use super::spring_error::ErrorOf;

/// Run the MCU's fault isolation over a record and print what it says, and when
///
/// The model runs on the voltages of the record, the readings are the stiffness sensor's. An alarm comes first; a cause is named when
/// it explains the residual and no other cause does. `ambiguous` names two, `unknown` none. Before the first row the spring is taken
/// to be at rest at 0 V. How rightly: docs/isolation.md.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj isolate data/sample_hysteresis.csv           the trace: alarm, names
  vsj isolate record.csv --plant out/nominal/plant.toml --limit-v 1000
  vsj isolate record.csv --known tau=2 --known gain=1  known within 2 and 1 %
  vsj isolate record.csv --plant plant.toml --identified identified.json
  vsj isolate hv.csv --reading x_mm:mm --plant out/nominal/plant.toml
  vsj isolate record.csv --noise-v 0.5 --json | jq .last")]
pub(crate) struct Arguments {
    /// The record: a table with a header, or an MCAP or Parquet file, of at most 1 000 000 rows and 512 MiB; the voltage is held between
    /// the rows, which are at most 0.6 s apart
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    #[command(flatten)]
    format: FormatArguments,
    /// The nominal spring: `paper`, or a plant file of at most 1 MiB with a share and one time constant only, whose [reading] converts
    /// the readings to V of equivalent static voltage, but for --column
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// `tau`, `gain` or `share` of the nominal spring is known to within this, both ways, 0 to 25 %: errors within it raise no alarm;
    /// repeatable
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    known: Vec<ErrorOf>,
    /// The nominal spring is known to within the 95 % intervals of this file, what `vsj identify --json` prints; at most 16 MiB
    #[arg(long, value_name = "FILE.json", conflicts_with = "known")]
    identified: Option<PathBuf>,
    /// Standard deviation of a reading, in V; default: from the readings
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    noise_v: Option<f64>,
    /// Correlation time of the readings' noise, in s; needs --noise-v
    #[arg(long, default_value_t = 0.0, value_name = "S", allow_negative_numbers = true)]
    noise_correlation_s: f64,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 700.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// Threshold of the alarm: logarithm of the mean number of blocks between false alarms of a test
    #[arg(long, default_value_t = Settings::PAPER.alarm_nats, value_name = "NATS", allow_negative_numbers = true)]
    alarm_nats: f64,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let measured = arguments.format.open_held(&arguments.data)?;
    let plant = plant_file::load(&arguments.plant)?;
    let record = if arguments.format.names_stiffness() { measured.record } else { equivalent(measured, &plant)? };
    if record.rows.iter().all(|row| row.measured.is_none()) {
        bad_input!("{}: no reading; expected some", record.name);
    }
    if arguments.noise_correlation_s > 0.0 && arguments.noise_v.is_none() {
        bad_input!("--noise-correlation-s: expected --noise-v as well; only white noise is found from the readings");
    }
    let noise_v = match arguments.noise_v.or_else(|| noise_v(&record)) {
        Some(0.0) if arguments.noise_v.is_none() => bad_input!(
            "{}: most readings repeat the one before, which shows no noise; expected new readings, or --noise-v",
            record.name
        ),
        Some(noise_v) => noise_v,
        None => bad_input!("{}: fewer than 10 readings; expected more, or --noise-v", record.name),
    };
    let SpringError { time_constant, share, gain, .. } =
        errors("--known", &arguments.known, arguments.identified.as_deref())?;
    let settings = Settings {
        plant: plant.plain(&arguments.plant)?,
        noise_v,
        noise_correlation_s: arguments.noise_correlation_s,
        range_v: arguments.limit_v,
        alarm_nats: arguments.alarm_nats,
        tolerance: Tolerance { time_constant, share, gain },
        ..Settings::PAPER
    };
    let options = [
        ("noise_v", "--noise-v"),
        ("noise_correlation_s", "--noise-correlation-s"),
        ("range_v", "--limit-v"),
        ("alarm_nats", "--alarm-nats"),
        ("plant.time_constant_s", "--plant"),
        ("tolerance.", if arguments.identified.is_some() { "--identified" } else { "--known" }),
    ];
    let trace = trace::run(&record, settings).map_err(|error| named(named(error, SETTINGS), &options))?;
    print(&if arguments.json { json(&trace)? } else { text(&trace) })
}
