//! The pages of the manual about a board: their commands in their order, with an MCU at the port.
//!
//! Schedules of minutes are followed for their first seconds; what a page diagnoses then is the sample record in place of the recording.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use link::{AdaptationReport, State};
use model::Plant;
use model::adaptation::{Parameters, Phase, Settings};
use record_files::{Cell, Column, Container, Sheet, Writer};
use simulation::record::{MEASURED, Record};
use xtask::documents::{self, Line};
use xtask::shell;

use crate::mcu::{Mcu, Setup};

/// What a page leaves to its readers, and what it is here.
const PLACES: [(&str, &str); 2] = [("192.168.1.20", "127.0.0.1"), ("--keep 20", "--keep 0.5")];
/// Commands that last until Ctrl-C, or for minutes, and how long they last here.
const ENDLESS: [(&[&str], &str); 4] =
    [(&["link", "record"], "2"), (&["link", "watch"], "0.3"), (&["watch"], "0.3"), (&["link", "capture"], "1")];

/// Commands that are run elsewhere: `vsj log` in tests/tests/log.rs with an image of its own, an emulated board by `cargo xtask clients`.
fn is_run_elsewhere(arguments: &[&str]) -> bool {
    arguments.first() == Some(&"log") || arguments.contains(&"--emulated")
}

#[test]
fn the_commands_of_the_pages_about_a_board_run_in_their_order() {
    let mut pages: BTreeMap<String, Vec<Line>> = BTreeMap::new();
    for line in documents::lines().unwrap() {
        if line.is_whole && line.of_vsj().is_some() {
            pages.entry(line.page.clone()).or_default().push(line);
        }
    }
    pages.retain(|_, lines| lines.iter().any(Line::needs_board));
    assert!(pages.len() >= 7, "{:?}", pages.keys());
    let ran: usize = std::thread::scope(|scope| {
        let pages: Vec<_> = pages.iter().map(|(page, lines)| scope.spawn(|| follow(page, lines))).collect();
        pages.into_iter().map(|page| page.join().unwrap()).sum()
    });
    assert!(ran >= 30, "{ran} commands");
}

/// Runs the commands of a page; returns their number.
fn follow(page: &str, lines: &[Line]) -> usize {
    let mcu = Mcu::on_socket(Setup { sensor: true, silence_ms: 1500, ..Setup::default() });
    let parameters = Parameters { time_constant: 1.0, share: 1.0, gain: 1.0 };
    let adaptation = AdaptationReport::new(Phase::Watching, &parameters, &Settings::TYPICAL, Plant::PAPER);
    mcu.with(|shared| shared.adaptation = adaptation);
    let folder = tempfile::tempdir().unwrap();
    files_of(page, folder.path());
    let mut ran = 0;
    for line in lines {
        let text = PLACES.iter().fold(line.text.clone(), |text, (from, to)| text.replace(from, to));
        let line = Line { text, ..line.clone() };
        let mut arguments = line.of_vsj().unwrap();
        if is_run_elsewhere(&arguments) {
            continue;
        }
        for word in &mut arguments {
            if ["/dev/ttyACM0", "PORT"].contains(word) {
                *word = &mcu.port;
            }
        }
        if let ["diagnose" | "identify", record, options @ ..] = arguments.as_slice() {
            write_record(&folder.path().join(record), options);
        }
        let command: Vec<&str> = arguments.iter().copied().filter(|word| *word != mcu.port).take(2).collect();
        if !arguments.contains(&"--seconds")
            && let Some((_, seconds)) = ENDLESS.iter().find(|(words, _)| command.starts_with(words))
        {
            arguments.extend(["--seconds", seconds]);
        }
        // A reader types slower than an armed MCU waits for its host.
        mcu.wait_for(State::Disarmed);
        let vsj = Path::new(env!("CARGO_BIN_EXE_vsj"));
        let output = Command::new(vsj).args(&arguments).current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{page}: {}\n{}", line.text, String::from_utf8_lossy(&output.stderr));
        if let Some((_, file)) = line.text.split_once(" > ") {
            std::fs::write(folder.path().join(file), output.stdout).unwrap();
        }
        ran += 1;
    }
    ran
}

/// Writes the files that a page shows, each with its name as a comment in the first line, and settings of the reader's own.
fn files_of(page: &str, folder: &Path) {
    let text = std::fs::read_to_string(shell::root().join(page)).unwrap();
    for block in text.split("```").skip(1).step_by(2) {
        let content = block.split_once('\n').map_or("", |(_, content)| content);
        if let Some(name) = content.lines().next().and_then(|line| line.strip_prefix("# "))
            && (name.ends_with(".toml") || name.ends_with(".csv"))
        {
            std::fs::write(folder.join(name), content).unwrap();
        }
    }
    std::fs::write(folder.join("FILE.toml"), "schema = 1\n[gains]\nproportional = 3.5\n").unwrap();
}

/// Writes the sample record in the format that the file's name asks for, with the columns that the options name.
fn write_record(path: &Path, options: &[&str]) {
    let sample: PathBuf = shell::root().join("data/sample_hysteresis.csv");
    let rows = Record::open(&sample, MEASURED).unwrap().rows;
    let value = |option: &str| options.windows(2).find(|pair| pair[0] == option).map(|pair| pair[1]);
    let names = [("--time", "time_s"), ("--voltage", "voltage_v"), ("--reading", "stiffness")]
        .map(|(option, usual)| value(option).map_or(usual, |name| name.split(':').next().unwrap()).to_owned());
    let values = rows.iter().map(|row| [row.time_s, row.voltage_v, row.measured.unwrap()]);
    let Some(container) = Container::of(path) else {
        let table = values.fold(names.join(",") + "\n", |table, [time, voltage, reading]| {
            table + &format!("{time},{voltage},{reading}\n")
        });
        return std::fs::write(path, table).unwrap();
    };
    let columns = names.map(|name| Column::number(name.leak(), ""));
    let topic = value("--topic").map_or("record", |topic| topic.trim_start_matches('/'));
    let sheet = Sheet { name: topic, source: "the sample record", columns: &columns };
    let mut writer = Writer::new(container, &sheet, File::create(path).unwrap()).unwrap();
    for row in values {
        writer.row((row[0] * 1e9) as u64, &row.map(Cell::Number)).unwrap();
    }
    writer.finish().unwrap();
}
