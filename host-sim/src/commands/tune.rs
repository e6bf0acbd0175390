//! `vsj tune`: gains and settings for a spring and an amplifier.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, remark, wrote};
use host_sim::output::tune as output;
use model::{Amplifier, Margin};
use simulation::bad_input;
use simulation::option_names::{SETTINGS, named};
use simulation::tune::{Knowledge, Specification, tune};

use super::identified::errors_with_small_shares;
use super::plant;
use super::spring_error::ErrorOf;

/// Choose gains and settings for a spring and an amplifier, with stability margins and the effect of model errors
///
/// For the stair of `vsj compare`: steps of 100 V, smaller where the spring's own range is too small for them.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj tune                                     the report's spring at 700 V
  vsj tune --limit-v 1000 --overshoot-percent 1
  vsj tune --plant spring.toml --out out/tune  with plots over model errors
  vsj tune --known tau=2 --known share=2       a spring known to within 2 %
  vsj tune --identified identified.json        known to the intervals of a file
  vsj tune --json | jq .fast")]
pub(crate) struct Arguments {
    /// The spring: `paper`, or a plant file of at most 1 MiB; its recorded amplifier applies where it is stricter
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 700.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// Slew limit of the amplifier, in V/s; default: none
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// Ticks per second, 100 to 10 000
    #[arg(long, default_value_t = 1000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
    /// Largest overshoot allowed for a step, in percent
    #[arg(long, default_value_t = 5.0, value_name = "PERCENT", allow_negative_numbers = true)]
    overshoot_percent: f64,
    /// `tau`, `gain` or `share` is known to within this, both ways, in 95 % of cases, 0 to 25 %; repeatable
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    known: Vec<ErrorOf>,
    /// The spring is known to the 95 % intervals of this file, what `vsj identify --json` prints; at most 16 MiB
    #[arg(long, value_name = "FILE.json", conflicts_with = "known")]
    identified: Option<PathBuf>,
    /// Part of a step by which the robust controller may let all springs fall back for a while, in percent, 0 to 50
    #[arg(long, default_value_t = 0.0, value_name = "PERCENT", allow_negative_numbers = true)]
    fall_back_percent: f64,
    /// Time in which each step has to be done, in s, for how well the spring has to be known
    #[arg(long, default_value_t = 0.6, value_name = "S", allow_negative_numbers = true)]
    within_s: f64,
    /// Write tune.json, tune.txt, trade.csv, t97.svg and overshoot.svg to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// How well the spring is known, if an option says so.
    fn knowledge(&self) -> Result<Option<Knowledge>> {
        let within_s = self.within_s;
        if !(within_s.is_finite() && within_s > 0.0) {
            bad_input!("--within-s {within_s}: expected a number above 0");
        }
        if self.known.is_empty() && self.identified.is_none() {
            if self.fall_back_percent != 0.0 {
                bad_input!("--fall-back-percent: expected --known or --identified as well");
            }
            return Ok(None);
        }
        let largest = Margin::LARGEST_ERROR;
        let spring_error = errors_with_small_shares("--known", &self.known, self.identified.as_deref(), largest)?;
        Ok(Some(Knowledge { spring_error, within_s, fall_back: self.fall_back_percent / 100.0 }))
    }
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let overshoot_percent = arguments.overshoot_percent;
    if !(0.0..=100.0).contains(&overshoot_percent) {
        bad_input!("--overshoot-percent {overshoot_percent}: expected 0 to 100");
    }
    let file = plant::load(&arguments.plant)?;
    let amplifier =
        file.behind(Amplifier { slew_v_per_s: arguments.slew_v_per_s, ..Amplifier::up_to(arguments.limit_v) });
    plant::remark_on_stair(&arguments.plant, &file, &[amplifier]);
    let knowledge = arguments.knowledge()?;
    let specification =
        Specification { file: &file, amplifier, rate_hz: arguments.rate_hz, overshoot_percent, knowledge };
    let answer = tune(&specification).map_err(|error| named(error, SETTINGS))?;
    answer.uncertainty.iter().flat_map(|uncertainty| &uncertainty.remarks).for_each(|text| remark(text));
    let json = json(&answer)?;
    let text = output::text(&answer, &arguments.plant);
    let mut written = String::new();
    if let Some(folder) = &arguments.out {
        let mut files = Files::new(folder)?;
        files.add("tune.json", |out| out.write_all(json.as_bytes()))?;
        files.add("tune.txt", |out| out.write_all(text.as_bytes()))?;
        output::write(&mut files, &answer)?;
        written = wrote(&files.finish()?);
    }
    print(&if arguments.json { json } else { text + &written })
}
