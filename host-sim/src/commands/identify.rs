//! `vsj identify`: the linear spring that records show.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::identify::{self as output, Origin};
use host_sim::output::terminal::{json, print, wrote};
use identify::{Input, identify};
use simulation::record::{MEASURED, Record};
use simulation::units::Units;

use super::choice::{RECORDED, one_of};
use super::diagnose::command_line;

/// Find the spring that records show: gain, zero, instantaneous share, delay, time constants, start, noise
///
/// From any record in which the voltage changes, whatever its unit, offset and sign. The smallest linear model that no larger one
/// beats by more than its noise, with 95 % intervals, compared with the best linear models of order 1 to 4 on held-out segments.
/// Several records are of one spring; each has its own zero and start, and each is held out as a whole.
///
/// RECORD.csv has the columns time_s, voltage_v (commanded) and the measured one. It must contain every change of the voltage. The
/// voltage of a row applies from its time on, and its reading is taken just after.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj identify data/sample_hysteresis.csv          a table and remarks
  vsj identify a.csv b.csv --column force          two records of one spring
  vsj identify record.csv --out out/nominal        with a page and plant.toml
  vsj diagnose record.csv --plant out/nominal/plant.toml
  vsj identify record.csv --json | jq .nominal")]
pub(crate) struct Arguments {
    /// Records of one spring
    #[arg(value_name = "RECORD.csv", required = true)]
    records: Vec<PathBuf>,
    /// Interpolation of the voltage between the rows
    #[arg(long, default_value = "hold", value_parser = one_of(RECORDED))]
    input: Input,
    /// Column with the readings
    #[arg(long, default_value = MEASURED, value_name = "NAME")]
    column: String,
    /// Write report.html, identify.json, the plots and the spring (plant.toml) to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Opens the records, and tells in which units they are shown.
    fn open(&self) -> Result<(Vec<Record>, Units)> {
        let records: Result<Vec<Record>> =
            self.records.iter().map(|path| Record::open_measured(path, &self.column)).collect();
        Ok((records?, Units::default()))
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let (records, units) = arguments.open()?;
    let files = arguments.out.as_deref().map(Files::new).transpose()?;
    let mut identified = identify(&records, arguments.input, &units)?;
    if let Some(folder) = &arguments.out {
        identified.report.model = Some(folder.join(output::PLANT_FILE).display().to_string());
    }
    let paths = match files {
        Some(files) => output::write(files, &identified, &units, &Origin { command: command_line() })?,
        None => Vec::new(),
    };
    print(&if arguments.json {
        json(&identified.report)?
    } else {
        output::text::text(&identified, &units) + &wrote(&paths)
    })
}
