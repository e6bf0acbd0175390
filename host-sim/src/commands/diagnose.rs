//! `vsj diagnose`: differences between the simulation and measured data.

use std::iter;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::diagnosis::text;
use host_sim::output::diagnosis::{self as output, Origin};
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, wrote};
use identify::plant::base::Base;
use identify::{Input, Options, examine};
use indicatif::ProgressBar;
use simulation::plant_file;
use simulation::record::{MEASURED, Record};
use simulation::schedule::Schedule;

use super::choice::{INPUT, one_of};

/// Tolerance in s within which a row of the stair may have the voltage before or after a step.
const RAMP_S: f64 = 0.1;

/// Find out how the simulation differs from measured data, name the cause, and measure the held-out improvement
///
/// DATA.csv has the columns time_s, voltage_v (commanded) and stiffness (as the equivalent static voltage in V, or -
/// for a missing reading). It must contain every change of the voltage. The voltage of a row applies from its time on,
/// and its reading is taken just after, so that it includes the instantaneous part of a step to this voltage. If
/// voltage_v is missing, applied_v is used, as written by `vsj stair --out`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj diagnose record.csv                      three sentences and a table
  vsj diagnose record.csv --out out/diagnosis  with a page, plots, residuals
  vsj stair --plant out/diagnosis/plant.toml   the controller on the result
  vsj diagnose record.csv --json | jq .findings
  vsj diagnose data/table3_stair.csv --column measured --input stair

Verdicts: consistent (no difference beyond noise), explained, ambiguous (other causes explain it as well), unexplained (no \
known cause does), insufficient (too little excitation to decide). All of them exit with 0.")]
pub(crate) struct Arguments {
    /// The record
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The simulation to compare with: `paper`, or a plant file. Parts of the file (memory, law, leakage, amplifier,
    /// further time constants) that the spring does not have are named in a sentence and in the field `take_out` of the
    /// JSON, and omitted from the extended spring
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Interpolation of the voltage between the rows
    #[arg(long, default_value = "hold", value_parser = one_of(INPUT))]
    input: Input,
    /// Column with the measured stiffness
    #[arg(long, default_value = MEASURED, value_name = "NAME")]
    column: String,
    /// Write report.html, diagnosis.json, residuals.csv, the plots and the extended spring (plant.toml) to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl Arguments {
    fn origin(&self, record: &Record) -> Origin {
        // The path of the program is omitted, since the page may be read elsewhere.
        let words = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
        let command: Vec<String> = iter::once("vsj".to_owned()).chain(words).collect();
        Origin {
            record: record.name.clone(),
            column: self.column.clone(),
            input: self.input,
            command: command.join(" "),
        }
    }
}

/// Quotes a word for a shell where necessary.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let base = Base::new(plant_file::load(&arguments.plant)?)?;
    let record = Record::open_measured(&arguments.data, &arguments.column)?;
    if arguments.input == Input::Stair {
        Schedule::stair().check_commanded("the report's stair (--input stair)", &record, RAMP_S)?;
    }
    let options = Options { input: arguments.input, base, ..Options::default() };
    // A folder that cannot be created is reported before the search starts.
    let files = arguments.out.as_deref().map(Files::new).transpose()?;
    let bar = ProgressBar::new_spinner();
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    let mut diagnosis = examine(&record, &options, |causes| bar.set_message(format!("so far: {causes}")))?;
    bar.finish_and_clear();
    if let Some(folder) = &arguments.out {
        diagnosis.report.extended.model = Some(folder.join(output::PLANT_FILE).display().to_string());
    }
    let paths = match files {
        Some(files) => output::write(files, &diagnosis, &arguments.origin(&record))?,
        None => Vec::new(),
    };
    print(&if arguments.json {
        json(&diagnosis.report)?
    } else {
        text::text(&record.name, &diagnosis.report) + &wrote(&paths)
    })
}
