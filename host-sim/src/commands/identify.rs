//! `vsj identify`: the linear spring that records show.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use host_sim::output::files::{Files, PLANT_FILE};
use host_sim::output::identify::{self as output, Origin};
use host_sim::output::terminal::{json, print, quoted, wrote};
use identify::{Identified, Input, identify, identify_with_order};
use model::Amplifier;
use simulation::bad_input;
use simulation::plant_file;
use simulation::record::Record;
use simulation::robust_bound::{Allowed, RobustBound};

use super::diagnose::command_line;
use super::identified::bounds_take;
use super::record_arguments::RecordArguments;

/// Find the spring that records show: gain, zero, instantaneous share, delay, time constants, start, noise
///
/// From any record in which the voltage changes, whatever its unit, offset and sign. The smallest linear model that no larger one
/// beats by more than its noise, with 95 % intervals, compared with the best linear models of order 1 to 4 on held-out segments.
/// Several records are of one spring; each has its own zero and start, and each is held out as a whole.
///
/// DATA.csv has the columns time_s, voltage_v (commanded) and the measured one. It must contain every change of the voltage. The
/// voltage of a row applies from its time on, and its reading is taken just after.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj identify data/sample_hysteresis.csv          a table and remarks
  vsj identify a.csv b.csv                         two records of one spring
  vsj identify hv.csv --time t_ms:ms --voltage u_kV:kV --reading x_mm:mm
  vsj identify record.csv --order 1                with one time constant
  vsj identify record.csv --out out/spring         with a page and plant.toml
  vsj diagnose record.csv --plant out/spring/plant.toml
  vsj bound --plant out/spring/plant.toml --identified out/spring/identify.json
  vsj identify record.csv --json | jq .nominal")]
pub(crate) struct Arguments {
    #[command(flatten)]
    record: RecordArguments,
    /// Order of the model, its number of poles: 1 to 4, as far as the readings allow; default: the smallest that no larger one beats.
    /// The voltage drives all poles of an order that is given
    #[arg(long, value_name = "N")]
    order: Option<usize>,
    /// Write report.html, identify.json, the plots and the spring (plant.toml) to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let (measured, input) = arguments.record.open()?;
    if input == Input::Stair {
        bad_input!("--input stair: expected hold or linear; the report's stair is for `vsj diagnose`");
    }
    let units = measured.first().map(|measured| measured.units.clone()).unwrap_or_default();
    let records: Vec<Record> = measured.into_iter().map(|measured| measured.record).collect();
    let files = arguments.out.as_deref().map(Files::new).transpose()?;
    let mut identified = match arguments.order {
        Some(order) => identify_with_order(&records, order, input, &units)?,
        None => identify(&records, input, &units)?,
    };
    if let Some(folder) = &arguments.out {
        identified.report.model = Some(folder.join(PLANT_FILE).display().to_string());
        identified.report.bound_command = bound_command(folder, &identified)?;
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

/// The command line of `vsj bound` on the spring and its intervals, once they are written to a folder; `None` if it does not take them.
fn bound_command(folder: &Path, identified: &Identified) -> Result<Option<String>> {
    let Identified { plant, report, .. } = identified;
    // Its steps are in V.
    let is_in_volts = plant.units.as_ref().is_none_or(|units| units.other_command().is_none());
    let allowed = Allowed { amplifier: Amplifier::up_to(Amplifier::MOST_V), overshoot: 0.0 };
    let is_linear = RobustBound::new(plant, allowed).is_ok();
    let runs = plant_file::parse(PLANT_FILE, &plant.to_toml()?).is_ok();
    let [plant, answer] =
        [PLANT_FILE, output::ANSWER_FILE].map(|name| quoted(&folder.join(name).display().to_string()));
    let takes = is_in_volts && is_linear && runs && bounds_take(report);
    Ok(takes.then(|| format!("vsj bound --plant {plant} --identified {answer}")))
}
