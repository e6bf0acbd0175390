//! The manual: the commands of its pages are run, and every command line that it quotes is one that `vsj` understands. The pages about
//! a board are run by the tests of `vsj link`, those of other programs by the tests of these.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use end_to_end::vsj::{run, text, vsj};
use simulation::record::{MEASURED, Record};
use xtask::documents::{self, Line};

/// The page whose examples, refusals among them, are run by `data_files.rs` and not here.
const HAS_A_TEST: &str = "docs/data-files.md";
/// Names of choices in sentences, and one of them.
const CHOICES: [(&str, &str); 3] = [("SHELL", "bash"), ("MODEL", "zener"), ("KEY=PERCENT", "tau=5")];
const SAMPLE: &str = "data/sample_hysteresis.csv";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository")
}

/// The command lines of `vsj` in blocks, by page.
fn pages() -> BTreeMap<String, Vec<Line>> {
    let mut pages: BTreeMap<String, Vec<Line>> = BTreeMap::new();
    for line in documents::lines().expect("the documents") {
        if line.is_whole && line.of_vsj().is_some() {
            pages.entry(line.page.clone()).or_default().push(line);
        }
    }
    pages
}

#[test]
fn the_commands_of_every_page_without_a_board_run_in_their_order() {
    let mut ran = 0;
    for (page, lines) in pages() {
        if page == HAS_A_TEST || lines.iter().any(Line::needs_board) {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        files(folder.path());
        for line in &lines {
            let arguments = line.of_vsj().expect("a command of vsj");
            // The full screen has tests of its own, in a pseudo-terminal.
            if arguments.first() == Some(&"watch") {
                continue;
            }
            if let ["diagnose" | "identify", record, ..] = arguments[..] {
                let record = folder.path().join(record);
                if !record.exists() {
                    fs::create_dir_all(record.parent().expect("a folder")).expect("a folder");
                    fs::copy(root().join(SAMPLE), record).expect("the sample record");
                }
            }
            let output = run(folder.path(), &arguments);
            assert!(output.status.success(), "{page}: {}\n{}", line.text, text(&output.stderr));
            if let Some((_, file)) = line.text.split_once(" > ") {
                fs::write(folder.path().join(file), output.stdout).expect("a file");
            }
            ran += 1;
        }
        let expected: &[&str] = match page.as_str() {
            "docs/getting-started.md" => {
                &["out/stair/stair.csv", "out/diagnosis/report.html", "out/nominal/plant.toml", "out/plan/schedule.csv"]
            }
            "docs/export.md" => &["out/fmu/vsj_both.fmi3.fmu", "out/c/vsj_settings.h", "out/model/model.bin"],
            _ => &[],
        };
        for file in expected {
            assert!(folder.path().join(file).exists(), "{page}: {file}");
        }
    }
    assert!(ran >= 20, "{ran} commands");
}

/// What the pages start from: the repository's records and plant file, and the README's record of a reader's own, in kV and mm with
/// semicolons and decimal commas.
fn files(folder: &Path) {
    for path in ["data", "docs"] {
        fs::create_dir(folder.join(path)).expect("a folder");
    }
    for path in [SAMPLE, "data/table3_stair.csv", "docs/plant.toml"] {
        fs::copy(root().join(path), folder.join(path)).expect("a file of the repository");
    }
    let rows = Record::open(&root().join(SAMPLE), MEASURED).expect("the sample record").rows;
    let table = rows.iter().fold(String::from("t_ms;u_kV;x_mm\n"), |table, row| {
        let reading = row.measured.expect("a reading") / 1e3;
        table + &format!("{};{};{reading}\n", row.time_s * 1e3, row.voltage_v / 1e3).replace('.', ",")
    });
    fs::write(folder.join("hv.csv"), table).expect("a file");
}

/// `--help` at the end of a line ends the parsing after the options before it were understood.
#[test]
fn every_command_line_in_the_manual_is_understood() {
    let mut tried = 0;
    for line in documents::lines().expect("the documents") {
        let Some(mut arguments) = line.of_vsj() else { continue };
        for (choice, one) in CHOICES {
            arguments.iter_mut().filter(|word| **word == choice).for_each(|word| *word = one);
        }
        let output = vsj().args(&arguments).arg("--help").output().expect("vsj starts");
        let error = text(&output.stderr);
        // A sentence may name an option without a value.
        let is_named = ["a value is required", "invalid value '--help'"].iter().any(|said| error.contains(said));
        let is_understood = output.status.success() || !line.is_whole && is_named;
        assert!(is_understood, "{line:?}\n{error}");
        tried += 1;
    }
    assert!(tried > 150, "{tried} command lines");
}

#[test]
fn the_contents_list_every_page() {
    let contents = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("the contents");
    for entry in fs::read_dir(root().join("docs")).expect("docs") {
        let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
        let is_listed = name == "SUMMARY.md" || !name.ends_with(".md") || contents.contains(&format!("]({name})"));
        assert!(is_listed, "docs/SUMMARY.md does not list {name}");
    }
}
