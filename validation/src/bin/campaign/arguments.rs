//! The arguments of `cargo campaign`.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use validation::ground_truth::noise::Kind;
use validation::ground_truth::out_of_model::form::Form;
use validation::ground_truth::{self, Cause};

/// Diagnose simulated records with known effects and count the causes that `vsj diagnose` names.
///
/// The simulator shares no code with the diagnosis. Every record is drawn from a seed; the same seeds give the same
/// records, to the bit.
#[derive(Parser)]
#[command(
    name = "cargo campaign",
    bin_name = "cargo campaign",
    after_help = "\
Examples:
  cargo campaign                             singles, nulls, pairs, triples, small
  cargo campaign singles nulls --records 50  50 records of each cause and 50 nulls
  cargo campaign --first-seed 2 --docs docs/identification
  cargo campaign singles --export out/singles    its records as files, for `python -m vsj.fleet`
  cargo campaign --write out/hidden --cause hysteresis --seed 3
  cargo campaign --write out/hidden --cause drift --cause hum --rows 600 --uneven
  cargo campaign unforeseen unseen           laws that the diagnosis does not have
  cargo campaign rivals                      comparison with PySINDy and SysIdentPy
  cargo campaign equation                    the same on records that nothing explains
  cargo campaign real FOLDER                 measured records: FOLDER/NAME.csv, with an optional NAME.toml
  cargo campaign instruments                 the same on simulated instruments in their own units
  cargo campaign isolation                   the fault isolation that runs in the tick
  RAYON_NUM_THREADS=1 cargo campaign speed   CPU time by rows and noise, one record at a time
  cargo thresholds                           every threshold at half and twice its value

Exit codes: 0 success, 1 a criterion is not met or the work failed, 2 bad arguments."
)]
#[command(args_conflicts_with_subcommands = true, subcommand_precedence_over_arg = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    /// Parts to run
    #[arg(value_enum, default_values_t = [Part::Singles, Part::Nulls, Part::Pairs, Part::Triples, Part::Small])]
    pub(crate) parts: Vec<Part>,
    /// Records per cause (singles, scales, plants, forms, stress, small, noise, speed), per form or law (out-of-model,
    /// unforeseen, unseen, equation), per pair (pairs, long), per pair and size (shared), per cause and experiment (steps), in each
    /// of two sets (plan), in total (nulls, triples), or times 55 (thresholds) or 455 (reliability)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) records: Option<u32>,
    /// First seed; another number gives other records
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub(crate) first_seed: u64,
    /// Print one JSON object with every record
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the tables to this folder, one Markdown file per part
    #[arg(long, value_name = "DIR")]
    pub(crate) docs: Option<PathBuf>,
    /// Do not diagnose; write the records of singles, forms, nulls, pairs, triples, long, stress and speed to DIR/ROW/seed-N.csv,
    /// where ROW is that of the part's table, and their true values to seed-N.json
    #[arg(long, value_name = "DIR", conflicts_with_all = ["json", "docs", "write"])]
    pub(crate) export: Option<PathBuf>,
    /// Do not diagnose; write one record as CSV and its true values as JSON
    #[arg(long, value_name = "DIR")]
    pub(crate) write: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) record: Wanted,
}

/// What has arguments of its own.
#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Identify and diagnose measured records: every FOLDER/NAME.csv, whose columns NAME.toml may name
    ///
    /// NAME.toml has a table [columns] with time, voltage and reading, each NAME:UNIT, and input; and `known`, a sentence. Without
    /// it the first three columns are time, voltage and reading.
    Real {
        /// Folder with the records
        folder: PathBuf,
        /// Without PySINDy and SysIdentPy
        #[arg(long)]
        no_python: bool,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Run the MCU's fault isolation on springs in which a fault begins: delays, names, false alarms, compared with recursive least
    /// squares
    Isolation(Isolation),
}

/// Options of the runs of the isolation bank.
#[derive(clap::Args)]
pub(crate) struct Isolation {
    /// Runs of each fault and size
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(crate) records: u64,
    /// First seed; another number gives other runs
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(..500_000))]
    pub(crate) first_seed: u64,
    /// Write the results to this page, in place of those that it has
    #[arg(long, value_name = "FILE")]
    pub(crate) docs: Option<PathBuf>,
}

/// Options of the record to write.
#[derive(clap::Args)]
pub(crate) struct Wanted {
    /// Cause in the record; repeatable, none by default. With out-of-model, only the forms of these causes
    #[arg(long, value_name = "CAUSE", value_parser = cause)]
    pub(crate) cause: Vec<Cause>,
    /// Seed of the record
    #[arg(long, default_value_t = 1, value_name = "N", requires = "write")]
    pub(crate) seed: u64,
    /// Size of the effects, from 0 for none to 1 for full size
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "write", value_parser = size)]
    pub(crate) size: f64,
    /// Kind of noise
    #[arg(long, default_value = "white", requires = "write")]
    pub(crate) noise: NoiseKind,
    /// Standard deviation of the noise in percent of 500 V
    #[arg(long, default_value_t = 0.2, value_name = "PERCENT", requires = "write", value_parser = positive)]
    pub(crate) noise_percent: f64,
    /// Number of rows
    #[arg(long, default_value_t = 2401, value_name = "N", requires = "write", value_parser = clap::value_parser!(u32).range(10..))]
    pub(crate) rows: u32,
    /// Uneven time steps and missing rows
    #[arg(long, requires = "write")]
    pub(crate) uneven: bool,
    /// Another physical form of the effect than the first
    #[arg(long, requires = "write")]
    pub(crate) other_form: bool,
    /// Instead, a form of the out-of-model test set by its name, such as "output resistance", in white noise of 0.2 %
    #[arg(
        long,
        alias = "stranger",
        value_name = "NAME",
        requires = "write",
        value_parser = form,
        conflicts_with_all = ["cause", "size", "rows"]
    )]
    pub(crate) out_of_model: Option<Form>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Part {
    /// One effect of full size: 20 records of each cause
    Singles,
    /// One effect in another physical form: 20 records of each cause
    Forms,
    /// No effect; white, coloured, heavy-tailed noise: 500 records
    Nulls,
    /// Two effects of different blocks: 3 records of every pair
    Pairs,
    /// Three effects of different blocks: 100 records
    Triples,
    /// Two effects of one block, or that mimic each other: 3 records of every pair at full size and at half of it
    Shared,
    /// Plain steps of one to three levels, with each cause that they can show: 3 records of each
    Steps,
    /// Two effects in records of 20 000 rows, white and coloured noise: 1 record of every pair
    Long,
    /// One effect in few rows, uneven rows, coloured, heavy-tailed or strong noise: 5 records of each cause
    Stress,
    /// Stated probabilities compared with frequencies, over all sets: 1 record of each case, 3 of each cause
    Reliability,
    /// Smallest effect that is named: 20 records of each cause and size
    Small,
    /// Smallest effect that is named at 0.1, 0.2, 0.5 and 1 % noise
    Noise,
    /// CPU time for 2401 to 100 000 rows, white and coloured noise: 1 record of each cause
    Speed,
    /// One effect by laws that the diagnosis does not model: 5 records of each
    #[value(alias = "strangers")]
    OutOfModel,
    /// Laws from the literature that nobody looked at while the diagnosis was made: 3 records of each
    Unforeseen,
    /// A second edition of unforeseen, whose author had not read the diagnosis: 3 records of each of its laws
    Unseen,
    /// One effect in a spring of any time constant, share, full scale and unit: 20 records of each cause
    Scales,
    /// One effect or none in a spring of one to three time constants, any scale, schedule and noise: 8 records of each cause
    Plants,
    /// Records of `plants` without a plant file: the linear spring is identified, and what it leaves is diagnosed
    Identified,
    /// Equations of unexplained records, compared with PySINDy and SysIdentPy: 1 record of each law of out-of-model and unforeseen
    Equation,
    /// Comparison with PySINDy and SysIdentPy: 1 record of each cause, and 1 without an effect
    Rivals,
    /// Six other instruments, simulated, in their own units
    Instruments,
    /// Minutes of the next experiment until the diagnosis is right, planned, fixed and random: 30 springs of each of two sets
    Plan,
    /// Every empirical threshold at half and twice its value: 55 records at each value. Run it as `cargo thresholds`
    Thresholds,
}

impl Part {
    /// Name on the command line and of the page.
    pub(crate) fn name(self) -> String {
        self.to_possible_value().expect("no part is skipped").get_name().to_owned()
    }

    /// Title of the page.
    pub(crate) fn title(self) -> String {
        if self == Self::OutOfModel { "Out of model".to_owned() } else { format!("{self:?}") }
    }

    /// Key in the JSON object.
    pub(crate) fn key(self) -> String {
        if self == Self::OutOfModel { "strangers".to_owned() } else { self.name() }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum NoiseKind {
    White,
    Coloured,
    OneOverF,
    HeavyTailed,
}

impl From<NoiseKind> for Kind {
    fn from(kind: NoiseKind) -> Self {
        match kind {
            NoiseKind::White => Self::White,
            NoiseKind::Coloured => Self::Coloured,
            NoiseKind::OneOverF => Self::OneOverF,
            NoiseKind::HeavyTailed => Self::HeavyTailed,
        }
    }
}

fn form(name: &str) -> Result<Form, String> {
    let forms = ground_truth::out_of_model::all();
    let names: Vec<&str> = forms.iter().map(|form| form.name).collect();
    forms.iter().find(|form| form.name == name).copied().ok_or_else(|| format!("expected one of: {}", names.join(", ")))
}

fn cause(name: &str) -> Result<Cause, String> {
    let names = || Cause::ALL.map(Cause::name).join(", ");
    Cause::named(name).ok_or_else(|| format!("expected one of {}", names()))
}

fn size(text: &str) -> Result<f64, String> {
    let size = text.parse().map_err(|_| "expected a number".to_owned())?;
    if (0.0..=1.0).contains(&size) { Ok(size) } else { Err("expected 0 to 1".to_owned()) }
}

fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if number > 0.0 && number <= 100.0 { Ok(number) } else { Err("expected above 0, at most 100".to_owned()) }
}
