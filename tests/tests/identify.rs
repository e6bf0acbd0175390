//! `vsj identify`: the spring that a record shows.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use random_numbers::Lcg32;
use serde_json::Value;
use tempfile::tempdir;

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {value}"))
}

/// A record in newtons with a gain of -0.02 N/V, a zero of 7 N, a share of 0.3 and a lag of 50 ms, by its exact recursion.
fn record(zero: f64) -> String {
    let (mut lag, mut voltage, mut numbers) = (0.0, 0.0, Lcg32::new(5));
    let mut text = "time_s,voltage_v,force\n".to_owned();
    for row in 0..600 {
        if row % 25 == 0 {
            voltage = 400.0 * numbers.uniform();
        }
        let force = zero - 0.02 * (0.3 * voltage + 0.7 * lag) + 0.01 * (numbers.uniform() - 0.5);
        writeln!(text, "{},{voltage},{force}", 0.005 * f64::from(row)).unwrap();
        lag = voltage + (lag - voltage) * f64::exp(-0.005 / 0.05);
    }
    text
}

#[test]
fn a_force_in_newtons_is_identified() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("force.csv"), record(7.0)).unwrap();
    let report = json(folder.path(), &["identify", "force.csv", "--column", "force", "--json", "--out", "made"]);
    assert_eq!(report["schema"], 1);
    assert_eq!(report["rows"], 600);
    assert_eq!(report["order"], 1);
    assert_eq!(report["model"], "made/plant.toml");
    for (quantity, expected, near) in [
        ("gain", -0.02, 1e-5),
        ("zero", 7.0, 0.01),
        ("share", 0.3, 0.01),
        ("delay_s", 0.0, 1e-9),
        ("tau_s/0", 0.05, 1e-3),
    ] {
        let of = |field: &str| number(&report, &format!("/nominal/{quantity}/{field}"));
        assert!((of("value") - expected).abs() < near, "{quantity}: {report}");
        assert!(of("low") <= of("value") && of("value") <= of("high"), "{quantity}: {report}");
    }
    // The spring is linear, and its command is in V: whether it can be quick enough is the next question.
    let command = report["bound_command"].as_str().unwrap();
    assert_eq!(command, "vsj bound --plant made/plant.toml --identified made/identify.json");
    let said = run(folder.path(), &["identify", "force.csv", "--column", "force", "--out", "made"]);
    assert!(text(&said.stdout).contains(&format!("How fast a controller can be with what is known: {command}\n")));
    let held_out = number(&report, "/held_out_rmse");
    assert!((0.0028..0.0031).contains(&held_out), "{held_out}: uniform noise of 0.01 N");
    let linear = report["linear"].as_array().unwrap();
    assert_eq!(linear.iter().map(|linear| linear["order"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2, 3, 4]);
    assert!(number(&report, "/static_held_out_rmse") > 10.0 * held_out);

    for file in ["report.html", "plant.toml", "identify.json"] {
        assert!(folder.path().join("made").join(file).is_file(), "{file}");
    }
    let page = fs::read_to_string(folder.path().join("made/report.html")).unwrap();
    assert!(page.contains("600 readings show one time constant.") && page.contains("<svg"));
    let bound = run(folder.path(), &command.split(' ').skip(1).collect::<Vec<_>>());
    assert!(bound.status.success(), "{}", text(&bound.stderr));
    let other = record(7.0).replace("voltage_v", "current_A");
    fs::write(folder.path().join("current.csv"), other).unwrap();
    let options = ["--voltage", "current_A:A", "--reading", "force:N", "--json", "--out", "other"];
    assert_eq!(
        json(folder.path(), &[&["identify", "current.csv"][..], &options].concat())["bound_command"],
        Value::Null
    );
    let written: Value = serde_json::from_slice(&fs::read(folder.path().join("made/identify.json")).unwrap()).unwrap();
    assert_eq!(written, report);
    let plant = fs::read_to_string(folder.path().join("made/plant.toml")).unwrap();
    assert!(plant.contains("[reading]\ngain = -0.0") && plant.contains("[units]"), "{plant}");
}

#[test]
fn order_of_the_model_can_be_given() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("force.csv"), record(7.0)).unwrap();
    let steps: String = (0..40).map(|row| format!("{row},{},{}\n", row / 5, row / 5 + row % 2)).collect();
    fs::write(folder.path().join("short.csv"), format!("time_s,voltage_v,force\n{steps}")).unwrap();
    let of =
        |order: &str| json(folder.path(), &["identify", "force.csv", "--column", "force", "--order", order, "--json"]);
    let chosen = json(folder.path(), &["identify", "force.csv", "--column", "force", "--json"]);
    let (one, two) = (of("1"), of("2"));
    assert_eq!(one["nominal"], chosen["nominal"]);
    assert_eq!(one["remarks"], chosen["remarks"]);
    assert_eq!((&two["order"], &two["linear"]), (&Value::from(2), &chosen["linear"]));
    let poles = two["nominal"]["tau_s"].as_array().unwrap().len() + 2 * two["oscillation"].as_array().unwrap().len();
    assert_eq!(poles, 2, "{two}");
    assert_eq!(two["held_out_rmse"], two["linear"][1]["held_out_rmse"]);
    assert_eq!(two["remarks"][0], "Order 2 was asked for; the held-out errors are in favour of order 1.");
    for (file, order, expected) in [
        ("force.csv", "0", "order 0: expected 1 to 4\n"),
        ("force.csv", "5", "order 5: expected 1 to 4\n"),
        ("short.csv", "4", "order 4: expected 1 to 3; a model of order 4 is not tried with fewer than 45 readings\n"),
    ] {
        let refused = run(folder.path(), &["identify", file, "--column", "force", "--order", order]);
        assert_eq!(refused.status.code(), Some(2), "{refused:?}");
        assert!(text(&refused.stderr).ends_with(expected), "{}", text(&refused.stderr));
    }
}

#[test]
fn two_records_of_one_spring_have_their_own_zeros() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("a.csv"), record(7.0)).unwrap();
    fs::write(folder.path().join("b.csv"), record(-4.0)).unwrap();
    let report = json(folder.path(), &["identify", "a.csv", "b.csv", "--column", "force", "--json"]);
    assert_eq!(report["rows"], 1200);
    assert_eq!((&report["model"], &report["bound_command"]), (&Value::Null, &Value::Null));
    for (record, zero) in [(0, 7.0), (1, -4.0)] {
        assert!((number(&report, &format!("/start/{record}/zero/value")) - zero).abs() < 0.01, "{report}");
    }
}

#[test]
fn bad_records_are_named_in_one_line() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("still.csv"), "time_s,voltage_v,stiffness\n".to_owned() + &rows(|_| 5.0)).unwrap();
    for (arguments, expected) in [
        (vec!["identify", "still.csv"], "still.csv: the voltage never changes"),
        (vec!["identify", "still.csv", "--column", "force"], "no column `force`"),
        (vec!["identify"], "not provided: <DATA.csv>"),
        (vec!["identify", "still.csv", "--input", "stair"], "--input stair: expected hold or linear"),
    ] {
        let output = run(folder.path(), &arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected) && said.lines().count() == 1, "{said}");
    }
}

fn rows(voltage: impl Fn(u32) -> f64) -> String {
    (0..20).map(|row| format!("{row},{},{}\n", voltage(row), row % 3)).collect()
}

/// The page quotes what the command prints.
#[test]
fn documentation_is_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let output = run(&root, &["identify", "data/sample_hysteresis.csv"]);
    let page = fs::read_to_string(root.join("docs/identify.md")).unwrap();
    let said = text(&output.stdout);
    assert!(page.contains(said.trim_end()), "docs/identify.md should quote:\n{said}");
}

#[test]
fn records_of_different_quantities_are_refused() {
    let folder = tempdir().unwrap();
    for (name, header) in [
        ("mm.csv", "time_s,u [V],x [mm]"),
        ("newton.csv", "time_s,u [V],x [N]"),
        ("percent.csv", "time_s,u [%],x [mm]"),
        ("kilovolt.csv", "time_s,u [kV],x [mm]"),
    ] {
        fs::write(folder.path().join(name), record(7.0).replace("time_s,voltage_v,force", header)).unwrap();
    }
    for command in ["identify", "diagnose"] {
        for (second, line) in [
            ("newton.csv", "vsj: newton.csv: unit of the reading: N; expected mm as in mm.csv\n"),
            ("percent.csv", "vsj: percent.csv: unit of the voltage: %; expected V as in mm.csv\n"),
        ] {
            let refused = run(folder.path(), &[command, "mm.csv", second, "--voltage", "u", "--reading", "x"]);
            assert_eq!(refused.status.code(), Some(2));
            assert_eq!(text(&refused.stderr), line);
        }
    }
    let volts = run(folder.path(), &["identify", "mm.csv", "kilovolt.csv", "--voltage", "u", "--reading", "x"]);
    assert!(volts.status.success(), "{}", text(&volts.stderr));
}
