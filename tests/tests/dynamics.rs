//! `vsj dynamics`: the report's dynamic models.

use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use tempfile::tempdir;

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {value}"))
}

fn dynamics(arguments: &[&str]) -> Value {
    json(tempdir().unwrap().path(), &[&["dynamics", "--json"], arguments].concat())
}

/// Last row at or before `time_s`.
fn at(report: &Value, time_s: f64) -> &Value {
    let rows = report["rows"].as_array().expect("rows");
    rows.iter().rfind(|row| number(row, "/time_s") <= time_s + 1e-9).expect("a row")
}

/// Section 8.2.1: D = 10, F = 10, K = 1, 4, 7, 1; initially e = F/K (1 - exp(-K t / D)).
#[test]
fn the_simplified_model_with_the_report_s_input() {
    let report = dynamics(&["spring-damper", "--every", "1"]);
    let elongation = |time: f64| number(at(&report, time), "/elongation_m");
    assert!((elongation(20.1) - 10.0 * (1.0 - (-2.0f64).exp())).abs() < 1e-6);
    assert!((elongation(60.0) - 2.5).abs() < 1e-3 && (elongation(90.0) - 10.0 / 7.0).abs() < 1e-6);
    assert!(
        text(&run(tempdir().unwrap().path(), &["dynamics", "spring-damper"]).stdout).contains("no plant with Kp > 0")
    );
}

#[test]
fn the_analogue_circuit_agrees_with_the_zener_model() {
    for changes in ["k1", "k2", "both"] {
        let arguments = ["--changes", changes, "--every", "1"];
        let springs = dynamics(&[&["zener"], &arguments[..]].concat());
        let circuit = dynamics(&[&["analogue"], &arguments[..]].concat());
        assert!(number(&circuit, "/analogue_difference") < 1e-5, "{changes}");
        assert!(number(&circuit, "/analogue_difference") > 0.0, "the two are computed independently");
        for (one, other) in springs["rows"].as_array().unwrap().iter().zip(circuit["rows"].as_array().unwrap()) {
            let difference = number(one, "/elongation_m") - number(other, "/elongation_m");
            assert!(difference.abs() < 1e-4, "{changes}: {one} {other}");
        }
    }
}

/// Kp = K2/K1 and tau = D/K2 in both directions, and the plant's column of Table 3.
#[test]
fn the_plant_and_its_zener_model_convert_into_each_other() {
    let zener = dynamics(&["zener", "--k1", "20", "--k2", "2", "--damper", "11"]);
    assert!((number(&zener, "/plant/proportional") - 0.1).abs() < 1e-12);
    assert!((number(&zener, "/plant/integral_per_s") - 0.2).abs() < 1e-12);
    let plant = dynamics(&["pi-plant", "--input", "stair", "--every", "0.1", "--k2", "2"]);
    assert!((number(&plant, "/zener_of_plant/k1_n_per_m") - 20.0).abs() < 1e-9);
    assert!((number(&plant, "/zener_of_plant/damper_n_s_per_m") - 11.0).abs() < 1e-9);
    for (time, printed) in [(20.1, 9.91), (31.0, 111.09), (65.0, 455.88)] {
        let found = number(at(&plant, time), "/stiffness");
        assert!((0.0..0.01).contains(&(found - printed)), "{time}: {found}");
    }
    // The plant has a constant time constant, that of the model depends on its stiffness: they deviate with larger
    // changes.
    let stand_in = &plant["stand_in"];
    assert!(number(stand_in, "/ratio_at_1_percent") < number(stand_in, "/ratio_at_5_percent"));
    assert!(number(stand_in, "/ratio_at_5_percent") < number(stand_in, "/material_ratio"));
    assert!(number(stand_in, "/material_up_percent") > 5.0);
}

/// A week with one row per hour: the drawn curve must not be finer than the model's time step.
#[test]
fn an_input_of_a_week_is_simulated() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("week.csv"), "time_s,voltage_v\n0,100\n604800,100\n").unwrap();
    let arguments = ["dynamics", "pi-plant", "--json", "--input", "week.csv", "--every", "3600", "--out", "made"];
    let week = json(folder.path(), &arguments);
    assert_eq!(week["rows"].as_array().unwrap().len(), 169);
    assert!((number(at(&week, 604_800.0), "/stiffness") - 100.0).abs() < 1e-9);
}

#[test]
fn files_are_written_and_the_documentation_is_up_to_date() {
    let folder = tempdir().unwrap();
    let output = run(folder.path(), &["dynamics", "analogue", "--changes", "both", "--out", "made"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let csv = fs::read_to_string(folder.path().join("made/response.csv")).unwrap();
    assert!(csv.lines().any(|line| line == "time_s,level,elongation_m,stiffness"));
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/dynamics");
    for name in ["response.csv", "response.svg"] {
        let made = fs::read(folder.path().join("made").join(name)).unwrap();
        let command = "cargo run --release -- dynamics analogue --changes both --out docs/dynamics";
        assert!(
            fs::read(docs.join(name)).unwrap_or_default() == made,
            "docs/dynamics/{name} is out of date: {command}"
        );
    }
}

#[test]
fn bad_input_gives_one_error_line_and_writes_no_file() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("zero.csv"), "time_s,voltage_v\n0,1\n1,0\n2,0\n").unwrap();
    for (arguments, expected) in [
        (&["zener", "--k1", "0"][..], "--k1: k1_n_per_m = 0 is not allowed"),
        (&["zener", "--k2", "-1"], "--k2: k2_n_per_m = -1"),
        (&["analogue", "--damper", "NaN"], "--damper: damper_n_s_per_m = NaN"),
        (&["spring-damper", "--force", "inf"], "--force: force_n = inf"),
        (&["spring-damper", "--length", "-1"], "--length: length_m = -1"),
        (&["pi-plant", "--kp", "-1"], "--kp: proportional = -1"),
        (&["pi-plant", "--ki", "0"], "--ki: integral_per_s = 0"),
        (&["zener", "--every", "0"], "--every: every_s = 0"),
        (&["zener", "--every", "1e-5"], "--every: every_s = 0.00001 is not allowed: expected at least a millionth"),
        (&["analogue", "--damper", "1e-6"], "time constant of 0.00000014"),
        (&["zener", "--input", "zero.csv"], "zero.csv: level 0 at 1 s is not a stiffness"),
        (&["zener", "--input", "no.csv"], "no.csv: cannot be read"),
        (&["rubber"], "invalid value 'rubber' for '<MODEL>'"),
        (&[], "<MODEL>"),
    ] {
        let output = run(folder.path(), &[&["dynamics", "--out", "result"], arguments].concat());
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(output.stdout.is_empty() && !folder.path().join("result").exists(), "{arguments:?}");
    }
    assert!(text(&run(folder.path(), &["dynamics", "--help"]).stdout).contains("Examples:"));
}
