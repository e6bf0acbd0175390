//! `vsj plan`: the next experiment after a diagnosis.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::plan::{self as output, SCHEDULE_FILE, text};
use host_sim::output::terminal::{json, print, wrote};
use identify::plan::{Basis, Request, plan};
use simulation::bounded_file::read_text;

use super::diagnose::command_line;

/// Compute the next experiment: the schedule that decides between the causes that a diagnosis leaves undecided
///
/// From all schedules within range, slew rate and time, the one whose predicted readings differ most between the sets of causes,
/// after the parameters of each have been fitted to the readings that the others predict. The voltage starts and ends at 0 V, and
/// has no other signs than in the record. If nothing is undecided, the schedule gives the tightest intervals and shows as many
/// causes as possible.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj diagnose record.csv --json > diagnosis.json
  vsj plan diagnosis.json                       the schedule as a table
  vsj plan diagnosis.json --out plan            with schedule, plant file, plots
  vsj plan diagnosis.json --minutes 10 --limit-v 700 --slew-v-per-s 200
  vsj plan diagnosis.json --json | jq .probability
  vsj stair --plant plan/plant.toml --input plan/schedule.csv --controller none
  vsj link /dev/ttyACM0 record next.csv --input plan/schedule.csv --arm
  vsj diagnose next.csv --plant plan/plant.toml       the decision")]
pub(crate) struct Arguments {
    /// The diagnosis: what `vsj diagnose --json` prints, or diagnosis.json of its --out; at most 64 MiB
    #[arg(value_name = "DIAGNOSIS.json")]
    diagnosis: PathBuf,
    /// Duration of the experiment, in minutes; default: 4 for the report's spring, as many time constants for another
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    minutes: Option<f64>,
    /// Largest magnitude of the voltage, in V, at most 1000 V or the record's; of a command that is no voltage in its own
    /// unit, without that maximum; default: that of the record
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    limit_v: Option<f64>,
    /// Largest rate of change of the voltage, in V/s, or in the unit of a command that is no voltage per s; default: steps
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// Write schedule.csv, plan.json, the diagnosis' spring as plant.toml, and plots of the schedule and of the predicted
    /// readings to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Largest size of a diagnosis, in MiB; one of a record of a million rows has less.
const MOST_MIB: usize = 64;

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { minutes, limit_v, slew_v_per_s, .. } = *arguments;
    let request = Request { minutes, limit_v, slew_v_per_s };
    request.check()?;
    let name = arguments.diagnosis.display().to_string();
    let basis = Basis::from_json(&name, &read_text(&arguments.diagnosis, MOST_MIB, "the JSON of `vsj diagnose`")?)?;
    // A folder that cannot be created is reported before the search starts.
    let files = arguments.out.as_deref().map(Files::new).transpose()?;
    let mut plan = plan(&basis, &request, &name)?;
    let spring = &basis.experiment(&name)?.plant;
    plan.schedule = arguments.out.as_deref().map(|folder| folder.join(SCHEDULE_FILE).display().to_string());
    let paths = match files {
        Some(files) => output::write(files, &plan, spring, &command_line())?,
        None => Vec::new(),
    };
    print(&if arguments.json {
        json(&plan)?
    } else {
        text::text(&plan) + "\n" + &text::how_to_play(&plan, spring) + &wrote(&paths)
    })
}
