//! `cargo campaign`: diagnoses simulated records with known effects and counts the causes that are named.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use validation::campaign::answer;
use validation::campaign::case::Case;
use validation::campaign::diagnosis::{self, diagnose};
use validation::campaign::part::{self, Job};
use validation::campaign::score::Outcome;
use validation::campaign::sensitivity::{self, SIZES};
use validation::campaign::unforeseen::Edition;
use validation::campaign::{
    answer_table, criteria, equation, identified, out_of_model, plan, plants, real, reliability, rivals, scales,
    shared, steps, tables,
};
use validation::criterion::{self, Criterion};
use validation::ground_truth::noise::{Kind, Noise};
use validation::ground_truth::out_of_model::form::Form;
use validation::ground_truth::record::Recipe;
use validation::ground_truth::{self, Cause, LabelledRecord};
use validation::isolation;

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
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Parts to run
    #[arg(value_enum, default_values_t = [Part::Singles, Part::Nulls, Part::Pairs, Part::Triples, Part::Small])]
    parts: Vec<Part>,
    /// Records per cause (singles, scales, plants, forms, stress, small, noise, speed), per form or law (out-of-model,
    /// unforeseen, unseen, equation), per pair (pairs, long), per pair and size (shared), per cause and experiment (steps), in each
    /// of two sets (plan), in total (nulls, triples), or times 55 (thresholds) or 455 (reliability)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    records: Option<u32>,
    /// First seed; another number gives other records
    #[arg(long, default_value_t = 1, value_name = "N")]
    first_seed: u64,
    /// Print one JSON object with every record
    #[arg(long)]
    json: bool,
    /// Write the tables to this folder, one Markdown file per part
    #[arg(long, value_name = "DIR")]
    docs: Option<PathBuf>,
    /// Do not diagnose; write the records of singles, forms, nulls, pairs, triples, long, stress and speed to DIR/ROW/seed-N.csv,
    /// where ROW is that of the part's table, and their true values to seed-N.json
    #[arg(long, value_name = "DIR", conflicts_with_all = ["json", "docs", "write"])]
    export: Option<PathBuf>,
    /// Do not diagnose; write one record as CSV and its true values as JSON
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
    #[command(flatten)]
    record: Wanted,
}

/// What has arguments of its own.
#[derive(clap::Subcommand)]
enum Command {
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
struct Isolation {
    /// Runs of each fault and size
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    records: u64,
    /// First seed; another number gives other runs
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(..500_000))]
    first_seed: u64,
    /// Write the results to this page, in place of those that it has
    #[arg(long, value_name = "FILE")]
    docs: Option<PathBuf>,
}

/// Options of the record to write.
#[derive(clap::Args)]
struct Wanted {
    /// Cause in the record; repeatable, none by default. With out-of-model, only the forms of these causes
    #[arg(long, value_name = "CAUSE", value_parser = cause)]
    cause: Vec<Cause>,
    /// Seed of the record
    #[arg(long, default_value_t = 1, value_name = "N", requires = "write")]
    seed: u64,
    /// Size of the effects, from 0 for none to 1 for full size
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "write", value_parser = size)]
    size: f64,
    /// Kind of noise
    #[arg(long, default_value = "white", requires = "write")]
    noise: NoiseKind,
    /// Standard deviation of the noise in percent of 500 V
    #[arg(long, default_value_t = 0.2, value_name = "PERCENT", requires = "write", value_parser = positive)]
    noise_percent: f64,
    /// Number of rows
    #[arg(long, default_value_t = 2401, value_name = "N", requires = "write", value_parser = clap::value_parser!(u32).range(10..))]
    rows: u32,
    /// Uneven time steps and missing rows
    #[arg(long, requires = "write")]
    uneven: bool,
    /// Another physical form of the effect than the first
    #[arg(long, requires = "write")]
    other_form: bool,
    /// Instead, a form of the out-of-model test set by its name, such as "output resistance", in white noise of 0.2 %
    #[arg(
        long,
        alias = "stranger",
        value_name = "NAME",
        requires = "write",
        value_parser = form,
        conflicts_with_all = ["cause", "size", "rows"]
    )]
    out_of_model: Option<Form>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
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
    /// The same records without a plant file: the linear spring is identified, and what it leaves is diagnosed
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
    fn name(self) -> String {
        self.to_possible_value().expect("no part is skipped").get_name().to_owned()
    }

    /// Title of the page.
    fn title(self) -> String {
        if self == Self::OutOfModel { "Out of model".to_owned() } else { format!("{self:?}") }
    }

    /// Key in the JSON object.
    fn key(self) -> String {
        if self == Self::OutOfModel { "strangers".to_owned() } else { self.name() }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NoiseKind {
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

/// Result of a part.
struct Done {
    part: Part,
    /// Text of the page.
    markdown: String,
    /// List of the records that are not diagnosed correctly, one line each, which is printed and not written.
    wrong: String,
    criteria: Vec<Criterion>,
    json: Value,
    /// Name and text of an SVG file next to the page.
    figure: Option<(&'static str, String)>,
}

fn main() -> ExitCode {
    // Accept `cargo campaign -- singles` as `cargo campaign singles`.
    let arguments = std::env::args().enumerate().filter(|(index, text)| !(*index == 1 && text == "--"));
    let cli = Cli::parse_from(arguments.map(|(_, text)| text));
    let picks = cli.write.is_some() || cli.parts.iter().all(|part| *part == Part::OutOfModel);
    if !cli.record.cause.is_empty() && !picks {
        let message = "--cause: expected --write, or out-of-model as the only part";
        Cli::command().error(ErrorKind::ArgumentConflict, message).exit();
    }
    criterion::exit_code(run(&cli))
}

/// True if every criterion is met.
fn run(cli: &Cli) -> Result<bool> {
    if let Some(Command::Real { folder, no_python, json }) = &cli.command {
        let (subjects, mut refused) = real::open(folder)?;
        let (rows, later) = measured("real", &subjects, !no_python)?;
        refused.extend(later);
        if *json {
            println!("{}", json!({ "real": rows, "refused": refused }));
        } else {
            print!("{}", real::table(&rows));
        }
        refused.iter().for_each(|record| eprintln!("{}: refused: {}", record.name, record.reason));
        return Ok(refused.is_empty());
    }
    if let Some(Command::Isolation(options)) = &cli.command {
        let text = isolation::page(options.first_seed, options.records)?;
        print!("{text}");
        if let Some(path) = &options.docs {
            let page = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
            // What is written by hand stays.
            let by_hand = page.split(isolation::TITLE).next().unwrap_or_default();
            std::fs::write(path, format!("{by_hand}{text}"))
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        return Ok(true);
    }
    if let Some(folder) = &cli.write {
        return write(folder, &cli.record).map(|()| true);
    }
    if let Some(folder) = &cli.export {
        return cli.export(folder).map(|()| true);
    }
    let mut done: Vec<Done> = Vec::new();
    for &part in &cli.parts {
        let result = cli.part(part)?;
        if let Some(folder) = &cli.docs {
            result.write(folder)?;
        }
        if !cli.json {
            print!("## {}\n\n{}\n{}", part.title(), result.markdown, result.wrong);
            result.criteria.iter().for_each(|criterion| println!("- {criterion}"));
            println!();
        }
        done.push(result);
    }
    if cli.json {
        let parts: serde_json::Map<_, _> = done.iter().map(|done| (done.part.key(), done.json.clone())).collect();
        println!("{}", Value::Object(parts));
    }
    Ok(done.iter().flat_map(|done| &done.criteria).all(Criterion::is_met))
}

impl Cli {
    fn count(&self, default: usize) -> usize {
        self.records.map_or(default, |records| records as usize)
    }

    fn part(&self, part: Part) -> Result<Done> {
        let first = self.first_seed;
        match part {
            Part::Singles => self.jobs(part, criteria::singles),
            Part::Nulls => self.jobs(part, criteria::nulls),
            Part::Pairs | Part::Long => self.jobs(part, criteria::pairs),
            Part::Triples => self.jobs(part, criteria::triples),
            Part::Forms | Part::Stress | Part::Speed => self.jobs(part, |_| Vec::new()),
            Part::Shared => self.answers(part, &["causes", "size"], &shared::cases(first, self.count(3))),
            Part::Steps => self.answers(part, &["causes", "experiment"], &steps::cases(first, self.count(3))),
            Part::Plants | Part::Identified => {
                let cases = if part == Part::Plants { plants::cases } else { identified::cases };
                let cases = cases(first, self.count(8));
                self.answers(part, &["cause", "schedule", "noise", "time constants"], &cases)
            }
            Part::Reliability => {
                let mut sets = Vec::new();
                for (name, cases) in reliability::sets(first, self.count(1)) {
                    let bar = bar(name, cases.len())?;
                    sets.push((name, answer::run(&cases, &diagnosis::answer, &bar)));
                    bar.finish_and_clear();
                }
                let markdown = reliability::page(&sets);
                let figure = Some(("reliability.svg", reliability::figure(&sets)));
                Ok(Done { figure, ..Done::new(part, markdown, json!(sets)) })
            }
            Part::Unforeseen => self.answers(part, &["law"], &Edition::First.cases(first, self.count(3))),
            Part::Unseen => self.answers(part, &["law"], &Edition::Second.cases(first, self.count(3))),
            Part::Small => self.sensitivities(part, &[0.2]),
            Part::Noise => self.sensitivities(part, &[0.1, 0.2, 0.5, 1.0]),
            Part::OutOfModel => {
                let (mut forms, causes) = (ground_truth::out_of_model::all(), &self.record.cause);
                let mut jobs = out_of_model::jobs(&forms, first, self.count(5));
                if !causes.is_empty() {
                    forms.retain(|form| causes.contains(&form.cause));
                    jobs.retain(|(form, _)| causes.contains(&form.cause));
                }
                let bar = bar("out-of-model", jobs.len())?;
                let answers = out_of_model::run(&jobs, &diagnose, &bar)?;
                bar.finish_and_clear();
                let (markdown, wrong) = (out_of_model::page(&forms, &answers), out_of_model::wrong(&forms, &answers));
                Ok(Done { wrong, ..Done::new(part, markdown, json!(answers)) })
            }
            Part::Scales => {
                let jobs = scales::jobs(first, self.count(20));
                let bar = bar("scales", jobs.len())?;
                let outcomes = scales::run(&jobs, &bar);
                bar.finish_and_clear();
                let (markdown, wrong) = (tables::named("cause", &jobs, &outcomes), tables::wrong(&jobs, &outcomes));
                Ok(Done { wrong, ..Done::new(part, markdown, json!({"records": outcomes})) })
            }
            Part::Equation => {
                let cases = equation::cases(first, self.count(1));
                let bar = bar("equation", cases.len())?;
                let rows = equation::run(&cases, true, &bar)?;
                bar.finish_and_clear();
                let markdown = equation::page(&rows);
                Ok(Done::new(part, markdown, json!(rows)))
            }
            Part::Rivals => {
                let bar = bar("rivals", rivals::RECORDS)?;
                let rows = rivals::run(first, &bar)?;
                bar.finish_and_clear();
                let markdown = rivals::table(&rows);
                Ok(Done::new(part, markdown, json!(rows)))
            }
            Part::Instruments => {
                let (rows, refused) = measured("instruments", &real::twins(first), true)?;
                if let Some(record) = refused.first() {
                    bail!("{}: {}", record.name, record.reason);
                }
                let markdown = real::table(&rows);
                Ok(Done::new(part, markdown, json!(rows)))
            }
            Part::Plan => {
                let cases = plan::cases(&ground_truth::out_of_model::all(), first, self.count(30));
                let bar = bar("plan", cases.len())?;
                let outcomes = plan::run(&cases, &bar)?;
                bar.finish_and_clear();
                let markdown = plan::page(&outcomes);
                Ok(Done::new(part, markdown, json!(outcomes)))
            }
            #[cfg(not(feature = "sensitivity"))]
            Part::Thresholds => bail!("thresholds: expected the feature `sensitivity`; run `cargo thresholds`"),
            #[cfg(feature = "sensitivity")]
            Part::Thresholds => {
                use validation::campaign::thresholds;

                let cases = thresholds::cases(first, self.count(1));
                let bar = bar("thresholds", thresholds::diagnoses(&cases))?;
                let (as_set, rows) = thresholds::run(&cases, diagnosis::vary, &diagnose, &bar)?;
                bar.finish_and_clear();
                let markdown = thresholds::page(&cases, &as_set, &rows);
                Ok(Done::new(part, markdown, json!({"as_set": as_set, "thresholds": rows})))
            }
        }
    }

    /// The records of a part that draws every one from a recipe.
    fn recipes(&self, part: Part) -> Result<Vec<Job>> {
        let first = self.first_seed;
        Ok(match part {
            Part::Singles => part::singles(first, self.count(20)),
            Part::Forms => part::forms(first, self.count(20)),
            Part::Nulls => part::nulls(first, self.count(500)),
            Part::Pairs => part::pairs(first, self.count(3)),
            Part::Triples => part::triples(first, self.count(100)),
            Part::Long => part::long(first, self.count(1)),
            Part::Stress => part::stress(first, self.count(5)),
            Part::Speed => part::speed(first, self.count(1)),
            _ => bail!("{}: expected singles, forms, nulls, pairs, triples, long, stress or speed", part.name()),
        })
    }

    /// Writes the records of the parts as files, with their true values.
    fn export(&self, folder: &Path) -> Result<()> {
        let parts = self.parts.iter().map(|&part| Ok((part, self.recipes(part)?))).collect::<Result<Vec<_>>>()?;
        for (part, jobs) in parts {
            for Job { group, recipe, seed } in &jobs {
                recipe.draw(*seed).write(&folder.join(group), &format!("seed-{seed}"))?;
            }
            println!("wrote {} records of {} to {}", jobs.len(), part.name(), folder.display());
        }
        Ok(())
    }

    fn jobs(&self, part: Part, criteria: fn(&[Outcome]) -> Vec<Criterion>) -> Result<Done> {
        let jobs = &self.recipes(part)?;
        let bar = bar(&format!("{part:?}"), jobs.len())?;
        let outcomes = part::run(jobs, &diagnose, &bar);
        bar.finish_and_clear();
        // If every record fails, the set-up is at fault, not the diagnosis.
        if let Some(failure) = outcomes.iter().find_map(|outcome| outcome.failure.as_ref())
            && outcomes.iter().all(|outcome| outcome.failure.is_some())
        {
            bail!("no record was diagnosed: {failure}");
        }
        let what = match part {
            Part::Nulls | Part::Long => "noise",
            Part::Pairs | Part::Triples => "blocks",
            Part::Stress => "record",
            _ => "cause",
        };
        let mut markdown =
            if part == Part::Speed { tables::speed(jobs, &outcomes) } else { tables::named(what, jobs, &outcomes) };
        if matches!(part, Part::Singles | Part::Pairs | Part::Triples) {
            write!(markdown, "\n{}", tables::accuracy(&outcomes))?;
        }
        if part == Part::Singles {
            write!(markdown, "\n{}", tables::confusion(&outcomes))?;
        }
        let wrong = tables::wrong(jobs, &outcomes);
        let criteria = criteria(&outcomes);
        let json = json!({"aims": criteria, "records": outcomes});
        Ok(Done { wrong, criteria, ..Done::new(part, markdown, json) })
    }

    /// Diagnoses cases and grades the answers; `heads` are those of the tables' first columns.
    fn answers(&self, part: Part, heads: &[&str], cases: &[Case]) -> Result<Done> {
        let bar = bar(&part.name(), cases.len())?;
        let answers = answer::run(cases, &diagnosis::answer, &bar);
        bar.finish_and_clear();
        let markdown = match part {
            Part::Unforeseen => Edition::First.page(&answers),
            Part::Unseen => Edition::Second.page(&answers),
            _ => format!("{}\n{}", answer_table::legend(), answer_table::page(heads[0], &heads[1..], &answers)),
        };
        let wrong = answer_table::wrong(&answers);
        Ok(Done { wrong, ..Done::new(part, markdown, json!({"records": answers})) })
    }

    fn sensitivities(&self, part: Part, levels: &[f64]) -> Result<Done> {
        let count = self.count(20);
        // The largest possible number: most searches end at the first sizes.
        let bar = bar(&format!("{part:?}, at most"), levels.len() * Cause::ALL.len() * SIZES.len() * count)?;
        let each = levels.iter().flat_map(|&level| Cause::ALL.map(|cause| (level, cause)));
        let found: Vec<_> = each
            .map(|(level, cause)| sensitivity::measure(cause, level, self.first_seed, count, &diagnose, &bar))
            .collect();
        bar.finish_and_clear();
        let small = part == Part::Small;
        let markdown = if small { tables::sensitivity(&found) } else { tables::noise(&found) };
        let criteria = if small { criteria::small(&found) } else { Vec::new() };
        let json = json!({"aims": criteria, "climbs": found});
        Ok(Done { criteria, ..Done::new(part, markdown, json) })
    }
}

impl Done {
    /// A page without anything else.
    fn new(part: Part, markdown: String, json: Value) -> Self {
        Self { part, markdown, wrong: String::new(), criteria: Vec::new(), json, figure: None }
    }

    fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let path = folder.join(format!("{}.md", self.part.name()));
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let (title, command) = (self.part.title(), arguments.join(" "));
        // `cargo thresholds` runs this program with the feature that the part needs.
        let alias = if self.part == Part::Thresholds { "cargo" } else { "cargo campaign" };
        let mut text = format!("# {title}\n\nPrinted by `{alias} {command}`.\n\n{}", self.markdown);
        if !self.criteria.is_empty() {
            text.push('\n');
            self.criteria.iter().try_for_each(|criterion| writeln!(text, "- {criterion}"))?;
        }
        let files = [(path, &text)].into_iter().chain(self.figure.iter().map(|(name, svg)| (folder.join(name), svg)));
        for (path, text) in files {
            std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(())
    }
}

/// Results of records with their own units; with `python`, also of the other tools.
fn measured(what: &str, subjects: &[real::Subject], python: bool) -> Result<(Vec<real::Row>, Vec<real::Refused>)> {
    let bar = bar(what, subjects.len())?;
    let measured = real::run(subjects, python, &bar)?;
    bar.finish_and_clear();
    Ok(measured)
}

fn bar(what: &str, length: usize) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos} of {len}, {elapsed}, {eta} left")?;
    Ok(ProgressBar::new(length as u64).with_style(style).with_message(what.to_owned()))
}

fn write(folder: &Path, wanted: &Wanted) -> Result<()> {
    let mut causes = wanted.cause.clone();
    causes.sort_unstable();
    causes.dedup();
    let recipe = Recipe {
        causes,
        other_forms: wanted.other_form,
        noise: Noise::white(wanted.noise_percent).of(wanted.noise.into()),
        rows: wanted.rows as usize,
        uneven: wanted.uneven,
    };
    let (name, record): (String, LabelledRecord) = match wanted.out_of_model {
        Some(form) => (form.name.replace(' ', "-"), form.draw(wanted.seed)),
        None => {
            let record = recipe.draw(wanted.seed).at(wanted.size);
            let names: Vec<_> = record.effects.iter().map(|effect| effect.cause.name()).collect();
            (if names.is_empty() { "nothing".to_owned() } else { names.join("+") }, record)
        }
    };
    for path in record.write(folder, &format!("{name}-{}", wanted.seed))? {
        println!("wrote {}", path.display());
    }
    Ok(())
}
