//! Measured records in foreign formats: the examples of the documentation, and that the format does not matter.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use tempfile::tempdir;
use validation::ground_truth::Cause;
use validation::ground_truth::record::Recipe;

/// The fenced blocks of a page: the words after the fence, and the content.
fn blocks(page: &str) -> Vec<(Vec<&str>, &str)> {
    let fenced = page.split("```").skip(1).step_by(2).filter_map(|block| block.split_once('\n'));
    fenced.map(|(info, content)| (info.split(' ').collect(), content)).collect()
}

#[test]
fn every_example_of_the_page_on_data_files_prints_the_remarks_below_it_or_none() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/data-files.md");
    let page = fs::read_to_string(page).expect("the page");
    let folder = tempdir().expect("a folder");
    let blocks = blocks(&page);
    let mut commands = 0;
    for (index, (info, content)) in blocks.iter().enumerate() {
        match info.as_slice() {
            ["csv" | "toml", name] => fs::write(folder.path().join(name), content).expect("a file"),
            ["sh"] => {
                let words: Vec<&str> = content.split_whitespace().collect();
                let output = run(folder.path(), words.strip_prefix(&["vsj"]).expect("a command of vsj"));
                let below = blocks.get(index + 1).filter(|(info, _)| info == &["stderr"]);
                let expected = below.map_or("", |(_, remarks)| remarks);
                assert_eq!(text(&output.stderr), expected, "{content}");
                assert_eq!(output.status.success(), !expected.contains("expected"), "{content}");
                commands += 1;
            }
            _ => (),
        }
    }
    assert!(commands > 5, "{commands} commands");
}

/// A record as different instruments might write it gives one answer.
#[test]
fn a_diagnosis_does_not_depend_on_the_format_of_the_file() {
    let hidden = Recipe { rows: 600, ..Recipe::of(&[Cause::GainError]) }.draw(3);
    let folder = tempdir().expect("a folder");
    let plain = hidden.csv();
    fs::write(folder.path().join("plain.csv"), &plain).expect("a file");
    // Milliseconds and millivolts have the same digits as seconds and volts, three places further.
    let shifted = |cell: &str| {
        let number: f64 = cell.parse().expect("a number");
        format!("{:.9}", number * 1e3).replace('.', ",")
    };
    let mut foreign = "% of another program\r\nStiffness;Command_mV;T [ms];Note\r\n".to_owned();
    for row in plain.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let reading = cells[2].replace('.', ",");
        write!(foreign, "{reading};{};{};none\r\n", shifted(cells[1]), shifted(cells[0])).expect("a string");
    }
    let utf_16: Vec<u8> = format!("\u{feff}{foreign}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(folder.path().join("foreign.csv"), utf_16).expect("a file");
    let [plain, foreign] = [
        json(folder.path(), &["diagnose", "plain.csv", "--json"]),
        json(folder.path(), &["diagnose", "foreign.csv", "--time", "T [ms]", "--json"]),
    ];
    let causes = |answer: &serde_json::Value| -> Vec<String> {
        let findings = answer["findings"].as_array().expect("findings");
        findings.iter().map(|finding| finding["cause"].to_string()).collect()
    };
    assert_eq!((causes(&plain), &plain["verdict"]), (causes(&foreign), &foreign["verdict"]));
    let error = |answer: &serde_json::Value| answer["extended"]["rmse"].as_f64().expect("a number");
    assert!((error(&plain) / error(&foreign) - 1.0).abs() < 1e-3, "{plain} {foreign}");
}

/// Titles above the header and units below it change no byte of the answers.
#[test]
fn titles_and_units_change_no_answer() {
    let hidden = Recipe { rows: 600, ..Recipe::of(&[Cause::GainError]) }.draw(4);
    let folder = tempdir().expect("a folder");
    let rows: Vec<String> = hidden.csv().lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect();
    let (header, rows) = rows.split_first().expect("a header");
    let rows = rows.join("\n");
    let [plain, titled] = ["", "Rig 4, test 17\nChannels,3\n"].map(|titles| {
        let units = if titles.is_empty() { "" } else { "s,V,V\n" };
        let file = folder.path().join("record.csv");
        fs::write(file, format!("{titles}{header}\n{units}{rows}\n")).expect("a file");
        ["identify", "diagnose"].map(|command| run(folder.path(), &[command, "record.csv", "--json"]))
    });
    for (plain, titled) in plain.iter().zip(&titled) {
        assert!(plain.status.success() && !plain.stdout.is_empty(), "{}", text(&plain.stderr));
        assert_eq!(text(&titled.stdout), text(&plain.stdout));
        let said = "vsj: record.csv: 2 line(s) above the header in line 3, skipped\nvsj: record.csv: units s, V, V below the header\n";
        assert!(text(&titled.stderr).starts_with(said), "{}", text(&titled.stderr));
    }
}

#[test]
fn a_schedule_may_have_other_separators_but_no_missing_voltage() {
    let folder = tempdir().expect("a folder");
    let steps = |csv: &str| {
        fs::write(folder.path().join("s.csv"), csv).expect("a file");
        run(folder.path(), &["stair", "--input", "s.csv", "--json"])
    };
    let plain = steps("time_s,voltage_v\n0,0\n1,100.5\n5,100.5\n");
    assert!(plain.status.success(), "{}", text(&plain.stderr));
    for csv in ["Voltage_V;Time_S\n0;0\n100,5;1\n100,5;5\n", "time_s voltage_v\n 0   0\n 1 100.5\n 5 100.5\n"] {
        assert_eq!(text(&steps(csv).stdout), text(&plain.stdout), "{csv}");
    }
    let error = text(&steps("time_s,voltage_v\n0,0\n1,NA\n").stderr);
    assert_eq!(error, "vsj: s.csv, line 3, column voltage_v: `NA` is not a finite number\n");
}
