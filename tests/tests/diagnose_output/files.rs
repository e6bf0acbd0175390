//! What it writes: all files or none, a page that needs no other, residuals that are a record again, JSON.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use validation::ground_truth::Cause;
use validation::ground_truth::record::Recipe;

use super::{FILES, folder, names, papers, rejected};

/// A file name that is HTML, XML and shell syntax.
const NASTY: &str = "<script>alert('a & \"b\"')<script>$x$.csv";

/// The record of a hidden cause.
fn write(folder: &Path, name: &str, cause: Cause) {
    fs::write(folder.join(name), Recipe { rows: 600, ..Recipe::of(&[cause]) }.draw(3).csv()).expect("a file");
}

fn answer_of(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn every_file_is_written_and_named() {
    let folder = folder();
    write(folder.path(), "record.csv", Cause::ChargeLeakage);
    let output = run(folder.path(), &["diagnose", "record.csv", "--out", "made/here"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(names(&folder.path().join("made/here")), FILES);
    let printed = text(&output.stdout);
    for name in FILES {
        assert!(printed.contains(&format!("wrote made/here/{name}\n")), "{name} is not in\n{printed}");
    }

    let made = |name: &str| fs::read_to_string(folder.path().join("made/here").join(name)).expect("a file");
    let page = made("report.html");
    for part in [
        "charge-leakage",
        "tau_s = ",
        "held-out RMSE",
        ">extended</th>",
        "data-name=\"extended [V]\"",
        "<summary>Values: residual [V]</summary>",
        "prefers-color-scheme: dark",
        "<code>vsj diagnose record.csv --out made/here</code>",
        "record.csv, column stiffness",
        "held between rows",
    ] {
        assert!(page.contains(part), "no {part:?} on the page");
    }
    // The best linear model has its line in the ranking, the errors and the held-out segments.
    let order = answer_of(&made("diagnosis.json"))["linear"]["order"].to_string();
    for (line, count) in [("best linear model, order ", 1), ("linear, order ", 2)] {
        assert_eq!(
            page.matches(&format!(">{line}{order}<")).count() + page.matches(&format!(">all, {line}{order}<")).count(),
            count
        );
    }
    // The plots are on the page and in files.
    assert_eq!(page.matches("<svg ").count(), 5);
    // The file says the same as `--json`.
    let answer = json(folder.path(), &["diagnose", "record.csv", "--json", "--out", "made/here"]);
    assert_eq!(answer_of(&made("diagnosis.json")), answer);
}

/// The plant file, the page and the terminal say where the record shows the law.
#[test]
fn a_law_is_written_with_the_range_of_the_record() {
    let folder = folder();
    write(folder.path(), "record.csv", Cause::StaticNonlinearity);
    let output = run(folder.path(), &["diagnose", "record.csv", "--out", "made"]);
    let made = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).expect("a file");
    let range = &answer_of(&made("diagnosis.json"))["extended"]["law_range_v"];
    let [low, high] = [0, 1].map(|end| range[end].as_f64().expect("a voltage"));
    let said =
        format!("The record shows the static law from {low:.0} to {high:.0} V; the plant file continues it above");
    // On the page a number and its unit stay on one line.
    let page = made("report.html").replace('\u{a0}', " ");
    for text in [made("plant.toml"), page, text(&output.stdout)] {
        assert!(text.contains(&said), "{said}: {text}");
    }
    let plant = text(&run(folder.path(), &["stair", "--plant", "made/plant.toml"]).stdout);
    assert!(!plant.is_empty());
}

#[test]
fn residuals_add_up_and_are_a_record_again() {
    let folder = folder();
    write(folder.path(), "record.csv", Cause::Hysteresis);
    let answer = json(folder.path(), &["diagnose", "record.csv", "--json", "--out", "out"]);
    let csv = fs::read_to_string(folder.path().join("out/residuals.csv")).expect("a file");
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let header = lines.next().expect("a header");
    assert_eq!(header, "time_s,voltage_v,reading,simulation,extended,residual_before,residual_after,held_out_fold");
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|field| field.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), 600);
    let rmse = |column: usize| (rows.iter().map(|row| row[column].powi(2)).sum::<f64>() / 600.0).sqrt();
    for (column, quality) in [(5, "baseline"), (6, "extended")] {
        let stated = answer[quality]["rmse"].as_f64().expect("a number");
        assert!((rmse(column) - stated).abs() < 1e-4, "{quality}: {} in the table, {stated} stated", rmse(column));
    }
    for row in &rows {
        assert!((row[2] - row[3] - row[5]).abs() < 2e-6 && (row[2] - row[4] - row[6]).abs() < 2e-6, "{row:?}");
        assert!((1.0..=5.0).contains(&row[7]), "{row:?}");
    }
    let again = json(folder.path(), &["diagnose", "out/residuals.csv", "--column", "reading", "--json"]);
    assert_eq!(again["findings"][0]["cause"], answer["findings"][0]["cause"]);
}

#[test]
fn the_page_needs_nothing_else_and_no_name_gets_through() {
    let folder = folder();
    write(folder.path(), NASTY, Cause::GainError);
    let output = run(folder.path(), &["diagnose", NASTY, "--out", "out"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = fs::read_to_string(folder.path().join("out/report.html")).expect("a page");
    for outside in ["http:", "https:", "src=", "url(", "@import", "<link", "<script", "<iframe", "<img"] {
        assert!(!page.contains(outside), "{outside} is on the page");
    }
    assert!(page.contains("&lt;script&gt;alert("), "the name is not on the page");
    assert!(page.contains("a &amp; &quot;b&quot;"), "the name is not escaped");
    for name in FILES.iter().filter(|name| name.ends_with(".svg")) {
        let svg = fs::read_to_string(folder.path().join("out").join(name)).expect("a plot");
        assert!(svg.starts_with("<svg xmlns=") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("alert") && !svg.contains("NaN"), "{name}");
        // Values on hover, colours for a dark screen, a size that follows the place.
        for part in ["<title>", "prefers-color-scheme: dark", "viewBox=", "max-width: 100%"] {
            assert!(svg.contains(part), "{part} is not in {name}");
        }
    }
}

#[test]
fn a_long_record_makes_a_short_page() {
    let folder = folder();
    let mut csv = "time_s,voltage_v,stiffness\n".to_owned();
    let mut stiffness = 0.0;
    for row in 0..100_000 {
        let (time, voltage) = (f64::from(row) * 0.001, f64::from((row / 10_000 * 3) % 7) * 100.0);
        stiffness += (voltage - stiffness) * 0.001 / 5.5;
        let ripple = f64::from((row * 7919) % 101) / 101.0 - 0.5;
        writeln!(csv, "{time:.3},{voltage},{:.4}", voltage / 11.0 + stiffness * 10.0 / 11.0 + ripple)
            .expect("a string takes anything");
    }
    fs::write(folder.path().join("long.csv"), csv).expect("a file");
    let output = run(folder.path(), &["diagnose", "long.csv", "--out", "out"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let size = fs::metadata(folder.path().join("out/report.html")).expect("a page").len();
    assert!(size < 2_000_000, "{size} bytes");
}

#[test]
fn a_short_record_is_drawn_as_the_points_that_it_is() {
    let folder = folder();
    fs::write(folder.path().join("record.csv"), papers(17, |_| 0.0)).expect("a file");
    let output = run(folder.path(), &["diagnose", "record.csv", "--out", "out"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let drawn = |name: &str, what: &str| {
        fs::read_to_string(folder.path().join("out").join(name)).expect("a plot").matches(what).count()
    };
    // Whatever the reading is: only its unit is known.
    assert_eq!(drawn("readings.svg", ">voltage, reading [V]<"), 1);
    // Readings, the simulation, and two dots in the legend; the grid, the axes and the command are lines.
    assert_eq!((drawn("readings.svg", "<circle"), drawn("readings.svg", "<path")), (2 * 17 + 2, 3));
    // The last row is 16 rows after the first.
    assert_eq!((drawn("autocorrelation.svg", "<circle"), drawn("input_correlation.svg", "<circle")), (16, 17));
}

#[test]
fn all_files_or_none() {
    let folder = folder();
    write(folder.path(), "record.csv", Cause::GainError);
    // The last file cannot be: a folder has its name.
    fs::create_dir_all(folder.path().join("out/diagnosis.json")).expect("a folder");
    let (code, error) = rejected(folder.path(), &["diagnose", "record.csv", "--out", "out"]);
    assert_eq!(code, Some(2), "{error}");
    assert_eq!(names(&folder.path().join("out")), ["diagnosis.json"]);

    let (code, error) = rejected(folder.path(), &["diagnose", "record.csv", "--out", "record.csv"]);
    assert_eq!(code, Some(2), "{error}");
    assert!(error.contains("record.csv: cannot be created") && error.contains("expected a writable folder"), "{error}");

    // A bad record leaves no folder behind.
    fs::write(folder.path().join("bad.csv"), "time_s,voltage_v\n").expect("a file");
    assert_eq!(rejected(folder.path(), &["diagnose", "bad.csv", "--out", "new"]).0, Some(2));
    assert!(!folder.path().join("new").exists());
}

#[test]
fn json_is_one_object_with_all_that_is_promised() {
    let folder = folder();
    write(folder.path(), "record.csv", Cause::Hysteresis);
    let answer = json(folder.path(), &["diagnose", "record.csv", "--json"]);
    assert_eq!(answer["schema"], 1);
    assert_eq!(answer["rows"], 600);
    assert_eq!(answer["verdict"], "explained");
    for quality in ["baseline", "extended"] {
        for number in ["rmse", "fit_percent", "held_out_rmse"] {
            assert!(answer[quality][number].is_number(), "{quality}.{number} in {answer}");
        }
    }
    assert!(answer["alternatives"].is_array() && answer.get("next_experiment").is_some());
    assert!(answer["extended"]["gain"].is_number() && answer["extended"].get("model").is_some());
    let finding = &answer["findings"][0];
    assert_eq!(finding["cause"], "hysteresis");
    for number in ["probability", "rmse_before", "rmse_after"] {
        assert!(finding[number].is_number(), "{number} in {finding}");
    }
    assert!(finding["evidence"].is_string());
    let width = &finding["parameters"]["width_v"];
    let [low, value, high] = ["low", "value", "high"].map(|name| width[name].as_f64().expect("a number"));
    assert!(low <= value && value <= high && width["unit"] == "V", "{width}");
}
