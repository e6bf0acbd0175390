//! Hides effects in records and asks `vsj diagnose` for their names: `cargo campaign`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use validation::campaign::aim::{self, Aim};
use validation::campaign::ladder::{self, RUNGS};
use validation::campaign::part::{self, Job};
use validation::campaign::score::Outcome;
use validation::campaign::seam::diagnose;
use validation::campaign::{rivals, strangers, tables};
use validation::hidden::noise::{Kind, Noise};
use validation::hidden::record::Recipe;
use validation::hidden::strangers::Form;
use validation::hidden::{self, Cause, Hidden};

/// Hide effects in records of a simulated spring and ask `vsj diagnose` for their names.
///
/// The simulator shares no code with vsj. Every record comes from a seed; the same seeds make the same records, to the bit.
#[derive(Parser)]
#[command(
    name = "cargo campaign",
    bin_name = "cargo campaign",
    after_help = "\
Examples:
  cargo campaign                             singles, nulls, pairs, triples, small
  cargo campaign singles nulls --records 50  50 records of each cause and 50 nulls
  cargo campaign --first-seed 2 --docs docs/identification
  cargo campaign --write out/hidden --cause hysteresis --seed 3
  cargo campaign --write out/hidden --cause drift --cause hum --rows 600 --uneven
  cargo campaign rivals                      beside PySINDy and SysIdentPy
  RAYON_NUM_THREADS=1 cargo campaign speed   seconds by rows and noise, each record alone on the machine

Exit codes: 0 success, 1 an aim was not met or the work failed, 2 bad arguments."
)]
struct Cli {
    /// Parts to run
    #[arg(value_enum, default_values_t = [Part::Singles, Part::Nulls, Part::Pairs, Part::Triples, Part::Small])]
    parts: Vec<Part>,
    /// Records per cause (singles, forms, stress, small, noise, speed), per form (strangers), per pair, or in all (nulls,
    /// triples)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    records: Option<u32>,
    /// Where the seeds start: another number, other records
    #[arg(long, default_value_t = 1, value_name = "N")]
    first_seed: u64,
    /// One JSON object on stdout, every record in it
    #[arg(long)]
    json: bool,
    /// Write the tables to this folder, one Markdown file a part
    #[arg(long, value_name = "DIR")]
    docs: Option<PathBuf>,
    /// Diagnose nothing; write one record as CSV, and the truth about it as JSON
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
    #[command(flatten)]
    record: Wanted,
}

/// The record to write.
#[derive(clap::Args)]
struct Wanted {
    /// What to hide in the record; may be repeated, without it nothing is hidden. Of strangers, only the forms of these
    #[arg(long, value_name = "CAUSE", value_parser = cause)]
    cause: Vec<Cause>,
    /// The record's seed
    #[arg(long, default_value_t = 1, value_name = "N", requires = "write")]
    seed: u64,
    /// Size of the effects, 1 is plain to see
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "write", value_parser = size)]
    size: f64,
    /// Kind of noise
    #[arg(long, default_value = "white", requires = "write")]
    noise: NoiseKind,
    /// Strength of the noise in percent of 500 V
    #[arg(long, default_value_t = 0.2, value_name = "PERCENT", requires = "write", value_parser = positive)]
    noise_percent: f64,
    /// Number of rows
    #[arg(long, default_value_t = 2401, value_name = "N", requires = "write", value_parser = clap::value_parser!(u32).range(10..))]
    rows: u32,
    /// Steps of time that differ, rows that are missing
    #[arg(long, requires = "write")]
    uneven: bool,
    /// A form of the effect that is not the plain one
    #[arg(long, requires = "write")]
    other_form: bool,
    /// Instead, a stranger by the name of its form, in white noise of 0.2 %: "output resistance"
    #[arg(long, value_name = "NAME", requires = "write", value_parser = stranger, conflicts_with_all = ["cause", "size", "rows"])]
    stranger: Option<Form>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// One effect, plain to see: 20 records of each cause
    Singles,
    /// The same in other physical forms: 20 of each
    Forms,
    /// No effect; white, coloured, heavy-tailed noise: 500
    Nulls,
    /// Two effects of different blocks: 3 of every pair
    Pairs,
    /// Three effects of different blocks: 100
    Triples,
    /// Two effects in records of 20 000 rows, white and coloured noise: 1 of every pair
    Long,
    /// One effect in short, uneven, coloured, heavy-tailed, noisy records: 5 of each cause
    Stress,
    /// How small an effect may be: 20 of each cause and size
    Small,
    /// The same at 0.1, 0.2, 0.5 and 1 % noise
    Noise,
    /// Seconds of a processor for 2401 to 100 000 rows, in white and coloured noise: one record of each cause
    Speed,
    /// One effect by laws that the diagnosis was not made with: 5 of each
    Strangers,
    /// Beside PySINDy and SysIdentPy: one record of each cause, and one of none
    Rivals,
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

fn stranger(name: &str) -> Result<Form, String> {
    let forms = hidden::strangers::all();
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

/// What a part says.
struct Done {
    part: Part,
    markdown: String,
    wrong: String,
    aims: Vec<Aim>,
    json: Value,
}

fn main() -> ExitCode {
    // `cargo campaign -- singles` is meant as `cargo campaign singles`.
    let arguments = std::env::args().enumerate().filter(|(index, text)| !(*index == 1 && text == "--"));
    let cli = Cli::parse_from(arguments.map(|(_, text)| text));
    let picks = cli.write.is_some() || cli.parts.iter().all(|part| *part == Part::Strangers);
    if !cli.record.cause.is_empty() && !picks {
        let told = "--cause: expected --write, or strangers as the only part";
        Cli::command().error(ErrorKind::ArgumentConflict, told).exit();
    }
    aim::exit_code(run(&cli))
}

/// True if every aim was met.
fn run(cli: &Cli) -> Result<bool> {
    if let Some(folder) = &cli.write {
        return write(folder, &cli.record).map(|()| true);
    }
    let mut done: Vec<Done> = Vec::new();
    for &part in &cli.parts {
        let result = cli.part(part)?;
        if let Some(folder) = &cli.docs {
            result.write(folder)?;
        }
        if !cli.json {
            print!("## {:?}\n\n{}\n{}", part, result.markdown, result.wrong);
            result.aims.iter().for_each(|aim| println!("- {aim}"));
            println!();
        }
        done.push(result);
    }
    if cli.json {
        let parts: serde_json::Map<_, _> =
            done.iter().map(|done| (format!("{:?}", done.part).to_lowercase(), done.json.clone())).collect();
        println!("{}", Value::Object(parts));
    }
    Ok(done.iter().flat_map(|done| &done.aims).all(Aim::is_met))
}

impl Cli {
    fn count(&self, default: usize) -> usize {
        self.records.map_or(default, |records| records as usize)
    }

    fn part(&self, part: Part) -> Result<Done> {
        let first = self.first_seed;
        match part {
            Part::Singles => self.jobs(part, &part::singles(first, self.count(20)), aim::singles),
            Part::Forms => self.jobs(part, &part::forms(first, self.count(20)), |_| Vec::new()),
            Part::Nulls => self.jobs(part, &part::nulls(first, self.count(500)), aim::nulls),
            Part::Pairs => self.jobs(part, &part::pairs(first, self.count(3)), aim::pairs),
            Part::Triples => self.jobs(part, &part::triples(first, self.count(100)), aim::triples),
            Part::Long => self.jobs(part, &part::long(first, self.count(1)), aim::pairs),
            Part::Stress => self.jobs(part, &part::stress(first, self.count(5)), |_| Vec::new()),
            Part::Speed => self.jobs(part, &part::speed(first, self.count(1)), |_| Vec::new()),
            Part::Small => self.climbs(part, &[0.2]),
            Part::Noise => self.climbs(part, &[0.1, 0.2, 0.5, 1.0]),
            Part::Strangers => {
                let (mut forms, causes) = (hidden::strangers::all(), &self.record.cause);
                let mut jobs = strangers::jobs(&forms, first, self.count(5));
                if !causes.is_empty() {
                    forms.retain(|form| causes.contains(&form.cause));
                    jobs.retain(|(form, _)| causes.contains(&form.cause));
                }
                let bar = bar("strangers", jobs.len())?;
                let answers = strangers::run(&jobs, &diagnose, &bar)?;
                bar.finish_and_clear();
                let (markdown, wrong) = (strangers::page(&forms, &answers), strangers::wrong(&forms, &answers));
                Ok(Done { part, markdown, wrong, aims: Vec::new(), json: json!(answers) })
            }
            Part::Rivals => {
                let bar = bar("rivals", rivals::RECORDS)?;
                let rows = rivals::run(first, &bar)?;
                bar.finish_and_clear();
                let markdown = rivals::table(&rows);
                Ok(Done { part, markdown, wrong: String::new(), aims: Vec::new(), json: json!(rows) })
            }
        }
    }

    fn jobs(&self, part: Part, jobs: &[Job], aims: fn(&[Outcome]) -> Vec<Aim>) -> Result<Done> {
        let bar = bar(&format!("{part:?}"), jobs.len())?;
        let outcomes = part::run(jobs, &diagnose, &bar);
        bar.finish_and_clear();
        // A report that never comes is a fault of the set-up, not of the diagnosis.
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
        let aims = aims(&outcomes);
        let json = json!({"aims": aims, "records": outcomes});
        Ok(Done { part, markdown, wrong, aims, json })
    }

    fn climbs(&self, part: Part, levels: &[f64]) -> Result<Done> {
        let count = self.count(20);
        // As many as there may be: most climbs end on the first rungs.
        let bar = bar(&format!("{part:?}, at most"), levels.len() * Cause::ALL.len() * RUNGS.len() * count)?;
        let each = levels.iter().flat_map(|&level| Cause::ALL.map(|cause| (level, cause)));
        let climbs: Vec<_> =
            each.map(|(level, cause)| ladder::climb(cause, level, self.first_seed, count, &diagnose, &bar)).collect();
        bar.finish_and_clear();
        let small = part == Part::Small;
        let markdown = if small { tables::ladder(&climbs) } else { tables::noise(&climbs) };
        let aims = if small { aim::small(&climbs) } else { Vec::new() };
        let json = json!({"aims": aims, "climbs": climbs});
        Ok(Done { part, markdown, wrong: String::new(), aims, json })
    }
}

impl Done {
    fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let name = format!("{:?}", self.part).to_lowercase();
        let path = folder.join(format!("{name}.md"));
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let mut text =
            format!("# {:?}\n\nPrinted by `cargo campaign {}`.\n\n{}", self.part, arguments.join(" "), self.markdown);
        if !self.aims.is_empty() {
            text.push('\n');
            self.aims.iter().try_for_each(|aim| writeln!(text, "- {aim}"))?;
        }
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}

fn bar(what: &str, length: usize) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos} of {len}, {elapsed}, {eta} to go")?;
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
    let (what, hidden): (String, Hidden) = match wanted.stranger {
        Some(form) => (form.name.replace(' ', "-"), form.draw(wanted.seed)),
        None => {
            let hidden = recipe.draw(wanted.seed).at(wanted.size);
            let names: Vec<_> = hidden.effects.iter().map(|effect| effect.cause.name()).collect();
            (if names.is_empty() { "nothing".to_owned() } else { names.join("+") }, hidden)
        }
    };
    for path in hidden.write(folder, &format!("{what}-{}", wanted.seed))? {
        println!("wrote {}", path.display());
    }
    Ok(())
}
