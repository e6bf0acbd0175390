//! `vsj bound`: how fast any controller can be that knows the spring only to within errors.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::bound::text;
use host_sim::output::terminal::{json, print};
use model::Amplifier;
use simulation::bad_input;
use simulation::option_names::{SETTINGS, named};
use simulation::robust_bound::{Allowed, Question, answer};

use super::identified::{LARGEST, errors_with_small_shares};
use super::plant;
use super::spring_error::ErrorOf;

/// Compute how fast any controller without a sensor can be on a spring that is known only to within errors, and how well the spring has
/// to be known
///
/// One voltage has to bring the nominal spring and those at all ends of the errors to 97 % of each step, and keep them there, without
/// more overshoot than is allowed. A linear programme finds the shortest time. The steps are those of `vsj compare`: 100 V, smaller where
/// the spring's own range is too small for them.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj bound                        how well the spring has to be known for 0.6 s
  vsj bound --spring-error tau=5   with a time constant known to 5 %
  vsj bound --spring-error tau=2 --spring-error gain=1 --limit-v 700
  vsj bound --plant spring/plant.toml --identified identified.json")]
pub(crate) struct Arguments {
    /// The spring: `paper`, or a plant file of at most 1 MiB with shares and time constants only
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 1000.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// Slew limit of the amplifier, in V/s; default: none
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// `tau`, `gain` or `share` is known to within this, both ways, 0 to 90 %; repeatable
    #[arg(long, value_name = "KEY=PERCENT", allow_hyphen_values = true)]
    spring_error: Vec<ErrorOf>,
    /// The errors are the 95 % intervals of this file, what `vsj identify --json` prints; at most 16 MiB
    #[arg(long, value_name = "FILE.json", conflicts_with = "spring_error")]
    identified: Option<PathBuf>,
    /// Largest overshoot allowed, in percent of the step
    #[arg(long, default_value_t = 2.0, value_name = "PERCENT", allow_negative_numbers = true)]
    overshoot_percent: f64,
    /// Time in which each step has to be done, in s, for how well the spring has to be known
    #[arg(long, default_value_t = 0.6, value_name = "S", allow_negative_numbers = true)]
    within_s: f64,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { limit_v, slew_v_per_s, overshoot_percent, within_s, .. } = *arguments;
    if !(0.0..=100.0).contains(&overshoot_percent) {
        bad_input!("--overshoot-percent {overshoot_percent}: expected 0 to 100");
    }
    if !(within_s.is_finite() && within_s > 0.0) {
        bad_input!("--within-s {within_s}: expected a number above 0");
    }
    let (given, identified) = (&arguments.spring_error, arguments.identified.as_deref());
    let spring_error = errors_with_small_shares("--spring-error", given, identified, LARGEST)?;
    let file = plant::load(&arguments.plant)?;
    let amplifier = file.behind(Amplifier { slew_v_per_s, ..Amplifier::up_to(limit_v) });
    plant::remark_on_stair(&arguments.plant, &file, &[amplifier]);
    let allowed = Allowed { amplifier, overshoot: overshoot_percent / 100.0 };
    let answer =
        answer(&file, &Question { allowed, spring_error, within_s }).map_err(|error| named(error, SETTINGS))?;
    print(&if arguments.json { json(&answer)? } else { text(&answer) })
}
