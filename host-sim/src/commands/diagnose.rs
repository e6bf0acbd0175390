//! `vsj diagnose`: what the simulation gets wrong on measured data.

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

/// Within this time, in s, a row of the stair may have the voltage before a step or that after it.
const RAMP_S: f64 = 0.1;

/// Show what the simulation gets wrong on measured data, name the cause, measure the gain of the cure
///
/// DATA.csv has the columns time_s, voltage_v (commanded) and stiffness (volts of equivalent static voltage, or - where
/// nothing was read). Every change of the voltage belongs in it. A row's voltage is there from its time on, and its reading is
/// taken just after: of a step to this voltage, it has the part that comes at once. Without voltage_v, applied_v is taken, as
/// `vsj stair --out` writes it.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj diagnose record.csv                      three sentences and a table
  vsj diagnose record.csv --out out/diagnosis  with a page, plots, residuals
  vsj stair --plant out/diagnosis/plant.toml   the controller on what was found
  vsj diagnose record.csv --json | jq .findings
  vsj diagnose data/table3_stair.csv --column measured --input stair

Verdicts: consistent (nothing is wrong), explained, ambiguous (rival causes explain it as well), unexplained (no known \
cause does), insufficient (the record cannot tell). All of them exit with 0.")]
pub(crate) struct Arguments {
    /// The record
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The simulation to be judged: `paper`, or a plant file. What of that is not in the spring (memory, law, leakage, amplifier,
    /// further time constants) is named in a sentence, `take_out` in JSON, and left out of the extended spring
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// What the voltage did between the rows
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
        // Not where the program lies: the page may be read elsewhere.
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

/// A word as a shell takes it.
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
    let options = Options { input: arguments.input, base };
    // A folder that cannot be made is known before the search begins.
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
