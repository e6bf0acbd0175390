//! `cargo xtask fuzz`: libFuzzer on every file format and frame, with sanitizers, on a nightly compiler.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use xtask::shell;
use xtask::tally::Tally;
use xtask::tool::Tool;

use crate::nightly;

const TOOL: Tool = Tool { name: "cargo-fuzz", version: "0.13.2" };
/// Folder of the targets, a workspace of its own, and of their corpora.
const FOLDER: &str = "fuzz";
/// Largest memory of a target, in MiB, its sanitizer included.
const MEMORY_MIB: u32 = 2048;
/// Longest time for one input, in s.
const INPUT_S: u32 = 20;
/// Longest input, in bytes.
const INPUT_BYTES: u32 = 16_384;

/// Options of `cargo xtask fuzz`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The formats: csv, mcap, parquet, schedule, plant, settings, log, elf, recording, wire, server, plan, columns; default: all of them
    #[arg(value_name = "TARGET")]
    targets: Vec<String>,
    /// Time for each format, in s
    #[arg(long, default_value_t = 60, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
}

/// What a target has done.
struct Row {
    target: String,
    inputs: u64,
    edges: u64,
    corpus: usize,
}

/// Runs the targets one after the other and prints a table; a finding is an error.
pub(crate) fn run(args: &Args) -> Result<()> {
    let all = all_targets()?;
    if let Some(unknown) = args.targets.iter().find(|target| !all.contains(target)) {
        bail!("no target {unknown}; expected {}", all.join(", "));
    }
    nightly::install("rust-src")?;
    let program = TOOL.program()?;
    // Before the first run, so that the time of a target is not that of its build.
    shell::run(fuzz(&program).arg("build"))?;
    let targets = if args.targets.is_empty() { &all } else { &args.targets };
    let rows = targets.iter().map(|target| row(&program, target, args.seconds)).collect::<Result<Vec<_>>>()?;
    println!("{:<10} {:>12} {:>8} {:>8}", "format", "inputs", "edges", "corpus");
    for Row { target, inputs, edges, corpus } in &rows {
        println!("{target:<10} {inputs:>12} {edges:>8} {corpus:>8}");
    }
    let inputs: u64 = rows.iter().map(|row| row.inputs).sum();
    println!("{inputs} inputs, no finding");
    Tally::now(rows.into_iter().map(|row| (format!("inputs of the format {}", row.target), row.inputs)))?.write("fuzz")
}

/// Names of the targets: those that have a corpus.
fn all_targets() -> Result<Vec<String>> {
    let folder = shell::root().join(FOLDER).join("corpus");
    let entries = fs::read_dir(&folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut targets: Vec<String> =
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    targets.sort();
    Ok(targets)
}

/// cargo-fuzz on the nightly compiler.
fn fuzz(program: &Path) -> Command {
    let mut command = nightly::command(program);
    command.arg("fuzz").current_dir(shell::root().join(FOLDER));
    command
}

/// Runs a target on its corpus, which stays as it is; what is found anew goes to the folder of built files.
fn row(program: &Path, target: &str, seconds: u32) -> Result<Row> {
    let found = shell::root().join(FOLDER).join("target/corpus").join(target);
    fs::create_dir_all(&found).with_context(|| format!("cannot create {}", found.display()))?;
    let limits = [
        format!("-max_total_time={seconds}"),
        format!("-rss_limit_mb={MEMORY_MIB}"),
        format!("-timeout={INPUT_S}"),
        format!("-max_len={INPUT_BYTES}"),
        "-print_final_stats=1".to_owned(),
    ];
    let mut command = fuzz(program);
    command.args(["run", target]).arg(&found).arg(Path::new("corpus").join(target)).arg("--").args(limits);
    eprintln!("fuzz: {target} for {seconds} s");
    let output = command.output().context("rustup does not start")?;
    let text = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        let tail: Vec<&str> = text.lines().rev().take(40).collect();
        bail!("{target}: a finding\n{}", tail.into_iter().rev().collect::<Vec<_>>().join("\n"));
    }
    let (inputs, edges) =
        statistics(&text).with_context(|| format!("{target}: no statistics in the output of libFuzzer"))?;
    let corpus = fs::read_dir(&found).map_or(0, Iterator::count);
    Ok(Row { target: target.to_owned(), inputs, edges, corpus })
}

/// Number of inputs, and of edges of the control flow that they reached, from libFuzzer's output.
fn statistics(text: &str) -> Option<(u64, u64)> {
    let inputs =
        text.lines().find_map(|line| line.strip_prefix("stat::number_of_executed_units:"))?.trim().parse().ok()?;
    let edges =
        text.lines().rev().find_map(|line| line.split(" cov: ").nth(1)?.split_whitespace().next()?.parse().ok())?;
    Some((inputs, edges))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_and_edges_are_read_from_the_output_of_libfuzzer() {
        let text = "#2\tINITED cov: 10 ft: 11\n#131072\tpulse  cov: 812 ft: 2000 corp: 90/9Kb\nDone 200000 runs in 61 second(s)\n\
                    stat::number_of_executed_units: 200000\nstat::peak_rss_mb:  90\n";
        assert_eq!(statistics(text), Some((200_000, 812)));
        assert_eq!(statistics("Done"), None);
    }

    /// The folder is a workspace of its own: no build of the root updates its lock file.
    #[test]
    fn the_lock_file_has_the_packages_and_dependencies_of_today() {
        let text = fs::read_to_string(shell::root().join(FOLDER).join("Cargo.lock")).unwrap();
        let lock: toml::Table = text.parse().unwrap();
        let metadata = shell::metadata().unwrap();
        for package in lock["package"].as_array().unwrap() {
            let name = package["name"].as_str().unwrap();
            if package.get("source").is_some() || name == "fuzz" {
                continue;
            }
            let known = metadata["packages"].as_array().unwrap().iter().find(|known| known["name"] == name);
            let known = known.unwrap_or_else(|| panic!("{name} is no package of the workspace"));
            let locked = package["dependencies"].as_array().unwrap().iter();
            let locked: Vec<&str> = locked.filter_map(|it| it.as_str()?.split(' ').next()).collect();
            for dependency in known["dependencies"].as_array().unwrap() {
                let needed = dependency["kind"].is_null() && dependency["optional"] == false;
                let wanted = dependency["name"].as_str().unwrap();
                assert!(!needed || locked.contains(&wanted), "{name} lacks {wanted}: cargo update -w, in {FOLDER}");
            }
        }
    }

    #[test]
    fn every_corpus_has_a_target_and_every_target_a_corpus() {
        let manifest = fs::read_to_string(shell::root().join(FOLDER).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = manifest.parse().unwrap();
        let bins = manifest["bin"].as_array().unwrap().iter().map(|bin| bin["name"].as_str().unwrap().to_owned());
        let mut bins: Vec<String> = bins.collect();
        bins.sort();
        assert_eq!(all_targets().unwrap(), bins);
    }
}
