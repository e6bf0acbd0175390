//! `cargo xtask times`: how long builds take in a clean clone, compared with bounds and with another revision.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use xtask::shell;

pub(crate) const EXAMPLES: &str = "\
Clones the last commit into a temporary folder, with a target directory of its own, and times each command there:
  first result   cargo run --release, nothing compiled before
  xtask          cargo xtask --help, nothing compiled before
  check          cargo xtask check, after a first run and a changed line in a library
  test           with --test: cargo xtask test, nothing compiled before
Changes that are not committed are not measured. Downloads are not timed. CPU time depends less than wall time on
what else the machine does. A time above its bound is marked and is no error.

Examples:
  cargo xtask times
  cargo xtask times --against HEAD~20       the same in an earlier revision, in turns, and the ratios
  cargo xtask times --test --json
  cargo xtask times --only xtask";

/// The library that one line is changed in; the second one in revisions without the first.
const EDITED: [&str; 2] = ["identify/src/lib.rs", "host-sim/src/lib.rs"];

/// Options of `cargo xtask times`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Measure this revision too, and print the ratios to it
    #[arg(long, value_name = "REV")]
    against: Option<String>,
    /// Measure `cargo xtask test` too
    #[arg(long)]
    test: bool,
    /// Measure this command alone
    #[arg(long, value_name = "NAME", conflicts_with = "test", value_parser = ["first result", "xtask", "check", "test"])]
    only: Option<String>,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
}

impl Args {
    fn measures(&self, task: &Task) -> bool {
        match &self.only {
            Some(name) => name == task.name,
            None => self.test || task.name != TEST,
        }
    }
}

/// A command that is timed.
struct Task {
    name: &'static str,
    args: &'static [&'static str],
    /// Longest wall time that is accepted on two cores, in s.
    bound_s: f64,
    before: Before,
}

/// What happens before the clock starts.
enum Before {
    /// Everything compiled is removed.
    Clean,
    /// The command runs once, then a line of [`EDITED`] changes.
    Edit,
}

const TASKS: [Task; 4] = [
    Task { name: "first result", args: &["run", "--release"], bound_s: 120.0, before: Before::Clean },
    Task { name: "xtask", args: &["xtask", "--help"], bound_s: 30.0, before: Before::Clean },
    Task { name: "check", args: &["xtask", "check"], bound_s: 90.0, before: Before::Edit },
    Task { name: TEST, args: &["xtask", "test"], bound_s: 720.0, before: Before::Clean },
];
/// The task that is measured on request only.
const TEST: &str = "test";

/// Time of one command, in s.
#[derive(Clone, Copy)]
struct Time {
    wall_s: f64,
    /// User and system time of the command and its children.
    cpu_s: f64,
}

/// One line of the table.
struct Row {
    task: &'static Task,
    time: Time,
    /// `None` without another revision, and where the command fails in it.
    against: Option<Time>,
}

/// Measures every task, in both revisions in turns, and prints the table.
pub(crate) fn run(args: &Args) -> Result<()> {
    let folder = Folder::new()?;
    let head = Clone::new(&folder, "HEAD")?;
    let other = args.against.as_deref().map(|revision| Clone::new(&folder, revision)).transpose()?;
    let mut rows = Vec::new();
    for task in TASKS.iter().filter(|task| args.measures(task)) {
        let time = head.time(task)?;
        let against = other.as_ref().and_then(|other| {
            let time = other.time(task);
            time.inspect_err(|error| eprintln!("not measured in {}: {error:#}", other.revision)).ok()
        });
        rows.push(Row { task, time, against });
    }
    let cores = std::thread::available_parallelism()?.get();
    let names = (head.revision.as_str(), other.as_ref().map(|other| other.revision.as_str()));
    if args.json {
        println!("{}", report(cores, names, &rows));
    } else {
        print!("{}", table(cores, names, &rows));
    }
    Ok(())
}

/// A temporary folder, removed when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self> {
        let path = std::env::temp_dir().join(format!("xtask-times-{}", std::process::id()));
        fs::create_dir(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A clone of the repository at one revision.
struct Clone {
    /// Short hash.
    revision: String,
    path: PathBuf,
}

impl Clone {
    /// Clones without copying objects, and downloads dependencies that are missing.
    fn new(folder: &Folder, revision: &str) -> Result<Self> {
        let commit = format!("{revision}^{{commit}}");
        let hash = shell::output(shell::command("git").args(["rev-parse", "--verify", "--short", &commit]))?;
        let hash = hash.trim().to_owned();
        let path = folder.0.join(format!("{}-{hash}", revision.replace(|c: char| !c.is_ascii_alphanumeric(), "-")));
        shell::run(shell::command("git").args(["clone", "--quiet", "--shared", "--no-checkout", "."]).arg(&path))?;
        shell::run(shell::command("git").current_dir(&path).args(["checkout", "--quiet", "--detach", &hash]))?;
        let clone = Self { revision: hash, path };
        shell::run(&mut clone.cargo(&["fetch", "--quiet", "--locked"]))?;
        Ok(clone)
    }

    /// cargo in the clone, with the clone's toolchain and target directory.
    fn cargo(&self, args: &[&str]) -> Command {
        let mut command = shell::command("cargo");
        command.current_dir(&self.path).args(args);
        for variable in ["CARGO_TARGET_DIR", "CARGO_BUILD_TARGET_DIR", "RUSTUP_TOOLCHAIN"] {
            command.env_remove(variable);
        }
        command
    }

    fn time(&self, task: &Task) -> Result<Time> {
        match task.before {
            Before::Clean => remove(&self.path.join("target"))?,
            Before::Edit => {
                shell::run(&mut self.cargo(task.args))?;
                self.edit()?;
            }
        }
        let (begin, cpu_before) = (Instant::now(), children_cpu_s()?);
        shell::run(&mut self.cargo(task.args))?;
        Ok(Time { wall_s: begin.elapsed().as_secs_f64(), cpu_s: children_cpu_s()? - cpu_before })
    }

    /// Adds a line to a library.
    fn edit(&self) -> Result<()> {
        let paths = EDITED.map(|file| self.path.join(file));
        let path = paths.iter().find(|path| path.exists()).context("no library to change a line in")?;
        let mut file = fs::OpenOptions::new().append(true).open(path)?;
        writeln!(file, "const _: () = ();").with_context(|| format!("cannot write {}", path.display()))
    }
}

fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    Ok(())
}

/// User and system time of all children that have ended, with their children, in s: fields 16 and 17 of
/// `/proc/self/stat`, in units of 10 ms.
fn children_cpu_s() -> Result<f64> {
    let stat = fs::read_to_string("/proc/self/stat").context("CPU times need Linux")?;
    // The second field is the program's name in parentheses and may contain blanks.
    let (_, fields) = stat.rsplit_once(')').context("/proc/self/stat without a name")?;
    let ticks = fields.split_whitespace().skip(13).take(2).map(str::parse::<f64>).sum::<Result<f64, _>>()?;
    Ok(ticks / 100.0)
}

fn table(cores: usize, (head, other): (&str, Option<&str>), rows: &[Row]) -> String {
    let mut text = format!("{:<14}{:>9}{:>9}{:>9}", format!("{cores} cores"), "wall [s]", "at most", "CPU [s]");
    if let Some(other) = other {
        text += &format!("   {:>9}{:>9}{:>14}{:>13}", "wall [s]", "CPU [s]", "ratio of wall", "of CPU");
        text = format!("{:<14}{:<27}   {other}\n{text}", "", head);
    } else {
        text = format!("{:<14}{head}\n{text}", "");
    }
    for Row { task, time, against } in rows {
        let mark = if time.wall_s <= task.bound_s { "" } else { "   NOT MET" };
        text += &format!("\n{:<14}{:>9.1}{:>9}{:>9.1}", task.name, time.wall_s, task.bound_s, time.cpu_s);
        match against {
            Some(Time { wall_s, cpu_s }) => {
                let (wall, cpu) = (time.wall_s / wall_s, time.cpu_s / cpu_s);
                text += &format!("   {wall_s:>9.1}{cpu_s:>9.1}{wall:>14.2}{cpu:>13.2}");
            }
            None if other.is_some() => text += &format!("   {:>9}{:>9}{:>14}{:>13}", "-", "-", "-", "-"),
            None => {}
        }
        text += mark;
    }
    text + "\n"
}

fn report(cores: usize, (head, other): (&str, Option<&str>), rows: &[Row]) -> Value {
    let row = |Row { task, time, against }: &Row| {
        json!({
            "name": task.name, "command": format!("cargo {}", task.args.join(" ")),
            "wall_s": time.wall_s, "cpu_s": time.cpu_s, "bound_s": task.bound_s, "met": time.wall_s <= task.bound_s,
            "against": against.map(|other| json!({
                "wall_s": other.wall_s, "cpu_s": other.cpu_s,
                "wall_ratio": time.wall_s / other.wall_s, "cpu_ratio": time.cpu_s / other.cpu_s,
            })),
        })
    };
    json!({"cores": cores, "revision": head, "against": other, "rows": rows.iter().map(row).collect::<Vec<_>>()})
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: Time = Time { wall_s: 60.0, cpu_s: 100.0 };
    const SLOW: Time = Time { wall_s: 150.0, cpu_s: 200.0 };

    #[test]
    fn times_stand_next_to_their_bounds_and_ratios() {
        let rows = [
            Row { task: &TASKS[0], time: TIME, against: Some(SLOW) },
            Row { task: &TASKS[1], time: TIME, against: None },
        ];
        let text = table(2, ("abc", Some("def")), &rows);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[2].ends_with("0.40         0.50"), "{text}");
        assert!(lines[3].ends_with("NOT MET"), "{text}");
        let json = report(2, ("abc", Some("def")), &rows);
        assert_eq!((&json["rows"][0]["against"]["wall_ratio"], &json["rows"][1]["met"]), (&json!(0.4), &json!(false)));
        assert_eq!(json["rows"][1]["against"], Value::Null);
    }

    #[test]
    fn the_whole_test_is_measured_on_request_only() {
        let count = |test, only: Option<&str>| {
            let args = Args { against: None, test, only: only.map(str::to_owned), json: false };
            TASKS.iter().filter(|task| args.measures(task)).count()
        };
        assert_eq!((count(false, None), count(true, None), count(false, Some("check"))), (3, 4, 1));
    }

    #[test]
    fn cpu_time_of_children_is_counted() {
        let before = children_cpu_s().unwrap();
        shell::output(Command::new("sh").args(["-c", "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"])).unwrap();
        assert!(children_cpu_s().unwrap() > before);
    }
}
