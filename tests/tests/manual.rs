//! The manual: its first page is run, and every command line that it quotes is one that `vsj` understands.

use std::fs;
use std::path::{Path, PathBuf};

use end_to_end::vsj::{run, text, vsj};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository")
}

fn page(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The lines of a page's blocks of shell commands, without comments.
fn shell_lines(page: &str) -> Vec<String> {
    let mut in_shell = false;
    let mut lines = Vec::new();
    for line in page.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            in_shell = language == "sh";
        } else if in_shell {
            let command = line.split(" #").next().unwrap_or_default().trim();
            lines.push(command.to_owned());
        }
    }
    lines.retain(|line| !line.is_empty());
    lines
}

/// The arguments of `vsj` in a command line, up to a pipe or a redirection; `None` for another program.
fn arguments(line: &str) -> Option<Vec<&str>> {
    let rest = ["vsj", "cargo run --release"].iter().find_map(|program| line.strip_prefix(program))?;
    let rest = rest.strip_prefix(" --").filter(|rest| rest.starts_with(' ')).unwrap_or(rest);
    if !rest.is_empty() && !rest.starts_with(' ') {
        return None;
    }
    Some(rest.split_whitespace().take_while(|word| !["|", ">", "&&", "&", "<"].contains(word)).collect())
}

#[test]
fn the_commands_of_the_first_page_run_in_their_order() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("data")).expect("a folder");
    let sample = "data/sample_hysteresis.csv";
    fs::copy(root().join(sample), folder.path().join(sample)).expect("the sample record");
    let mut ran = 0;
    for line in shell_lines(&page("docs/getting-started.md")) {
        let Some(arguments) = arguments(&line) else {
            assert!(line.starts_with("cargo xtask "), "not run by this test: {line}");
            continue;
        };
        // The full screen has tests of its own, in a pseudo-terminal.
        if arguments.first() == Some(&"watch") {
            continue;
        }
        let output = run(folder.path(), &arguments);
        assert!(output.status.success(), "{line}: {}", text(&output.stderr));
        if let Some((_, file)) = line.split_once(" > ") {
            fs::write(folder.path().join(file), output.stdout).expect("a file");
        }
        ran += 1;
    }
    assert!(ran >= 8, "{ran} commands");
    for file in ["out/stair/stair.csv", "out/diagnosis/report.html", "out/nominal/plant.toml", "out/plan/schedule.csv"]
    {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

/// `--help` at the end of a line ends the parsing after the options before it were understood.
#[test]
fn every_command_line_in_the_manual_is_understood() {
    let docs = fs::read_dir(root().join("docs")).expect("docs");
    let names =
        docs.map(|entry| entry.expect("an entry").path()).filter(|path| path.extension().is_some_and(|it| it == "md"));
    let mut tried = 0;
    for path in names.chain([root().join("README.md")]) {
        for line in shell_lines(&fs::read_to_string(&path).expect("a page")) {
            let Some(arguments) = arguments(&line) else { continue };
            let output = vsj().args(&arguments).arg("--help").output().expect("vsj starts");
            assert!(output.status.success(), "{}: {line}\n{}", path.display(), text(&output.stderr));
            tried += 1;
        }
    }
    assert!(tried > 40, "{tried} command lines");
}

#[test]
fn the_contents_list_every_page() {
    let contents = page("docs/SUMMARY.md");
    for entry in fs::read_dir(root().join("docs")).expect("docs") {
        let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
        let is_listed = name == "SUMMARY.md" || !name.ends_with(".md") || contents.contains(&format!("]({name})"));
        assert!(is_listed, "docs/SUMMARY.md does not list {name}");
    }
}
