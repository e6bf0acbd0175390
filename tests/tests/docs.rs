//! The documentation: its links, its size, and the output that the README quotes.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use end_to_end::vsj::{run, text};

/// Largest size of the README in bytes.
const README_BYTES: usize = 8192;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository")
}

/// All Markdown files below a folder, except build and run output and templates among sources, whose links start elsewhere.
fn markdown_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !name.starts_with('.') && !["target", "out", "src"].contains(&name.as_str()) {
            files.extend(markdown_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "md") {
            files.push(path);
        }
    }
    files
}

/// The lines of a page outside of fenced code blocks.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut in_code = false;
    page.lines().filter(move |line| {
        let is_fence = line.starts_with("```");
        in_code ^= is_fence;
        !in_code && !is_fence
    })
}

/// The targets of a page's relative links, as written: `path`, `path#anchor` or `#anchor`.
fn relative_links(page: &str) -> Vec<&str> {
    let links = prose(page).flat_map(|line| line.split("](").skip(1));
    let targets = links.filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    targets.filter(|target| !target.contains("://")).collect()
}

/// The anchors of a page's headings, as Markdown viewers make them.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings =
        prose(page).filter_map(|line| line.strip_prefix('#')).map(|line| line.trim_start_matches('#').trim());
    let kept = |letter: &char| letter.is_alphanumeric() || " -_".contains(*letter);
    headings.map(|heading| heading.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-")).collect()
}

/// The file a link of `page` leads to, and its anchor.
fn resolve<'l>(page: &Path, link: &'l str) -> (PathBuf, Option<&'l str>) {
    let (path, anchor) = link.split_once('#').map_or((link, None), |(path, anchor)| (path, Some(anchor)));
    let file = if path.is_empty() { page.to_owned() } else { page.parent().expect("a folder").join(path) };
    (file, anchor)
}

#[test]
fn relative_links_lead_to_files_and_headings_that_exist() {
    let mut broken = Vec::new();
    for page in markdown_files(&root()) {
        let content = fs::read_to_string(&page).expect("a page");
        for link in relative_links(&content) {
            let (file, anchor) = resolve(&page, link);
            let is_heading = |anchor: &str| fs::read_to_string(&file).is_ok_and(|page| anchors(&page).contains(anchor));
            if !file.exists() || !anchor.is_none_or(is_heading) {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
}

#[test]
fn the_readme_is_at_most_8_kilobytes() {
    let bytes = fs::read(root().join("README.md")).expect("the README").len();
    assert!(bytes <= README_BYTES, "{bytes} bytes");
}

#[test]
fn every_page_and_folder_in_docs_is_linked_from_its_index_directly_or_over_other_pages() {
    let docs = root().join("docs");
    let mut reached: BTreeSet<PathBuf> = BTreeSet::new();
    let mut open = vec![docs.join("README.md")];
    while let Some(page) = open.pop() {
        let Ok(page) = page.canonicalize() else { continue };
        if !page.starts_with(&docs) || !reached.insert(page.clone()) || page.extension().is_none_or(|it| it != "md") {
            continue;
        }
        let content = fs::read_to_string(&page).expect("a page");
        open.extend(relative_links(&content).into_iter().map(|link| resolve(&page, link).0));
    }
    // The contents of the book are no page of it.
    reached.insert(docs.join("SUMMARY.md"));
    for entry in fs::read_dir(&docs).expect("docs") {
        let path = entry.expect("an entry").path();
        assert!(reached.iter().any(|page| page.starts_with(&path)), "no page links {}", path.display());
    }
}

#[test]
fn the_pins_in_the_manual_are_those_of_the_firmware() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("a page");
    let (pins, manual) = (read("firmware/src/pins.md"), read("docs/firmware.md"));
    let rows: Vec<&str> = pins.lines().filter(|line| line.starts_with("| P")).collect();
    assert!(
        rows.len() > 5 && rows.iter().all(|row| manual.contains(row)),
        "docs/firmware.md differs from firmware/src/pins.md"
    );
    // Who flashes as an ordinary user needs the rules.
    assert!(manual.contains("https://probe.rs/docs/getting-started/probe-setup/"));
}

/// The program is compiled and run on the emulated board by `cargo xtask clients`.
#[test]
fn the_first_step_in_c_plus_plus_is_the_program_that_is_tested() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("a file");
    let (manual, program) = (read("docs/clients.md"), read("clients/cpp/test/step.cpp"));
    let step = manual.split("```cpp\n").nth(1).and_then(|rest| rest.split("```").next()).expect("the first step");
    // The program takes the port as an argument.
    let program = program.replace("argc > 1 ? argv[1] : ", "").replace("\n    ", "\n");
    assert!(step.lines().count() >= 6 && program.contains(step), "{step}");
}

/// In a block of the book there is room for 78 characters.
#[test]
fn the_wiring_is_drawn_straight_and_fits_the_page() {
    let manual = fs::read_to_string(root().join("docs/bring-up.md")).expect("a page");
    let drawing = manual.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("the wiring");
    let rows: Vec<Vec<char>> = drawing.lines().map(|line| line.chars().collect()).collect();
    assert!(rows.iter().all(|row| row.len() <= 78), "{drawing}");
    let [upper, lower] = ['┌', '└'].map(|corner| rows.iter().position(|row| row.contains(&corner)).expect("boxes"));
    let sides = rows[upper].iter().enumerate().filter(|(_, letter)| "┌┐".contains(**letter)).map(|(column, _)| column);
    for column in sides {
        let is_side = |row: &Vec<char>| row.get(column).is_some_and(|letter| "│├┤►◄".contains(*letter));
        assert!(rows[upper + 1..lower].iter().all(is_side), "column {column}:\n{drawing}");
    }
}

#[test]
fn the_readme_quotes_what_diagnose_prints_on_the_sample_record() {
    let readme = fs::read_to_string(root().join("README.md")).expect("the README");
    let (_, rest) = readme.split_once("diagnose data/sample_hysteresis.csv\n").expect("the example");
    let quoted = rest.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("its output");
    let output = run(&root(), &["diagnose", "data/sample_hysteresis.csv"]);
    let printed = text(&output.stdout);
    assert!(quoted.lines().count() > 3, "{quoted}");
    for line in quoted.lines().filter(|line| *line != "...") {
        assert!(printed.lines().any(|it| it == line), "the README quotes: {line}\nprinted:\n{printed}");
    }
}
