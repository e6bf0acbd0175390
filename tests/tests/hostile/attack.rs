//! Runs of `vsj` under limits, several at a time, with everything checked that holds for each of them.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use end_to_end::vsj::{text, vsj};

/// Largest address space of a run, in KiB.
const MEMORY_KIB: u64 = 2 << 20;
/// Largest processor time of a run, in s.
const PROCESSOR_S: u64 = 60;
/// Largest number of lines on stderr when the input is refused: the error, and remarks before it.
const MOST_LINES: usize = 3;

/// A run of `vsj`.
pub(crate) struct Case {
    name: String,
    arguments: Vec<OsString>,
    codes: &'static [i32],
}

/// A class of input: its cases, and a folder for their files.
pub(crate) struct Class {
    name: &'static str,
    folder: tempfile::TempDir,
    cases: Vec<Case>,
}

impl Class {
    pub(crate) fn new(name: &'static str) -> Self {
        Self { name, folder: tempfile::tempdir().expect("there is room"), cases: Vec::new() }
    }

    /// Path of a file or folder of the class.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file of the class.
    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, content).expect("there is room");
        path
    }

    /// Adds a run that ends with 0, 1 or 2.
    pub(crate) fn add<A: AsRef<OsStr>>(&mut self, name: impl Into<String>, arguments: impl IntoIterator<Item = A>) {
        self.add_ending(name, arguments, &[0, 1, 2]);
    }

    /// Adds a run that ends with one of `codes`.
    pub(crate) fn add_ending<A: AsRef<OsStr>>(
        &mut self,
        name: impl Into<String>,
        arguments: impl IntoIterator<Item = A>,
        codes: &'static [i32],
    ) {
        let arguments = arguments.into_iter().map(|argument| argument.as_ref().to_owned()).collect();
        self.cases.push(Case { name: name.into(), arguments, codes });
    }

    /// Runs all cases and checks each; `check` may add a complaint of its own.
    pub(crate) fn run(self, check: impl Fn(&str, &Output) -> Option<String> + Sync) {
        let (next, failures) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let workers = std::thread::available_parallelism().map_or(2, |count| count.get());
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    while let Some(case) = self.cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let output = limited(self.folder.path(), &case.arguments);
                        let mut why = complaints(&output, case.codes);
                        why.extend(check(&case.name, &output));
                        if !why.is_empty() {
                            failures.lock().expect("no panic").push(format!("{}: {}", case.name, why.join("; ")));
                        }
                    }
                });
            }
        });
        let mut failures = failures.into_inner().expect("no panic");
        failures.extend(temporaries(self.folder.path()).map(|path| format!("left over: {}", path.display())));
        println!("count: {} runs of vsj with hostile input: {}", self.cases.len(), self.name);
        assert!(failures.is_empty(), "{} of {}:\n{}", failures.len(), self.cases.len(), failures.join("\n"));
    }
}

/// Starts `vsj` in `folder` with bounds on its memory and processor time.
pub(crate) fn limited(folder: &Path, arguments: &[OsString]) -> Output {
    command(folder, arguments).output().expect("sh starts")
}

/// The command line of [`limited`].
pub(crate) fn command(folder: &Path, arguments: &[OsString]) -> Command {
    command_in(MEMORY_KIB, folder, arguments)
}

/// The command line of a run in this much address space, in KiB.
pub(crate) fn command_in(memory_kib: u64, folder: &Path, arguments: &[OsString]) -> Command {
    let limits = format!("ulimit -v {memory_kib}; ulimit -t {PROCESSOR_S}; ulimit -c 0; exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &limits]).arg(vsj().get_program()).args(arguments).current_dir(folder).stdin(Stdio::null());
    command.env("RUST_BACKTRACE", "0").stdout(Stdio::null());
    command
}

/// What is wrong with a run whatever its input was.
fn complaints(output: &Output, codes: &[i32]) -> Vec<String> {
    let said = text(&output.stderr);
    let mut why = Vec::new();
    match output.status.code() {
        Some(code) if codes.contains(&code) => {}
        _ => why.push(format!("{}: {said:.300}", output.status)),
    }
    if said.contains("panicked at") {
        why.push(format!("a panic: {said:.300}"));
    }
    let lines = said.lines().count();
    if output.status.code() == Some(2) && !(1..=MOST_LINES).contains(&lines) {
        why.push(format!("{lines} lines on stderr: {said:.300}"));
    }
    why
}

/// Temporary files below a folder.
fn temporaries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            if name.to_string_lossy().starts_with(".vsj-") {
                found.push(path);
            } else if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            }
        }
    }
    found.into_iter()
}
