//! `vsj diagnose` as its users call it: what it writes, what it prints, and what it says to bad records.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use end_to_end::hidden::Cause;
use end_to_end::hidden::record::Recipe;
use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use tempfile::TempDir;

/// A file name that is HTML, XML and shell at once.
const NASTY: &str = "<script>alert('a & \"b\"')<script>$x$.csv";
const FILES: [&str; 9] = [
    "autocorrelation.svg",
    "diagnosis.json",
    "input_correlation.svg",
    "plant.toml",
    "readings.svg",
    "report.html",
    "residual.svg",
    "residual_voltage.svg",
    "residuals.csv",
];

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// The record of a hidden cause.
fn write(folder: &Path, name: &str, cause: Cause) {
    fs::write(folder.join(name), Recipe { rows: 600, ..Recipe::of(&[cause]) }.draw(3).csv()).expect("a file");
}

/// A record whose readings are `reading(time, voltage)`, on a stair of 100 V each 10 s, two rows a second.
fn stair(reading: impl Fn(f64, f64) -> f64) -> String {
    let mut csv = "time_s,voltage_v,stiffness\n".to_owned();
    for row in 0..120 {
        let time = f64::from(row) * 0.5;
        let voltage = 100.0 * (time / 10.0).floor();
        writeln!(csv, "{time},{voltage},{}", reading(time, voltage)).expect("a string takes anything");
    }
    csv
}

/// The paper's spring on plateaus of 10 s, ten rows a second, read within half a volt and off by `error(row)`.
fn papers(rows: u32, error: impl Fn(u32) -> f64) -> String {
    let mut csv = "time_s,voltage_v,stiffness\n".to_owned();
    let (mut relaxed, mut noise) = (0.0, 1u32);
    for row in 0..rows {
        let voltage = [0.0, 400.0, 150.0, 500.0][row as usize / 100 % 4];
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let reading = relaxed + (voltage - relaxed) / 11.0 + f64::from(noise) / f64::from(u32::MAX) - 0.5 + error(row);
        writeln!(csv, "{},{voltage},{reading}", 0.1 * f64::from(row)).expect("a string takes anything");
        relaxed += (voltage - relaxed) * (1.0 - (-0.1f64 / 5.5).exp());
    }
    csv
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Exit code and the one line on stderr.
fn refused(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = run(folder, arguments);
    assert!(output.stdout.is_empty(), "{arguments:?} printed {}", text(&output.stdout));
    let error = text(&output.stderr);
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    (output.status.code(), error)
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
        "<code>vsj diagnose record.csv --out made/here</code>",
        "record.csv, column stiffness",
        "held between rows",
    ] {
        assert!(page.contains(part), "no {part:?} on the page");
    }
    // The plots are on the page and beside it.
    assert_eq!(page.matches("<svg ").count(), 5);
    // The file says the same as `--json`.
    let answer = json(folder.path(), &["diagnose", "record.csv", "--json", "--out", "made/here"]);
    assert_eq!(serde_json::from_str::<Value>(&made("diagnosis.json")).expect("JSON"), answer);
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
        let told = answer[quality]["rmse"].as_f64().expect("a number");
        assert!((rmse(column) - told).abs() < 1e-4, "{quality}: {} in the table, {told} told", rmse(column));
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
    // Within the page, a plot refers to its own clip path.
    let page = page.replace("url(#", "");
    for outside in ["http:", "https:", "src=", "url(", "@import", "<link", "<script", "<iframe", "<img"] {
        assert!(!page.contains(outside), "{outside} is on the page");
    }
    assert!(page.contains("&lt;script&gt;alert("), "the name is not on the page");
    assert!(page.contains("a &amp; &quot;b&quot;"), "the name is not escaped");
    for name in FILES.iter().filter(|name| name.ends_with(".svg")) {
        let svg = fs::read_to_string(folder.path().join("out").join(name)).expect("a plot");
        assert!(svg.starts_with("<svg xmlns=") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("alert") && !svg.contains("NaN"), "{name}");
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
fn all_files_or_none() {
    let folder = folder();
    write(folder.path(), "record.csv", Cause::GainError);
    // The last file cannot be: a folder has its name.
    fs::create_dir_all(folder.path().join("out/diagnosis.json")).expect("a folder");
    let (code, error) = refused(folder.path(), &["diagnose", "record.csv", "--out", "out"]);
    assert_eq!(code, Some(2), "{error}");
    assert_eq!(names(&folder.path().join("out")), ["diagnosis.json"]);

    let (code, error) = refused(folder.path(), &["diagnose", "record.csv", "--out", "record.csv"]);
    assert_eq!(code, Some(2), "{error}");
    assert!(error.contains("record.csv: cannot be made") && error.contains("expected a folder"), "{error}");

    // A bad record leaves no folder behind.
    fs::write(folder.path().join("bad.csv"), "time_s,voltage_v\n").expect("a file");
    assert_eq!(refused(folder.path(), &["diagnose", "bad.csv", "--out", "new"]).0, Some(2));
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

#[test]
fn a_bad_file_is_named_with_its_place() {
    let folder = folder();
    let good = stair(|_, voltage| voltage);
    let edited = |from: &str, to: &str| good.replacen(from, to, 1);
    for (name, csv, expected) in [
        ("empty", String::new(), "no header; expected one with time_s, voltage_v, stiffness"),
        ("comments", "# nothing\n".to_owned(), "no header; expected one with time_s"),
        ("header", "time_s,voltage_v,stiffness\n".to_owned(), "0 row(s) of data"),
        (
            "few",
            good.lines().take(6).map(|line| format!("{line}\n")).collect(),
            "5 row(s) with a reading; expected at least",
        ),
        ("twice", edited("\n1,", "\n0.5,"), "line 4, column time_s: 0.5 follows 0.5; expected increasing times"),
        ("back", edited("\n1,", "\n0.2,"), "line 4, column time_s: 0.2 follows 0.5"),
        ("text", edited("\n1,0,0\n", "\n1,0,high\n"), "line 4, column stiffness: `high` is not a finite number"),
        ("nan", edited("\n1,0,0\n", "\n1,NaN,0\n"), "line 4, column voltage_v: `NaN` is not a finite number"),
        ("infinite", edited("\n1,0,0\n", "\n1,0,-inf\n"), "line 4, column stiffness: `-inf` is not a finite number"),
        ("hole", edited("\n1,0,0\n", "\n1,0,\n"), "line 4, column stiffness: `` is not a finite number; expected `-`"),
        ("short", edited("\n1,0,0\n", "\n1,0\n"), "line 4: 2 field(s); expected 3"),
        ("voltage", edited("voltage_v", "volts"), "line 1: no column `voltage_v`"),
        ("reading", edited("stiffness", "strain"), "no column `stiffness`"),
    ] {
        let name = format!("{name}.csv");
        fs::write(folder.path().join(&name), csv).expect("a file");
        for more in [&[][..], &["--json"]] {
            let (code, error) = refused(folder.path(), &[&["diagnose", name.as_str()][..], more].concat());
            assert_eq!(code, Some(2), "{name}: {error}");
            assert!(error.contains(&name) && error.contains(expected), "{name}: {error}");
        }
    }
    let (code, error) = refused(folder.path(), &["diagnose", "none.csv"]);
    assert!(code == Some(2) && error.contains("none.csv: cannot be read"), "{error}");
    let (code, error) = refused(folder.path(), &["diagnose", "reading.csv", "--column", "force"]);
    assert!(code == Some(2) && error.contains("no column `force`"), "{error}");
    fs::write(folder.path().join("other.csv"), "time_s,voltage_v,stiffness\n0,0,1\n25,0,1\n").expect("a file");
    let (code, error) = refused(folder.path(), &["diagnose", "other.csv", "--input", "stair"]);
    assert!(code == Some(2) && error.contains("other.csv, line 3, column voltage_v: 0 V at 25 s"), "{error}");
}

/// Poor records are not bad files: they get a verdict, whichever files are asked for.
#[test]
fn a_poor_record_gets_a_verdict() {
    let folder = folder();
    let steady = |voltage: &str, reading: f64| -> String {
        let csv = stair(|time, _| reading + (time * 7919.0).sin());
        let rows = csv.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
        let rows = rows.map(|fields| format!("{},{voltage},{}\n", fields[0], fields[2]));
        std::iter::once("time_s,voltage_v,stiffness\n".to_owned()).chain(rows).collect()
    };
    // Rows are missing in the middle, but none where the voltage changes.
    let whole = Recipe { rows: 600, ..Recipe::of(&[Cause::TimeConstant]) }.draw(3).csv();
    let lines: Vec<&str> = whole.lines().collect();
    let voltage = |line: usize| lines.get(line).and_then(|row| row.split(',').nth(1));
    let changes = |line: usize| voltage(line) != voltage(line - 1) || voltage(line) != voltage(line + 1);
    let kept = (0..lines.len()).filter(|&line| !(250..350).contains(&line) || changes(line));
    let gap: String = kept.map(|line| format!("{}\n", lines[line])).collect();
    for (name, csv, verdicts) in [
        ("constant-voltage", steady("100", 100.0), &["insufficient"][..]),
        ("zero-voltage", steady("0", 0.0), &["insufficient"]),
        ("constant-readings", stair(|_, _| 42.0), &["unexplained"]),
        ("gap", gap, &["explained", "ambiguous"]),
    ] {
        let name = format!("{name}.csv");
        fs::write(folder.path().join(&name), csv).expect("a file");
        let answer = json(folder.path(), &["diagnose", &name, "--json", "--out", &format!("{name}.out")]);
        let verdict = answer["verdict"].as_str().expect("a verdict");
        assert!(verdicts.contains(&verdict), "{name}: {verdict}");
        assert!(verdict == "explained" || answer["next_experiment"].is_string(), "{name}: no way on");
        assert_eq!(names(&folder.path().join(format!("{name}.out"))), FILES, "{name}");
        let page = fs::read_to_string(folder.path().join(format!("{name}.out/report.html"))).expect("a page");
        assert!(page.contains(verdict) && !page.contains("NaN"), "{name}");
        assert!(verdict != "insufficient" || !page.contains("xtended"), "{name}: nothing was extended");
    }
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
    // Readings, the simulation, and two dots in the legend; the command alone is a line.
    assert_eq!((drawn("readings.svg", "<circle"), drawn("readings.svg", "<path")), (2 * 17 + 2, 1));
    // The last row is 16 rows after the first.
    assert_eq!((drawn("autocorrelation.svg", "<circle"), drawn("input_correlation.svg", "<circle")), (16, 17));
}

/// `docs/table3/` is what the diagnosis says of the report's own measurement today.
#[test]
fn the_page_on_table_3_is_up_to_date() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let data = format!("{root}/data/table3_stair.csv");
    let mut today = json(Path::new(root), &["diagnose", &data, "--column", "measured", "--input", "stair", "--json"]);
    let committed = fs::read_to_string(format!("{root}/docs/table3/diagnosis.json")).unwrap();
    let mut committed: Value = serde_json::from_str(&committed).unwrap();
    for report in [&mut today, &mut committed] {
        report["extended"]["model"].take();
    }
    assert_eq!(
        today, committed,
        "run `cargo run --release -- diagnose data/table3_stair.csv --column measured --input stair --out docs/table3`"
    );
    assert_eq!(today["verdict"], "unexplained");
}

/// Readings shifted within a single held-out stretch are named, but no other stretch could have foretold them.
#[test]
fn what_one_stretch_alone_shows_is_no_gain_on_unseen_ones() {
    let csv = papers(1200, |row| if (633..655).contains(&row) { 40.0 } else { 0.0 });
    let folder = folder();
    fs::write(folder.path().join("record.csv"), csv).expect("a file");
    let found = json(folder.path(), &["diagnose", "--json", "record.csv"]);
    assert_eq!(found["findings"][0]["cause"], "reading-offset", "{found}");
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).expect("a number");
    assert!(number("/extended/rmse") < 0.4, "{found}");
    assert!(number("/extended/held_out_rmse") > 0.9 * number("/baseline/held_out_rmse"), "{found}");
    let printed = text(&run(folder.path(), &["diagnose", "record.csv"]).stdout);
    assert!(printed.contains("no other part of the record foretells it"), "{printed}");
}

/// Errors that no cause makes are neither agreement nor outliers, though noise with a memory might look alike for a while.
#[test]
fn what_no_cause_makes_is_unexplained() {
    use std::f64::consts::{PI, TAU};
    let strange = |what: usize, part: f64| match what {
        0 => 20.0 * (PI * part).sin(),
        1 => 30.0 * (-6.0 * part).exp(),
        _ => 10.0 * (TAU * (2.4 * part + 30.0 * part * part)).sin(),
    };
    for (what, place) in ["slow swing", "slow swing", "rhythm that changes"].into_iter().enumerate() {
        let folder = folder();
        let csv = papers(2400, |row| strange(what, f64::from(row) / 2400.0));
        fs::write(folder.path().join("record.csv"), csv).expect("a file");
        let found = json(folder.path(), &["diagnose", "--json", "record.csv"]);
        assert_eq!(found["verdict"], "unexplained", "{place}: {found}");
        assert!(found["leftover"].as_str().expect("a sentence").contains(place), "{place}: {found}");
    }
}
