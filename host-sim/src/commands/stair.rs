//! `vsj stair`: the stair experiment in closed loop on the fixed-point controller.

use std::path::{Path, PathBuf};

use super::choice::{BETWEEN, one_of};
use super::loop_arguments::LoopArguments;
use super::plant;
use anyhow::Result;
use clap::{Args, Parser};
use host_sim::output::file::write_whole;
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, wrote};
use host_sim::output::ticks::Ticks;
use host_sim::output::{plots, stair};
use indicatif::{ProgressBar, ProgressStyle};
use paper::stair::request::{Answer, Request, Target};
use record_files::Container;
use simulation::bad_input;
use simulation::bad_input::number;
use simulation::control_loop::{Controller, Options};
use simulation::experiment::paper_spring;
use simulation::option_names::{SETTINGS, named};
use simulation::plant_file::PlantFile;
use simulation::record::{MEASURED, Record};
use simulation::schedule::Between;

/// Run the stair experiment in closed loop on the fixed-point controller, compared with the report's Table 3
///
/// The steps are of 100 V, up to 500 V; smaller where the range of a plant file's record, amplifier, law or command is too small
/// for them.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj stair                                 the report's experiment
  vsj stair --out out/stair                 with CSV and plots
  vsj stair --out stair.mcap                a file for Foxglove, PlotJuggler
  vsj stair --controller none --input step  no controller, ideal steps
  vsj stair --limit-v 1000 --kp 8 --ki 2.7  another amplifier, other gains
  vsj stair --controller fast --input step  as fast as the amplifier allows
  vsj stair --known tau=5 --known share=5   a spring known to within 5 %
  vsj stair --plant spring.toml             another spring: hysteresis, creep
  vsj stair --input schedule.csv --json     columns time_s,voltage_v")]
pub(crate) struct Arguments {
    #[command(flatten)]
    control: LoopArguments,
    /// `stair` with the report's 0.1 s ramps, `step` for the same stair as ideal steps, or a file of at most 1 000 000 rows and 512 MiB
    /// with columns time_s,voltage_v
    #[arg(long, default_value = "stair", value_name = "stair|step|FILE.csv")]
    input: String,
    /// Interpolation of the voltage between two rows of an input file; default: hold
    #[arg(long, value_parser = one_of(BETWEEN))]
    between: Option<Between>,
    /// Column of an input file with the measured stiffness; default: stiffness, if it exists
    #[arg(long, value_name = "NAME")]
    column: Option<String>,
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
    fn request<'a>(&self, options: Options, plant: &'a PlantFile, target: Target<'a>) -> Request<'a> {
        let with = |controller| Request {
            plant,
            paper: self.control.plant == "paper",
            target,
            compensation: Options { controller, ..options }.compensation(),
            controlled: options.controller != Controller::None,
            amplifier: options.amplifier(),
            rate_hz: options.rate_hz,
        };
        match options.controller {
            // The loop without a controller is run beside one with the report's, whose gain may be too large for a quick spring.
            Controller::None => Some(with(Controller::Paper))
                .filter(|request| request.check().is_ok())
                .unwrap_or_else(|| with(Controller::None)),
            controller => with(controller),
        }
    }

    /// Rejects options that would be ignored.
    fn check(&self) -> Result<()> {
        let no_file = ["stair", "step"].contains(&self.input.as_str());
        for (option, given) in [("--between", self.between.is_some()), ("--column", self.column.is_some())] {
            if given && no_file {
                bad_input!("{option} has no effect with --input {}: expected --input FILE.csv", self.input);
            }
        }
        Ok(())
    }

    /// Number of ticks between two rows of the CSV.
    fn stride(&self, rate_hz: f64) -> Result<usize> {
        match self.every {
            None => Ok(1),
            Some(every) if every.is_finite() && every > 0.0 => Ok((every * rate_hz).round().max(1.0) as usize),
            Some(every) => bad_input!("--every {}: expected a positive number of seconds", number(every)),
        }
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    arguments.check()?;
    let file = plant::load(&arguments.control.plant)?;
    let options = arguments.control.options(&file)?;
    let stride = arguments.stride(options.rate_hz)?;
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
    let request = arguments.request(options, &file, target);
    request.check().map_err(|error| named(error, SETTINGS))?;
    if record.is_none() {
        plant::remark_on_stair(&arguments.control.plant, &file, &[request.amplifier]);
    }
    let answer = request.run(|done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let controlled = options.controller != Controller::None;
    let paths = match &arguments.out {
        Some(path) => write(path, &answer, controlled, stride)?,
        None => Vec::new(),
    };
    print(&if arguments.json {
        json(&answer.report)?
    } else {
        stair::text(&answer.report, controlled) + &wrote(&paths)
    })
}

/// Writes the rows to `path` if it is the name of an MCAP or Parquet file, otherwise rows and plots to this folder.
fn write(path: &Path, answer: &Answer, controlled: bool, stride: usize) -> Result<Vec<PathBuf>> {
    let Answer { experiment, run, report } = answer;
    let samples = if controlled { &run.with } else { &run.without };
    let ticks = Ticks { experiment, run, samples, spring: &paper_spring()?, stride };
    if let Some(container) = Container::of(path) {
        write_whole(path, |out| ticks.write_container(container, out))?;
        return Ok(vec![path.to_owned()]);
    }
    let mut files = Files::new(path)?;
    files.add("stair.csv", |out| ticks.write_csv(out))?;
    for (name, svg) in [
        ("stiffness.svg", plots::stiffness(experiment, run, report)),
        ("voltage.svg", plots::voltage(experiment, run, samples)),
    ] {
        files.add(name, |out| out.write_all(svg.as_bytes()))?;
    }
    files.finish()
}
