//! `vsj stair`: the stair experiment in closed loop on the fixed-point controller.

use std::path::{Path, PathBuf};

use super::choice::{BETWEEN, one_of};
use super::spring_error::Known;
use anyhow::Result;
use clap::{Args, Parser, ValueEnum};
use host_sim::output::file::write_whole;
use host_sim::output::files::{Files, write_csv, write_sheet};
use host_sim::output::terminal::{json, print, remark, wrote};
use host_sim::output::{plots, stair};
use indicatif::{ProgressBar, ProgressStyle};
use model::{Amplifier, Approach, Compensation, Gains};
use paper::stair::request::{Answer, Request, Target};
use record_files::Container;
use simulation::bad_input;
use simulation::bad_input::number;
use simulation::experiment::paper_spring;
use simulation::option_names::{SETTINGS, named};
use simulation::plant_file::{self, PlantFile};
use simulation::record::{MEASURED, Record};
use simulation::schedule::Between;

/// Run the stair experiment in closed loop on the fixed-point controller, compared with the report's Table 3
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj stair                                 the report's experiment
  vsj stair --out out/stair                 with CSV and plots
  vsj stair --out stair.mcap                a file for Foxglove, PlotJuggler
  vsj stair --controller none --input step  no controller, ideal steps
  vsj stair --limit-v 1000 --kp 8 --ki 2.7  another amplifier, other gains
  vsj stair --controller fast --input step  as fast as the amplifier allows
  vsj stair --controller robust --known tau=5 --known share=5  no overshoot beyond 2 % on any of these springs
  vsj stair --plant spring.toml             another spring: hysteresis, creep
  vsj stair --input schedule.csv --json     columns time_s,voltage_v")]
pub(crate) struct Arguments {
    /// Controller whose steps, CSV and voltage are shown
    #[arg(long, value_enum, default_value_t = Controller::Paper)]
    controller: Controller,
    /// The spring: `paper`, or a plant file of at most 1 MiB; its recorded limit and slew apply where they are stricter than
    /// the options
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// `stair` with the report's 0.1 s ramps, `step` for the same stair as ideal steps, or a file with columns
    /// time_s,voltage_v
    #[arg(long, default_value = "stair", value_name = "stair|step|FILE.csv")]
    input: String,
    /// Interpolation of the voltage between two rows of an input file; default: hold
    #[arg(long, value_parser = one_of(BETWEEN))]
    between: Option<Between>,
    /// Column of an input file with the measured stiffness; default: stiffness, if it exists
    #[arg(long, value_name = "NAME")]
    column: Option<String>,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 700.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// Lowest voltage of the amplifier, in V
    #[arg(long, default_value_t = 0.0, value_name = "V", allow_negative_numbers = true)]
    min_v: f64,
    /// Slew limit of the amplifier, in V/s; default: none
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// Width of the DAC, in bits
    #[arg(long, default_value_t = 12, value_name = "BITS")]
    dac_bits: u32,
    /// Proportional gain of the controller
    #[arg(long, default_value_t = Gains::PAPER.proportional, value_name = "GAIN", allow_negative_numbers = true)]
    kp: f64,
    /// Integral gain of the controller, in 1/s
    #[arg(long, default_value_t = Gains::PAPER.integral_per_s, value_name = "GAIN", allow_negative_numbers = true)]
    ki: f64,
    /// Time constant of the fast controller's approach to the target, in s, 0 to 1; default: 0
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    approach_s: Option<f64>,
    #[command(flatten)]
    known: Known,
    /// Ticks per second, 100 to 10 000
    #[arg(long, default_value_t = 1000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
    /// Write stair.csv, stiffness.svg and voltage.svg to this folder, or the rows to this MCAP or Parquet file
    #[arg(long, value_name = "DIR|FILE.mcap|FILE.parquet")]
    out: Option<PathBuf>,
    /// Time between two rows of the CSV, in s; default: every tick
    #[arg(long, value_name = "S", allow_negative_numbers = true, requires = "out")]
    every: Option<f64>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Controller {
    /// No controller: the target is the voltage
    None,
    /// The report's proportional-integral pre-compensator
    Paper,
    /// Time-optimal: the end of the range until the target can be held, then the holding voltage
    Fast,
    /// As fast as every spring allows that is possible within the errors of --known
    Robust,
}

/// Makes the arguments without a command line equal to the defaults of the options.
#[derive(Parser)]
struct Defaults {
    #[command(flatten)]
    arguments: Arguments,
}

impl Arguments {
    /// The arguments of `vsj` without a command: the report's experiment, with files in out/stair.
    pub(crate) fn main_job() -> Self {
        Defaults::parse_from(["vsj", "--out", "out/stair"]).arguments
    }

    /// The experiment on a plant file's spring.
    fn request<'a>(&self, plant: &'a PlantFile, target: Target<'a>) -> Result<Request<'a>> {
        let margin = self.known.margin()?;
        if margin.is_some() != (self.controller == Controller::Robust) {
            bad_input!("--known belongs to the robust controller: expected --controller robust --known KEY=PERCENT");
        }
        Ok(Request {
            plant,
            paper: self.plant == "paper",
            target,
            compensation: match (self.controller, margin) {
                (_, Some(margin)) => Compensation::Robust(margin),
                (Controller::Fast, _) => {
                    Compensation::TimeOptimal(Approach { time_constant_s: self.approach_s.unwrap_or(0.0) })
                }
                _ => Compensation::ProportionalIntegral(Gains { proportional: self.kp, integral_per_s: self.ki }),
            },
            controlled: self.controller != Controller::None,
            amplifier: Amplifier {
                min_v: self.min_v,
                slew_v_per_s: self.slew_v_per_s,
                dac_bits: self.dac_bits,
                ..Amplifier::up_to(self.limit_v)
            },
            rate_hz: self.rate_hz,
        })
    }

    /// Rejects options that would be ignored.
    fn check(&self) -> Result<()> {
        let no_file = ["stair", "step"].contains(&self.input.as_str());
        for (option, given) in [("--between", self.between.is_some()), ("--column", self.column.is_some())] {
            if given && no_file {
                bad_input!("{option} has no effect with --input {}: expected --input FILE.csv", self.input);
            }
        }
        if self.approach_s.is_some() && self.controller != Controller::Fast {
            bad_input!("--approach-s applies to the fast controller only: expected --controller fast");
        }
        Ok(())
    }

    /// Number of ticks between two rows of the CSV.
    fn stride(&self) -> Result<usize> {
        match self.every {
            None => Ok(1),
            Some(every) if every.is_finite() && every > 0.0 => Ok((every * self.rate_hz).round().max(1.0) as usize),
            Some(every) => bad_input!("--every {}: expected a positive number of seconds", number(every)),
        }
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    arguments.check()?;
    let file = plant_file::load(&arguments.plant)?;
    let left_out = file.left_out();
    if !left_out.is_empty() {
        remark(&format!("{}: not simulated: {}", arguments.plant, left_out.join(", ")));
    }
    let stride = arguments.stride()?;
    let record = match arguments.input.as_str() {
        "stair" | "step" => None,
        file => Some(Record::open(Path::new(file), arguments.column.as_deref().unwrap_or(MEASURED))?),
    };
    let target = match &record {
        Some(record) => Target::Record(record, arguments.between.unwrap_or_default()),
        None if arguments.input == "stair" => Target::Stair,
        None => Target::Step,
    };
    let bar = ProgressBar::no_length().with_style(ProgressStyle::with_template("{bar:40} {percent} % of {len} ticks")?);
    let request = arguments.request(&file, target)?;
    request.check().map_err(|error| named(error, SETTINGS))?;
    let answer = request.run(|done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let paths = match &arguments.out {
        Some(folder) => write(folder, &answer, arguments.controller != Controller::None, stride)?,
        None => Vec::new(),
    };
    print(&if arguments.json { json(&answer.report)? } else { stair::text(&answer.report) + &wrote(&paths) })
}

fn write(folder: &Path, answer: &Answer, controlled: bool, stride: usize) -> Result<Vec<PathBuf>> {
    let Answer { experiment, run, report } = answer;
    let samples = if controlled { &run.with } else { &run.without };
    let spring = paper_spring()?;
    if let Some(container) = Container::of(folder) {
        write_whole(folder, |out| write_sheet(out, container, experiment, run, samples, &spring, stride))?;
        return Ok(vec![folder.to_owned()]);
    }
    let mut files = Files::new(folder)?;
    files.add("stair.csv", |out| write_csv(out, experiment, run, samples, &spring, stride))?;
    for (name, svg) in [
        ("stiffness.svg", plots::stiffness(experiment, run, report)),
        ("voltage.svg", plots::voltage(experiment, run, samples)),
    ] {
        files.add(name, |out| out.write_all(svg.as_bytes()))?;
    }
    files.finish()
}
