//! `cargo xtask bench`: ns per sample of the closed loop, and CPU time of identifications and diagnoses, compared with Python and C; time of
//! a fleet with one worker and with two.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use xtask::{python, shell};

use crate::{bench_fleet, bench_records, package};

/// Samples in one run of a contender: 70 s at 1 kHz and the one at 0 s, as in `rivals.py` and the Rust bench.
const SAMPLES: u32 = 70_001;
/// Python and Rust are measured in turns, because a machine's speed changes within minutes.
const ROUNDS: usize = 3;
const BENCH: &str = "closed_loop";

/// What the contenders of a part of the table compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    /// The linear loop in floating point: no limits, no DAC codes.
    Linear,
    /// The whole tick: range, slew, DAC codes that the estimator sees, an integrator that follows the voltage.
    Tick,
}

struct Contender {
    /// Key in the output of `rivals.py`, or id in the Rust bench.
    name: &'static str,
    what: &'static str,
    work: Work,
    source: Source,
    /// Highest time that is accepted, as a multiple of that of the fastest rival with the same work.
    bound: Option<f64>,
}

/// Where a time comes from, and whether it is one of a rival.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// `rivals.py`: a rival that others are compared with.
    Rival,
    /// `rivals.py`.
    Python,
    /// The Rust bench.
    Rust,
}

impl Source {
    const fn is_rust(self) -> bool {
        matches!(self, Self::Rust)
    }
}

const fn row(name: &'static str, what: &'static str, work: Work, source: Source, bound: Option<f64>) -> Contender {
    Contender { name, what, work, source, bound }
}

/// The contender in C, which needs a compiler.
const C: &str = "c_tick";
const CONTENDERS: [Contender; 12] = [
    row("lsim", "scipy.signal.lsim", Work::Linear, Source::Python, None),
    row("numpy", "NumPy, a loop in Python", Work::Linear, Source::Python, None),
    row("lfilter", "scipy.signal.lfilter", Work::Linear, Source::Python, None),
    row("numba", "numba", Work::Linear, Source::Rival, None),
    row("reference_f64", "Rust, f64 reference", Work::Linear, Source::Rust, Some(0.7)),
    row("numba_tick", "numba, float64", Work::Tick, Source::Rival, None),
    row(C, "C, cc -O3 -march=native, float64", Work::Tick, Source::Rival, None),
    row("controller", "vsj.Controller, the tick in Python", Work::Tick, Source::Python, None),
    row("fixed_tick", "Rust, the MCU's fixed-point tick", Work::Tick, Source::Rust, Some(1.0)),
    row("isolation_tick", "the same and the isolation bank", Work::Tick, Source::Rust, None),
    row("fast_tick", "with the fast controller", Work::Tick, Source::Rust, None),
    row("robust_tick", "with the robust controller", Work::Tick, Source::Rust, None),
];

/// Options of `cargo xtask bench`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Print the tables as JSON
    #[arg(long)]
    json: bool,
    /// Measure one part only
    #[arg(long, value_enum)]
    only: Option<Part>,
    /// Number of records of the fleet
    #[arg(long, value_name = "N", default_value_t = 240, value_parser = clap::value_parser!(u32).range(1..))]
    fleet_records: u32,
}

/// One of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// The closed loop.
    ClosedLoop,
    /// Identification and diagnosis of records.
    Records,
    /// A fleet of records with one worker and with two.
    Fleet,
}

/// One line of the table.
struct Row {
    contender: &'static Contender,
    /// `None` if it could not be run.
    ns: Option<f64>,
    /// Ratio to the fastest rival with the same work.
    to_rival: Option<f64>,
    /// Mean number of instructions on the emulated MCU.
    instructions: Option<u64>,
}

impl Row {
    fn within_bound(&self) -> bool {
        self.contender.bound.zip(self.to_rival).is_none_or(|(bound, to_rival)| to_rival <= bound)
    }
}

/// Time of each contender in ns per sample, in the order of [`CONTENDERS`].
type Times = [Option<f64>; CONTENDERS.len()];

/// Measures every contender and prints the tables. A time above its bound is marked and is no error.
pub(crate) fn run(args: &Args) -> Result<()> {
    let target = shell::target_directory()?;
    let wants = |part: Part| args.only.is_none_or(|only| only == part);
    if wants(Part::ClosedLoop) {
        find_bench(&shell::metadata()?)?;
    }
    let python = || python::environment(&target, "bench", "xtask/bench/requirements.txt");
    let closed_loop = wants(Part::ClosedLoop).then(|| closed_loop(&python()?, &target)).transpose()?;
    let records = wants(Part::Records).then(|| bench_records::measure(&python()?, &target)).transpose()?;
    let fleet = wants(Part::Fleet).then(|| bench_fleet::measure(&target, args.fleet_records)).transpose()?;
    if args.json {
        let mut report = report(closed_loop.as_deref().unwrap_or_default());
        report["records"] = records.unwrap_or_default();
        report["fleet"] = fleet.unwrap_or_default();
        println!("{report}");
        return Ok(());
    }
    let closed_loop = closed_loop.map(|rows| table(&rows));
    let records = records.map(|records| bench_records::table(&records)).transpose()?;
    let fleet = fleet.map(|fleet| bench_fleet::table(&fleet)).transpose()?;
    print!("{}", closed_loop.into_iter().chain(records).chain(fleet).collect::<Vec<String>>().join("\n"));
    Ok(())
}

/// The table of the closed loop.
fn closed_loop(python: &Path, target: &Path) -> Result<Vec<Row>> {
    package::install(python, target, package::RELEASE)?;
    shell::run(cargo_bench().arg("--no-run"))?;
    let in_c = in_c(target)?;
    let mut rounds = Vec::new();
    for round in 1..=ROUNDS {
        eprintln!("round {round} of {ROUNDS}");
        rounds.push(measure(python, target, in_c.as_deref())?);
    }
    Ok(rows(&rounds, &instructions()))
}

/// Compiles the loop in C into a shared library; `None` without a compiler.
fn in_c(target: &Path) -> Result<Option<PathBuf>> {
    let library = target.join("bench-tick.so");
    let mut compile = shell::command("cc");
    compile.args(["-O3", "-march=native", "-shared", "-fPIC", "xtask/bench/tick.c", "-o"]).arg(&library);
    match compile.status() {
        Ok(status) if status.success() => Ok(Some(library)),
        Ok(status) => bail!("cc -O3 -march=native xtask/bench/tick.c failed ({status})"),
        Err(error) => {
            eprintln!("no time for C: cc does not start ({error})");
            Ok(None)
        }
    }
}

/// Mean instructions per tick on the emulated MCU, by contender; none if the emulator cannot be had.
fn instructions() -> Vec<(&'static str, u64)> {
    let emulated = |option: &str| {
        shell::json(shell::cargo().args([
            "run",
            "--quiet",
            "--package",
            "emulation",
            "--",
            "emulate",
            "--json",
            option,
        ]))
    };
    let (blocks, bank) = match (emulated("--blocks"), emulated("--isolation")) {
        (Ok(blocks), Ok(bank)) => (blocks, bank),
        (blocks, bank) => {
            let error = blocks.and(bank).expect_err("one has failed");
            eprintln!("no instructions of the MCU: {error:#}");
            return Vec::new();
        }
    };
    let plain = |controller: &str| {
        let rows = blocks["rows"].as_array().into_iter().flatten();
        rows.filter(|row| row["spring"] == "plain" && row["controller"] == controller)
            .find_map(|row| row["mean"].as_u64())
    };
    let paper = plain("paper");
    let with_bank = paper.zip(bank["instructions_per_tick"]["mean"].as_u64()).map(|(tick, bank)| tick + bank);
    let all = [
        ("fixed_tick", paper),
        ("isolation_tick", with_bank),
        ("fast_tick", plain("fast")),
        ("robust_tick", plain("robust")),
    ];
    all.into_iter().filter_map(|(name, count)| Some((name, count?))).collect()
}

/// One round. `in_c` is the library of the loop in C.
fn measure(python: &Path, target: &Path, in_c: Option<&Path>) -> Result<Times> {
    let rivals = shell::json(shell::command(python).arg("xtask/bench/rivals.py").args(in_c))?;
    let criterion = target.join("criterion").join(BENCH);
    let estimates = |name: &str| criterion.join(name).join("new/estimates.json");
    // Otherwise results of an earlier run could be read as this one's.
    for contender in CONTENDERS.iter().filter(|c| c.source.is_rust()) {
        let _ = fs::remove_file(estimates(contender.name));
    }
    shell::run(&mut cargo_bench())?;

    let mut times = [None; CONTENDERS.len()];
    for (time, contender) in times.iter_mut().zip(&CONTENDERS) {
        let name = contender.name;
        *time = if contender.source.is_rust() {
            let path = estimates(name);
            let text = fs::read_to_string(&path).with_context(|| {
                format!("bench `{BENCH}` left no {}: does it have the id `{name}`?", path.display())
            })?;
            let estimates: Value = serde_json::from_str(&text)?;
            estimates["median"]["point_estimate"].as_f64().map(|ns| ns / f64::from(SAMPLES))
        } else {
            rivals[name].as_f64()
        };
        ensure!(time.is_some() || name == C && in_c.is_none(), "no time for {name}");
    }
    Ok(times)
}

/// Medians over the rounds. Each ratio is computed within one round, in which the machine's speed changes little.
fn rows(rounds: &[Times], instructions: &[(&str, u64)]) -> Vec<Row> {
    let fastest = |times: &Times, work: Work| {
        let rivals = CONTENDERS.iter().zip(times).filter(|(c, _)| c.work == work && c.source == Source::Rival);
        rivals.filter_map(|(_, time)| *time).fold(f64::INFINITY, f64::min)
    };
    let row = |(i, contender): (usize, &'static Contender)| Row {
        contender,
        ns: median(rounds.iter().filter_map(|times| times[i])),
        to_rival: median(rounds.iter().filter_map(|times| Some(times[i]? / fastest(times, contender.work)))),
        instructions: instructions.iter().find(|(name, _)| *name == contender.name).map(|(_, count)| *count),
    };
    CONTENDERS.iter().enumerate().map(row).collect()
}

/// The median; `None` of nothing.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn table(rows: &[Row]) -> String {
    let mut text = String::new();
    for (work, head) in
        [(Work::Linear, "linear: no limits, no DAC codes"), (Work::Tick, "whole tick: limits, slew, DAC codes")]
    {
        text += &format!("{head:<38}{:>14}{:>12}{:>18}   aim\n", "ns per sample", "to rival", "MCU instructions");
        for row @ Row { contender, ns, to_rival, instructions } in rows.iter().filter(|row| row.contender.work == work)
        {
            let aim = contender.bound.map_or(String::new(), |bound| {
                format!("at most {bound}: {}", if row.within_bound() { "met" } else { "NOT MET" })
            });
            let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
            let count = instructions.map_or(String::new(), |count| count.to_string());
            let (ns, ratio) = (number(*ns), number(*to_rival));
            text += format!("{:<38}{ns:>14}{ratio:>12}{count:>18}   {aim}", contender.what).trim_end();
            text.push('\n');
        }
    }
    text
}

fn report(rows: &[Row]) -> Value {
    let row = |row: &Row| {
        json!({"name": row.contender.name, "ns_per_sample": row.ns, "to_rival": row.to_rival,
               "aim": row.contender.bound, "met": row.within_bound(), "instructions": row.instructions})
    };
    json!({"samples": SAMPLES, "rounds": ROUNDS, "rows": rows.iter().map(row).collect::<Vec<_>>()})
}

fn cargo_bench() -> Command {
    let mut command = shell::cargo();
    command.args(["bench", "--profile", "dist", "-p", "simulation", "--bench", BENCH]);
    command
}

/// An error if the Rust bench is missing, before minutes are spent on Python.
fn find_bench(metadata: &Value) -> Result<()> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let packages = list(&metadata["packages"]).into_iter().filter(|package| package["name"] == "simulation");
    let is_bench = |target: &Value| target["name"] == BENCH && list(&target["kind"]).contains(&json!("bench"));
    if !packages.flat_map(|package| list(&package["targets"])).any(|target| is_bench(&target)) {
        bail!("simulation has no bench `{BENCH}`: expected simulation/benches/{BENCH}.rs");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quiet() -> Times {
        [4000.0, 3800.0, 6.0, 5.0, 3.0, 9.0, 8.0, 30.0, 7.0, 9.0, 11.0, 12.0].map(Some)
    }

    #[test]
    fn a_slow_round_does_not_move_the_ratio_to_the_fastest_rival() {
        let slow = quiet().map(|ns| ns.map(|ns| ns * 3.0));
        let rows = rows(&[quiet(), slow, quiet()], &[("fixed_tick", 108)]);
        assert_eq!((rows[8].ns, rows[8].to_rival, rows[8].instructions), (Some(7.0), Some(7.0 / 8.0), Some(108)));
        assert_eq!(rows[4].to_rival, Some(0.6));
        assert!(rows.iter().all(Row::within_bound));
    }

    #[test]
    fn a_missed_aim_is_marked_and_c_may_be_missing() {
        let mut times = quiet();
        (times[4], times[6]) = (Some(4.0), None);
        let rows = rows(&[times], &[]);
        assert!(!rows[4].within_bound() && rows[8].within_bound());
        assert_eq!(rows[8].to_rival, Some(7.0 / 9.0));
        let table = table(&rows);
        assert!(table.lines().any(|line| line.contains("f64 reference") && line.ends_with("NOT MET")), "{table}");
        assert_eq!(report(&rows)["rows"][4]["met"], false);
    }
}
