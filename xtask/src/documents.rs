//! The command lines that the documents give to their readers, for the tests that run them.

use anyhow::{Context, Result};

use crate::{files, shell};

/// The documents that are read.
const PAGES: [&str; 2] = ["README.md", "docs/*.md"];

/// A command line of a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Path of the document below the workspace.
    pub page: String,
    /// The command, without the comment after it.
    pub text: String,
    /// True in a block of shell commands, false between backticks in a sentence, which may name a command without what it needs.
    pub is_whole: bool,
}

impl Line {
    /// The arguments of `program`, up to a pipe or a redirection; `None` if the line starts another program.
    pub fn arguments(&self, program: &str) -> Option<Vec<&str>> {
        let rest = self.text.strip_prefix(program).filter(|rest| rest.is_empty() || rest.starts_with(' '))?;
        Some(rest.split_whitespace().take_while(|word| !["|", ">", "&&", "&", "<"].contains(word)).collect())
    }

    /// The arguments of `vsj`, which is also started by cargo.
    pub fn of_vsj(&self) -> Option<Vec<&str>> {
        let by_cargo = ["cargo run --release --", "cargo run --release"];
        let mut arguments = by_cargo.iter().chain(&["vsj"]).find_map(|program| self.arguments(program))?;
        arguments.iter_mut().for_each(|word| *word = word.trim_matches('\''));
        // Another package's program.
        (!arguments.contains(&"-p")).then_some(arguments)
    }

    /// True for a command that talks with a board.
    pub fn needs_board(&self) -> bool {
        self.text.split(' ').any(|word| ["/dev/ttyACM0", "PORT"].contains(&word))
    }
}

/// The command lines of README and documents, in their order.
///
/// # Errors
/// If git or a document cannot be read.
pub fn lines() -> Result<Vec<Line>> {
    let mut lines = Vec::new();
    for page in files::tracked(&PAGES)? {
        let text = std::fs::read_to_string(shell::root().join(&page)).with_context(|| format!("cannot read {page}"))?;
        let found = whole(&text).into_iter().map(|text| (text, true));
        let found = found.chain(quoted(&text).into_iter().map(|text| (text, false)));
        lines.extend(found.map(|(text, is_whole)| Line { page: page.clone(), text, is_whole }));
    }
    Ok(lines)
}

/// The lines of a page's blocks of shell commands, without comments.
fn whole(page: &str) -> Vec<String> {
    let mut in_shell = false;
    let mut lines = Vec::new();
    for line in page.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            in_shell = language == "sh";
        } else if in_shell {
            lines.push(line.split(" #").next().unwrap_or_default().trim().to_owned());
        }
    }
    lines.retain(|line| !line.is_empty());
    lines
}

/// What is quoted in the sentences of a page and starts as a command does; a synopsis with brackets or dots does not count.
fn quoted(page: &str) -> Vec<String> {
    let sentences: String = page.split("```").step_by(2).collect();
    let quoted =
        sentences.split('`').skip(1).step_by(2).map(|text| text.split_whitespace().collect::<Vec<_>>().join(" "));
    let is_command = |text: &String| {
        ["vsj ", "cargo "].iter().any(|program| text.starts_with(program))
            && !["...", "[", "|"].iter().any(|sign| text.contains(sign))
    };
    quoted.filter(is_command).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_in_blocks_and_between_backticks() {
        let page = "See `vsj stair\n--json`, `vsj log ELF [FILE]` and `x`.\n\n```sh\nvsj beam  # bending\n\ncargo xtask check\n```\n\
                    ```text\nvsj none\n```\nThen `cargo campaign`.\n";
        assert_eq!(whole(page), ["vsj beam", "cargo xtask check"]);
        assert_eq!(quoted(page), ["vsj stair --json", "cargo campaign"]);
    }

    #[test]
    fn arguments_end_at_a_pipe_and_are_of_the_program_alone() {
        let line = |text: &str| Line { page: String::new(), text: text.into(), is_whole: true };
        assert_eq!(line("vsj diagnose a.csv --json > b").of_vsj().unwrap(), ["diagnose", "a.csv", "--json"]);
        assert_eq!(line("cargo run --release -- beam").of_vsj().unwrap(), ["beam"]);
        assert!(line("cargo run --release").of_vsj().unwrap().is_empty());
        assert_eq!(line("cargo run --release -p validation --example x").of_vsj(), None);
        assert_eq!(line("vsj-model").of_vsj(), None);
        assert_eq!(line("cargo xtask size | jq .").arguments("cargo xtask").unwrap(), ["size"]);
    }

    /// What a reader is given to type is run or understood by a test of the program that it starts.
    #[test]
    fn every_program_of_the_documents_has_a_test() {
        let tested = [
            // tests/tests/manual.rs, host-sim/tests/link/manual.rs
            "vsj",
            "cargo run --release",
            // The tests of this package's binary, of `emulation` and of `validation`.
            "cargo xtask",
            "cargo campaign",
            "cargo thresholds",
            "cargo feedback",
            "cargo test",
            "cargo build",
            "cargo rustc",
            "cargo install",
            "cargo publish",
            "cargo package",
            // python/tests/test_fleet.py, `cargo xtask python`
            "python -m vsj.fleet",
            "pip install ./python",
            "pip install './python[fleet]'",
            "target/python-venv/bin/python xtask/bench/fleet.py",
            // `cargo xtask capi`, `cargo xtask dist`
            "cmake -B build -DVSJ_LIBRARY=/path/to/libvsj_tick.a",
            "cmake --build build",
            "build/example",
            "cd target/releases/vsj-*/ && sha256sum --check SHA256SUMS",
        ];
        let lines = lines().unwrap();
        assert!(lines.iter().filter(|line| line.is_whole).count() > 100 && lines.len() > 300, "{}", lines.len());
        for line in lines {
            assert!(tested.iter().any(|program| line.arguments(program).is_some()), "no test runs {line:?}");
        }
    }
}
