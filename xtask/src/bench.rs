//! `cargo xtask bench`: ns per sample of the closed loop, and CPU time of identifications and diagnoses, compared with Python.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use xtask::{python, shell};

use crate::{bench_records, package};

/// Samples in one run of a contender: 70 s at 1 kHz and the one at 0 s, as in `rivals.py` and the Rust bench.
const SAMPLES: u32 = 70_001;
/// Python and Rust are measured in turns, because a machine's speed changes within minutes.
const ROUNDS: usize = 3;
const BENCH: &str = "closed_loop";

struct Contender {
    /// Key in the output of `rivals.py`, or id in the Rust bench.
    name: &'static str,
    what: &'static str,
    rust: bool,
    /// Highest time that is accepted, as a multiple of numba's.
    bound: Option<f64>,
}

const NUMBA: &str = "numba";
const CONTENDERS: [Contender; 8] = [
    Contender { name: "lsim", what: "scipy.signal.lsim", rust: false, bound: None },
    Contender { name: "numpy", what: "NumPy, a loop in Python", rust: false, bound: None },
    Contender { name: "lfilter", what: "scipy.signal.lfilter", rust: false, bound: None },
    Contender { name: NUMBA, what: "numba, linear loop", rust: false, bound: None },
    Contender { name: "numba_tick", what: "numba, with limits and DAC", rust: false, bound: None },
    Contender { name: "controller", what: "vsj.Controller, the tick in Python", rust: false, bound: None },
    Contender { name: "fixed_tick", what: "Rust, the MCU's fixed-point tick", rust: true, bound: Some(1.5) },
    Contender { name: "reference_f64", what: "Rust, f64 reference", rust: true, bound: Some(0.7) },
];

/// Options of `cargo xtask bench`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// Measure the closed loop or the records only
    #[arg(long, value_enum)]
    only: Option<Part>,
}

/// One of the two tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// The closed loop.
    ClosedLoop,
    /// Identification and diagnosis of records.
    Records,
}

/// One line of the table.
struct Row {
    contender: &'static Contender,
    ns: f64,
    to_numba: f64,
}

impl Row {
    fn within_bound(&self) -> bool {
        self.contender.bound.is_none_or(|bound| self.to_numba <= bound)
    }
}

/// Measures every contender and prints the tables. A time above its bound is marked and is no error.
pub(crate) fn run(args: &Args) -> Result<()> {
    let target = shell::target_directory()?;
    let wants = |part: Part| args.only.is_none_or(|only| only == part);
    if wants(Part::ClosedLoop) {
        find_bench(&shell::metadata()?)?;
    }
    let python = python::environment(&target, "bench", "xtask/bench/requirements.txt")?;
    let closed_loop = if wants(Part::ClosedLoop) { Some(closed_loop(&python, &target)?) } else { None };
    let records = if wants(Part::Records) { Some(bench_records::measure(&python, &target)?) } else { None };
    if args.json {
        let mut report = report(closed_loop.as_deref().unwrap_or_default());
        report["records"] = records.unwrap_or_default();
        println!("{report}");
        return Ok(());
    }
    let closed_loop = closed_loop.map(|rows| table(&rows));
    let records = records.map(|records| bench_records::table(&records)).transpose()?;
    print!("{}", closed_loop.into_iter().chain(records).collect::<Vec<String>>().join("\n"));
    Ok(())
}

/// The table of the closed loop.
fn closed_loop(python: &Path, target: &Path) -> Result<Vec<Row>> {
    package::install(python, target)?;
    shell::run(cargo_bench().arg("--no-run"))?;
    let mut rounds = Vec::new();
    for round in 1..=ROUNDS {
        eprintln!("round {round} of {ROUNDS}");
        rounds.push(measure(python, target)?);
    }
    Ok(rows(&rounds))
}

/// One round: ns per sample of each contender, in the order of [`CONTENDERS`].
fn measure(python: &Path, target: &Path) -> Result<[f64; CONTENDERS.len()]> {
    let rivals = shell::json(shell::command(python).arg("xtask/bench/rivals.py"))?;
    let criterion = target.join("criterion").join(BENCH);
    let estimates = |name: &str| criterion.join(name).join("new/estimates.json");
    // Otherwise results of an earlier run could be read as this one's.
    for contender in CONTENDERS.iter().filter(|c| c.rust) {
        let _ = fs::remove_file(estimates(contender.name));
    }
    shell::run(&mut cargo_bench())?;

    let mut times = [0.0; CONTENDERS.len()];
    for (time, contender) in times.iter_mut().zip(&CONTENDERS) {
        let name = contender.name;
        *time = if contender.rust {
            let path = estimates(name);
            let text = fs::read_to_string(&path).with_context(|| {
                format!("bench `{BENCH}` left no {}: does it have the id `{name}`?", path.display())
            })?;
            let estimates: Value = serde_json::from_str(&text)?;
            estimates["median"]["point_estimate"].as_f64().map(|ns| ns / f64::from(SAMPLES))
        } else {
            rivals[name].as_f64()
        }
        .with_context(|| format!("no time for {name}"))?;
    }
    Ok(times)
}

/// Medians over the rounds. Each ratio is computed within one round, in which the machine's speed changes little.
fn rows(rounds: &[[f64; CONTENDERS.len()]]) -> Vec<Row> {
    let numba = CONTENDERS.iter().position(|c| c.name == NUMBA).expect("numba is in the list");
    let row = |(i, contender)| Row {
        contender,
        ns: median(rounds.iter().map(|times| times[i])),
        to_numba: median(rounds.iter().map(|times| times[i] / times[numba])),
    };
    CONTENDERS.iter().enumerate().map(row).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table(rows: &[Row]) -> String {
    let mut text = format!("{:<36}{:>14}{:>12}   aim\n", "closed loop, 70 s at 1 kHz", "ns per sample", "to numba");
    for row @ Row { contender, ns, to_numba } in rows {
        let aim = contender.bound.map_or(String::new(), |bound| {
            format!("at most {bound}: {}", if row.within_bound() { "met" } else { "NOT MET" })
        });
        text += format!("{:<36}{ns:>14.2}{to_numba:>12.2}   {aim}", contender.what).trim_end();
        text.push('\n');
    }
    text
}

fn report(rows: &[Row]) -> Value {
    let row = |row: &Row| {
        json!({"name": row.contender.name, "ns_per_sample": row.ns, "to_numba": row.to_numba,
               "aim": row.contender.bound, "met": row.within_bound()})
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

    #[test]
    fn a_slow_round_does_not_move_the_ratio() {
        let quiet = [4000.0, 3800.0, 6.0, 5.0, 9.0, 8.0, 7.0, 3.0];
        let slow = quiet.map(|ns| ns * 3.0);
        let rows = rows(&[quiet, slow, quiet]);
        assert_eq!((rows[6].ns, rows[6].to_numba), (7.0, 1.4));
        assert!(rows.iter().all(Row::within_bound));
    }

    #[test]
    fn a_missed_aim_is_marked() {
        let rows = rows(&[[4000.0, 3800.0, 6.0, 5.0, 9.0, 8.0, 7.0, 4.0]]);
        assert!(rows[6].within_bound() && !rows[7].within_bound());
        assert!(table(&rows).trim_end().ends_with("NOT MET"));
        assert_eq!(report(&rows)["rows"][7]["met"], false);
    }
}
