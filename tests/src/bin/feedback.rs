//! What a stiffness sensor is worth, effect by effect, and what its failures do: `cargo feedback`.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow};
use clap::Parser;
use end_to_end::campaign::aim::{self, Aim};
use end_to_end::closed_loop::{effects, failing, tables};
use model::{Amplifier, Approach, Compensation, Feedback, Settings};

/// Run the controller around springs with hidden effects, with a stiffness sensor and without.
///
/// Exit codes: 0 success, 1 an aim was not met or the work failed, 2 bad arguments.
#[derive(Parser)]
#[command(name = "cargo feedback", bin_name = "cargo feedback")]
struct Cli {
    /// Springs of each effect
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Where the seeds start: another number, other springs
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(..1_000_000))]
    first_seed: u64,
    /// Write the tables to this file
    #[arg(long, value_name = "FILE")]
    docs: Option<PathBuf>,
}

fn main() -> ExitCode {
    aim::exit_code(run(&Cli::parse()))
}

/// True if every aim was met.
fn run(cli: &Cli) -> Result<bool> {
    let feedback = Feedback::TYPICAL;
    let paper = Settings { feedback: Some(feedback), ..Settings::PAPER };
    let fast = Settings {
        compensation: Compensation::TimeOptimal(Approach::DEAD_BEAT),
        amplifier: Amplifier::up_to(1000.0),
        ..paper
    };
    let mut text = String::new();
    let mut aims: Vec<Aim> = Vec::new();
    for (name, settings) in [("The paper's controller at 700 V", paper), ("The fast controller at 1000 V", fast)] {
        let refused = |error| anyhow!("{name}: {error}");
        let outcomes = effects::all(&settings, cli.seeds, cli.first_seed).map_err(refused)?;
        write!(text, "## {name}\n\n{}\n", tables::effects(&outcomes))?;
        // At rest at 500 V, and in the middle of the step down from there.
        let consequences = failing::all(&settings, cli.first_seed, &[140.0, 150.2]).map_err(refused)?;
        write!(text, "### Its sensor fails for {} s\n\n{}\n", failing::FAILS_S, tables::failures(&consequences))?;
        aims.extend(tables::aims(name, &outcomes, feedback.noise_v));
    }
    text.push_str("## Asked for\n\n");
    aims.iter().try_for_each(|aim| writeln!(text, "- {aim}"))?;
    print!("{text}");
    if let Some(path) = &cli.docs {
        let page = format!("{}\n{text}", include_str!("feedback.md"));
        std::fs::write(path, page).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(aims.iter().all(Aim::is_met))
}
