//! ns per sample of the closed loop, beside what Python users have.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use crate::{python, shell};

/// Samples in one run of a contender: 70 s at 1 kHz and the one at 0 s, as in `rivals.py` and the Rust bench.
const SAMPLES: u32 = 70_001;
/// Rivals and Rust take turns, because a machine's speed changes within minutes.
const ROUNDS: usize = 3;
const BENCH: &str = "closed_loop";

struct Contender {
    /// Key in the output of `rivals.py`, or id in the Rust bench.
    name: &'static str,
    what: &'static str,
    rust: bool,
    /// The rival that does the same work, and the allowed time as a multiple of its.
    bound: Option<(&'static str, f64)>,
}

const CONTENDERS: [Contender; 6] = [
    Contender { name: "lsim", what: "scipy.signal.lsim", rust: false, bound: None },
    Contender { name: "lfilter", what: "scipy.signal.lfilter", rust: false, bound: None },
    Contender { name: "numba", what: "numba, exact linear loop", rust: false, bound: None },
    Contender { name: "numba_sampled", what: "numba, the tick's linear equations", rust: false, bound: None },
    Contender {
        name: "fixed_tick",
        what: "Rust, the MCU's fixed-point tick",
        rust: true,
        bound: Some(("numba_sampled", 1.5)),
    },
    Contender { name: "reference_f64", what: "Rust, f64 reference", rust: true, bound: Some(("numba", 0.7)) },
];

/// Options of `cargo xtask bench`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
}

/// One line of the table.
struct Row {
    contender: &'static Contender,
    ns: f64,
    /// Time as a multiple of the quickest numba loop's.
    to_numba: f64,
    /// The same for the rival of the bound.
    to_rival: Option<f64>,
}

impl Row {
    fn within_bound(&self) -> bool {
        self.contender.bound.zip(self.to_rival).is_none_or(|((_, bound), ratio)| ratio <= bound)
    }
}

/// `cargo xtask bench`.
pub(crate) fn run(args: &Args) -> Result<()> {
    let metadata = shell::metadata()?;
    find_bench(&metadata)?;
    let target = Path::new(metadata["target_directory"].as_str().context("cargo metadata names no target directory")?);
    let python = python::with(target, "bench")?;
    shell::run(cargo_bench().arg("--no-run"))?;

    let mut rounds = Vec::new();
    for round in 1..=ROUNDS {
        eprintln!("round {round} of {ROUNDS}");
        rounds.push(measure(&python, target)?);
    }
    let rows = rows(&rounds);
    if args.json {
        println!("{}", report(&rows));
    } else {
        print!("{}", table(&rows));
    }
    if !rows.iter().all(Row::within_bound) {
        bail!("Rust is slower than its bounds allow");
    }
    Ok(())
}

/// One round: ns per sample of each contender, in their order.
fn measure(python: &Path, target: &Path) -> Result<[f64; CONTENDERS.len()]> {
    let rivals = shell::json(shell::command(python).arg("xtask/bench/rivals.py"))?;
    let criterion = target.join("criterion").join(BENCH);
    let estimates = |name: &str| criterion.join(name).join("new/estimates.json");
    // What an earlier run left must not be taken for this one's.
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

/// Median over the rounds, of the times and of the ratios. A ratio is taken within its round: both saw the same machine.
fn rows(rounds: &[[f64; CONTENDERS.len()]]) -> Vec<Row> {
    let ratio = |i: usize, rival: &str| {
        let rival = CONTENDERS.iter().position(|c| c.name == rival).expect("the rival is in the list");
        median(rounds.iter().map(|times| times[i] / times[rival]))
    };
    let row = |(i, contender): (usize, &'static Contender)| Row {
        contender,
        ns: median(rounds.iter().map(|times| times[i])),
        to_numba: ratio(i, "numba"),
        to_rival: contender.bound.map(|(rival, _)| ratio(i, rival)),
    };
    CONTENDERS.iter().enumerate().map(row).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table(rows: &[Row]) -> String {
    let mut text = format!("{:<36}{:>14}{:>12}   bound\n", "closed loop, 70 s at 1 kHz", "ns per sample", "to numba");
    for row @ Row { contender, ns, to_numba, to_rival } in rows {
        let bound = contender.bound.zip(*to_rival).map_or(String::new(), |((rival, bound), ratio)| {
            let met = if row.within_bound() { "met" } else { "NOT MET" };
            format!("{ratio:.2} of {rival}, at most {bound}: {met}")
        });
        text += format!("{:<36}{ns:>14.2}{to_numba:>12.2}   {bound}", contender.what).trim_end();
        text.push('\n');
    }
    text
}

fn report(rows: &[Row]) -> Value {
    let row = |row: &Row| {
        json!({"name": row.contender.name, "ns_per_sample": row.ns, "to_numba": row.to_numba,
               "rival": row.contender.bound.map(|(rival, _)| rival), "to_rival": row.to_rival,
               "bound": row.contender.bound.map(|(_, bound)| bound), "within_bound": row.within_bound()})
    };
    json!({"samples": SAMPLES, "rounds": ROUNDS, "rows": rows.iter().map(row).collect::<Vec<_>>(),
           "within_bounds": rows.iter().all(Row::within_bound)})
}

fn cargo_bench() -> Command {
    let mut command = shell::cargo();
    command.args(["bench", "-p", "host-sim", "--bench", BENCH]);
    command
}

/// An error before minutes are spent on Python, if the Rust side is missing.
fn find_bench(metadata: &Value) -> Result<()> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let packages = list(&metadata["packages"]).into_iter().filter(|package| package["name"] == "host-sim");
    let is_bench = |target: &Value| target["name"] == BENCH && list(&target["kind"]).contains(&json!("bench"));
    if !packages.flat_map(|package| list(&package["targets"])).any(|target| is_bench(&target)) {
        bail!("host-sim has no bench `{BENCH}`: expected host-sim/benches/{BENCH}.rs");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_round_does_not_move_the_ratio() {
        let quiet = [4000.0, 6.0, 5.0, 8.0, 11.2, 3.0];
        let slow = quiet.map(|ns| ns * 3.0);
        let rows = rows(&[quiet, slow, quiet]);
        assert_eq!((rows[4].ns, rows[4].to_numba), (11.2, 11.2 / 5.0));
        assert_eq!(rows[4].to_rival, Some(1.4));
        assert!(rows.iter().all(Row::within_bound));
    }

    #[test]
    fn a_missed_bound_is_marked() {
        let rows = rows(&[[4000.0, 6.0, 5.0, 8.0, 11.2, 4.0]]);
        assert!(rows[4].within_bound() && !rows[5].within_bound());
        assert!(table(&rows).trim_end().ends_with("NOT MET"));
        assert_eq!(report(&rows)["within_bounds"], false);
    }
}
