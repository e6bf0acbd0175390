//! `vsj diagnose`: differences between the simulation and measured data.

use std::iter;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use host_sim::output::diagnosis::text;
use host_sim::output::diagnosis::{self as output, Origin};
use host_sim::output::files::{Files, PLANT_FILE};
use host_sim::output::terminal::{json, print, print_error, quoted, remark, wrote};
use host_sim::signals::on_ctrl_c;
use identify::{Diagnosis, Effort, Input, Options, Stop, examine_several, identify};
use indicatif::{ProgressBar, ProgressStyle};
use simulation::plant_file;
use simulation::record::{MeasuredRecord, Record};

use super::choice::{EFFORT, duration, one_of};
use super::record_arguments::RecordArguments;

/// Find out how the simulation differs from measured data, name the cause, and measure the held-out improvement
///
/// DATA.csv has the columns time_s, voltage_v (commanded) and stiffness (as the equivalent static voltage in V; nothing, -, NaN, NA,
/// N/A, #N/A, null or None for a missing reading), or others that the options below name with their units. It must contain every change of the
/// voltage. The voltage of a row applies from its time on, and its reading is taken just after, so that it includes the
/// instantaneous part of a step to this voltage. If voltage_v is missing, applied_v is used, as written by
/// `vsj stair --out`.
///
/// A file has at most a million rows and 512 MiB.
///
/// Several files are records of one spring: each has its own initial state, zero offset and noise, the causes are shared, and
/// what is in one record only is listed as a fault of that record.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj diagnose record.csv                      three sentences and a table
  vsj diagnose record.csv --out out/diagnosis  with a page, plots, residuals
  vsj stair --plant out/diagnosis/plant.toml   the controller on the result
  vsj diagnose monday.csv tuesday.csv          two records of one spring
  vsj diagnose record.csv --json | jq .findings
  vsj diagnose record.csv --within 10s         the best answer after 10 s
  vsj diagnose data/table3_stair.csv --column measured --input stair
  vsj diagnose a.csv --time t_ms:ms --voltage u_kV:kV --reading x_mm:mm
  vsj diagnose a.csv --columns instrument.toml --sort

Verdicts: consistent (no difference beyond noise), explained, ambiguous (other causes explain it as well), unexplained (no \
known cause does), insufficient (too little excitation to decide). All of them exit with 0.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    record: RecordArguments,
    /// The simulation to compare with: `paper`, `identify` for what `vsj identify` finds in the records, or a plant
    /// file. Parts of the file (memory, law, leakage, amplifier, further time constants) that the spring does not have
    /// are named in a sentence and in the field `take_out` of the JSON, and omitted from the extended spring. A plant file has
    /// at most 1 MiB
    #[arg(long, default_value = "paper", value_name = "paper|identify|FILE.toml")]
    plant: String,
    /// Write report.html, diagnosis.json, residuals.csv, the plots and the extended spring (plant.toml) to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How long causes are searched for; the answer is the same on every machine
    #[arg(long, default_value = "normal", value_parser = one_of(EFFORT))]
    effort: Effort,
    /// Longest time until the best answer so far is given, in s or with a unit (10, 10s, 2min). Ctrl-C gives it
    /// immediately, a second Ctrl-C ends the program
    #[arg(long, value_name = "TIME", value_parser = duration)]
    within: Option<Duration>,
    /// A line on stderr for each set of causes that becomes the best, also where stderr is not a terminal
    #[arg(long)]
    progress: bool,
    /// One JSON object on stdout; progress stays on stderr
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// The options of the diagnosis: the one place where its nominal spring is made.
    fn options(&self, measured: &[MeasuredRecord], records: &[Record], input: Input, stop: Stop) -> Result<Options> {
        let units = measured.first().map(|measured| measured.units.clone()).unwrap_or_default();
        let options = Options { units, input, effort: self.effort, stop, ..Options::default() };
        match self.plant.as_str() {
            "identify" => {
                let identified = identify(records, input, &options.units)?;
                options.judging(identified)
            }
            plant => options.judging_file(plant, plant_file::load_for_host(plant)?),
        }
    }

    fn origin(measured: &[MeasuredRecord], input: Input) -> Origin {
        let column = measured.first().map(|measured| measured.column.clone()).unwrap_or_default();
        Origin { record: names(measured), column, input, command: command_line() }
    }
}

/// Names of the records, separated by commas.
fn names(measured: &[MeasuredRecord]) -> String {
    measured.iter().map(|measured| measured.record.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The command line that was run, without the path of the program, since its answer may be read elsewhere.
pub(super) fn command_line() -> String {
    let words = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
    iter::once("vsj".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Diagnoses records and shows the best causes so far on stderr: as lines, or in one that moves on a terminal.
fn with_progress(records: &[Record], options: &Options, lines: bool) -> Result<Diagnosis> {
    let started = Instant::now();
    let said = |causes: &str| match causes {
        "" => "so far: no cause".to_owned(),
        causes => format!("so far: {causes}"),
    };
    if lines {
        return examine_several(records, options, |causes| {
            print_error(&format!("{:6.1} s  {}\n", started.elapsed().as_secs_f64(), said(causes)));
        });
    }
    let bar = ProgressBar::new_spinner();
    bar.set_style(ProgressStyle::with_template("{spinner} {elapsed} {msg}")?);
    bar.enable_steady_tick(Duration::from_millis(200));
    let diagnosis = examine_several(records, options, |causes| bar.set_message(said(causes)));
    bar.finish_and_clear();
    diagnosis
}

/// Returns a stop after the time that the user allows, and at Ctrl-C; a second Ctrl-C ends the program.
fn stop(within: Option<Duration>) -> Stop {
    let stop = within.map_or_else(Stop::default, Stop::after);
    let interrupted = stop.clone();
    on_ctrl_c(move || interrupted.request());
    stop
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let stop = stop(arguments.within);
    let (measured, input) = arguments.record.open()?;
    let records: Vec<Record> = measured.iter().map(|measured| measured.record.clone()).collect();
    records.iter().try_for_each(|record| input.check(record))?;
    let options = arguments.options(&measured, &records, input, stop)?;
    options.remarks().iter().for_each(|text| remark(text));
    // A folder that cannot be created is reported before the search starts.
    let files = arguments.out.as_deref().map(Files::new).transpose()?;
    let mut diagnosis = with_progress(&records, &options, arguments.progress)?;
    if let Some(folder) = &arguments.out {
        diagnosis.report.extended.model = Some(folder.join(PLANT_FILE).display().to_string());
    }
    let paths = match files {
        Some(files) => output::write(files, &diagnosis, &Arguments::origin(&measured, input))?,
        None => Vec::new(),
    };
    print(&if arguments.json {
        json(&diagnosis.report)?
    } else {
        text::text(&names(&measured), &diagnosis.report, diagnosis.data.scales()) + &wrote(&paths)
    })
}
