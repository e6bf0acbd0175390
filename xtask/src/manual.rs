//! `cargo xtask manual`: the documents as a book with contents, search and a page for each command.
//!
//! In: the documents as git tracks them, in the order of `docs/SUMMARY.md`, and the help of every command. Out: a folder of pages
//! that opens from a disk or from any static host.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use xtask::build;
use xtask::files;
use xtask::shell;
use xtask::tool::Tool;

/// The renderer.
const MDBOOK: Tool = Tool { name: "mdbook", version: "0.4.52" };
/// What git tracks and the book contains; the links between them stay as they are.
const SOURCES: [&str; 5] = ["docs", "data", "README.md", "CONTRIBUTING.md", "CHANGELOG.md"];
/// Contents, relative to the documents.
const CONTENTS: &str = "docs/SUMMARY.md";
/// Lines of the contents that are replaced by lists.
const CAUSES: &str = "<!-- causes -->";
const CAMPAIGNS: &str = "<!-- campaigns -->";
const COMMANDS: &str = "<!-- commands -->";

const BOOK: &str = "\
[book]
title = \"vsj\"
description = \"Real-time stiffness controller for a variable-stiffness joint, and the diagnosis of measured records\"
language = \"en\"

[build]
build-dir = \"book\"
create-missing = false
# A README.md keeps its name, which links to it use.
use-default-preprocessors = false

[preprocessor.links]

[output.html]
default-theme = \"light\"
preferred-dark-theme = \"navy\"
";

/// Builds the book with the help of the program `vsj`. Returns the folder of its pages.
pub(crate) fn build(vsj: &Path) -> Result<PathBuf> {
    let target = shell::target_directory()?;
    let mdbook = MDBOOK.program()?;
    let folder = target.join("manual");
    let sources = folder.join("src");
    files::remove(&sources)?;
    // As they are now.
    for file in files::tracked(&SOURCES)?.iter().filter(|file| *file != CONTENTS) {
        files::copy(&shell::root().join(file), &sources.join(file))?;
    }
    let commands = commands(vsj, &sources.join("commands"))?;
    let contents =
        fs::read_to_string(shell::root().join(CONTENTS)).with_context(|| format!("cannot read {CONTENTS}"))?;
    files::write(&sources.join("SUMMARY.md"), &contents_of_book(&contents, &causes()?, &campaigns()?, &commands)?)?;
    files::write(&folder.join("book.toml"), BOOK)?;
    shell::run(shell::command(&mdbook).arg("build").arg(&folder))?;
    Ok(folder.join("book"))
}

/// Builds the book and prints the path of its first page.
pub(crate) fn run() -> Result<()> {
    println!("{}", build(&build::vsj()?)?.join("index.html").display());
    Ok(())
}

/// Writes a page with the help of each command of `vsj`, and one with those of `cargo xtask`. Returns their lines of the contents.
fn commands(vsj: &Path, folder: &Path) -> Result<String> {
    files::make(folder)?;
    let pages = folder.join("man");
    shell::output(shell::command(vsj).arg("man").arg("--out").arg(&pages))?;
    let mut names = Vec::new();
    for entry in fs::read_dir(&pages).with_context(|| format!("cannot read {}", pages.display()))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        names.extend(name.strip_suffix(".1").map(str::to_owned));
    }
    files::remove(&pages)?;
    names.sort();
    let mut lines = String::new();
    let mut page = |name: &str, file: &str, help: &str, depth: usize| {
        lines += &format!("{}- [{name}](commands/{file}.md)\n", "  ".repeat(depth));
        files::write(&folder.join(format!("{file}.md")), format!("# {name}\n\n```text\n{}\n```\n", help.trim_end()))
    };
    for file in &names {
        let words: Vec<&str> = file.split('-').collect();
        let help = shell::output(shell::command(vsj).args(&words[1..]).arg("--help"))?;
        page(&words.join(" "), file, &help, words.len().saturating_sub(2))?;
    }
    let mut help = shell::cargo();
    page("cargo xtask", "cargo-xtask", &shell::output(help.args(["xtask", "--help"]))?, 0)?;
    Ok(lines)
}

/// The lines of the contents for the causes, the page about all of them first.
fn causes() -> Result<String> {
    let pages = files::tracked(&["docs/causes/*.md"])?;
    let mut names: Vec<&str> = pages.iter().filter_map(|page| page.rsplit('/').next()?.strip_suffix(".md")).collect();
    names.sort_by_key(|name| (*name != "README", *name));
    ensure!(names.first() == Some(&"README"), "docs/causes has no README.md");
    let title = |name: &str| if name == "README" { "All causes".to_owned() } else { name.to_owned() };
    Ok(names.iter().map(|name| format!("- [{}](causes/{name}.md)\n", title(name))).collect())
}

/// The lines of the contents for the results of the campaigns, below the page about all of them.
fn campaigns() -> Result<String> {
    let pages = files::tracked(&["docs/identification"])?;
    let names = pages.iter().filter_map(|page| page.strip_prefix("docs/identification/")?.strip_suffix(".md"));
    Ok(names.map(|name| format!("  - [{name}](identification/{name}.md)\n")).collect())
}

/// The contents with links relative to the book instead of the documents' folder, and with the lists in their places.
fn contents_of_book(contents: &str, causes: &str, campaigns: &str, commands: &str) -> Result<String> {
    for place in [CAUSES, CAMPAIGNS, COMMANDS] {
        ensure!(contents.contains(place), "{CONTENTS} has no line {place}");
    }
    let with_lists = contents.replace(CAUSES, causes.trim_end()).replace(CAMPAIGNS, campaigns.trim_end());
    let relative = with_lists.replace("](", "](docs/").replace("](docs/../", "](");
    Ok(relative.replace(COMMANDS, commands.trim_end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_of_the_contents_start_at_the_root_of_the_book() {
        let contents =
            "[vsj](../README.md)\n- [Stair](stair.md)\n<!-- campaigns -->\n<!-- causes -->\n<!-- commands -->\n";
        let [causes, campaigns] = ["- [All](causes/README.md)\n", "  - [pairs](identification/pairs.md)\n"];
        let book = contents_of_book(contents, causes, campaigns, "- [vsj](commands/vsj.md)\n").unwrap();
        let expected = "[vsj](README.md)\n- [Stair](docs/stair.md)\n  - [pairs](docs/identification/pairs.md)\n\
                        - [All](docs/causes/README.md)\n- [vsj](commands/vsj.md)\n";
        assert_eq!(book, expected);
        assert!(contents_of_book("<!-- causes -->", "", "", "").is_err());
    }

    /// What is not in the contents is no page of the book, and links to it lead nowhere.
    #[test]
    fn every_document_is_in_the_contents() {
        let contents = fs::read_to_string(shell::root().join(CONTENTS)).unwrap();
        let book = contents_of_book(&contents, &causes().unwrap(), &campaigns().unwrap(), "").unwrap();
        for page in files::tracked(&["*.md"]).unwrap() {
            let is_of_book = SOURCES.iter().any(|source| page == *source || page.starts_with(&format!("{source}/")));
            assert!(!is_of_book || page == CONTENTS || book.contains(&format!("]({page})")), "{page}");
        }
    }
}
