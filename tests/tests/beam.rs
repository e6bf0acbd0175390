//! The leaf spring and the joint, end to end.

use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use tempfile::tempdir;

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {value}"))
}

fn beam(arguments: &[&str]) -> Value {
    json(tempdir().unwrap().path(), &[&["beam", "--json"], arguments].concat())
}

/// By hand: sum F x / sum x^2, and E = k L^3 / 3 I.
#[test]
fn the_experiment() {
    let found = beam(&[]);
    for (index, slope) in [9350.1 / 45.65, 12579.9 / 45.65, 14725.3 / 45.65].into_iter().enumerate() {
        let line = found.pointer(&format!("/experiment/lines/{index}")).unwrap();
        assert!((number(line, "/all_un_per_mm/value") - slope).abs() < 1e-6, "{line}");
        let pascal = number(line, "/un_per_mm/value") * 6.298_46e6;
        assert!((number(line, "/youngs_modulus_pa/value") / pascal - 1.0).abs() < 1e-4, "{line}");
        assert!(number(line, "/un_per_mm/low") < number(line, "/un_per_mm/value"));
    }
    assert_eq!(number(&found, "/experiment/out_of_line/0/reading/force_un"), 331.0);
    let ratio = number(&found, "/experiment/reach_ratio/value");
    assert!((1.5..1.65).contains(&ratio), "{ratio}");
}

/// The report says which of its layers "droop" under 500 uN: all but aluminium. PET does not: force and weight cancel.
#[test]
fn layers_that_droop() {
    for (thickness, modulus, density, droops) in [
        ("40", "69", "2700", false),
        ("40", "1", "2000", true),
        ("40", "1.7", "2000", true),
        ("40", "3.3", "2000", true),
        ("20", "6", "1150", true),
        ("90", "2.76", "1420", false),
    ] {
        let layer = ["--thickness-um", thickness, "--modulus-gpa", modulus, "--density", density, "--force-un", "500"];
        let found = beam(&layer);
        assert_eq!(found["deflection"]["droops"], droops, "{layer:?}: {}", found["deflection"]);
        let tip = found["deflection"]["places"].as_array().unwrap().last().unwrap();
        let valid = if droops { "/exact_mm" } else { "/linear_mm" };
        assert_eq!(number(tip, "/valid_mm"), number(tip, valid));
        assert!(number(tip, "/exact_mm").abs() < 59.8, "no further than it is long: {tip}");
    }
    let half = beam(&["--at-mm", "29.9", "--thickness-um", "40", "--force-un", "300", "--gravity", "0"]);
    // P x^2 (3 L - x) / 6 E I at half the length: 5/16 of the tip's 2.935 mm.
    let linear = number(&half, "/deflection/places/0/linear_mm");
    assert!((linear - 5.0 / 16.0 * 2.9348).abs() < 1e-3, "{linear}");
}

/// Slip is identified at 0 and 700 V; the line at 400 V and what was measured apart at 700 V then come out.
#[test]
fn layers_that_slip() {
    let found = beam(&["--force-un", "500", "--voltage-v", "700"]);
    let lines = found.pointer("/layers/identified/lines").unwrap().as_array().unwrap();
    assert_eq!(lines.iter().map(|line| line["used"] == true).collect::<Vec<_>>(), [true, false, true]);
    assert!((number(&lines[1], "/linear") / number(&lines[1], "/measured") - 1.0).abs() < 0.002, "{}", lines[1]);
    assert!(number(&found, "/layers/bonded_by_measured") > 5.0);
    for tip in found.pointer("/layers/identified/tips").unwrap().as_array().unwrap() {
        if number(tip, "/voltage_v") == 700.0 {
            assert!((number(tip, "/slip_mm") / number(tip, "/measured_mm") - 1.0).abs() < 0.01, "{tip}");
        }
        assert!(number(tip, "/bonded_mm") < 0.4 * number(tip, "/measured_mm"), "{tip}");
    }
    let tip = number(&found, "/layers/tip_mm");
    assert!((tip - 1.550).abs() < 0.002, "{tip}");
    assert!(number(&found, "/layers/bonded_mm") < tip && tip < number(&found, "/layers/sliding_mm"));
}

#[test]
fn user_defined_layers_and_readings_are_evaluated() {
    let folder = tempdir().unwrap();
    fs::write(
        folder.path().join("l.csv"),
        "material,youngs_modulus_gpa,length_mm,width_mm,thickness_um,count\nsteel,200,50,10,100,2\nPVdF,2,50,10,50,1\n",
    )
    .unwrap();
    // Between sliding layers, 8 N/mm, and bonded layers, 62 N/mm, by the closed formula.
    let readings = "displacement_mm,force_un_0v,force_un_100v\n1,20000,25000\n2,40001,50001\n3,59999,74999\n";
    fs::write(folder.path().join("r.csv"), readings).unwrap();
    let arguments = ["beam", "--json", "--layers", "l.csv", "--stack", "steel,PVdF,steel", "--experiment", "r.csv"];
    let found = json(folder.path(), &arguments);
    assert!((number(&found, "/experiment/lines/1/un_per_mm/value") - 25_000.0).abs() < 1.0);
    assert!(number(&found, "/layers/identified/at_lowest_pa_per_m/low") > 0.0);
    let tips = found.pointer("/layers/identified/tips").unwrap();
    assert_eq!(tips, &Value::Array(Vec::new()), "section 4.1.4 is about another spring");

    // Readings without any scatter.
    fs::write(folder.path().join("r.csv"), "displacement_mm,force_un_0v,force_un_400v\n1,100,150\n2,200,300\n")
        .unwrap();
    let found = json(folder.path(), &["beam", "--json", "--experiment", "r.csv"]);
    assert!((number(&found, "/experiment/reach_ratio/value") - 1.5).abs() < 1e-9);
    assert_eq!(found["experiment"]["out_of_line"], Value::Array(Vec::new()));
}

#[test]
fn the_joint_is_compared_with_the_requirement() {
    let folder = tempdir().unwrap();
    let found =
        json(folder.path(), &["joint", "--json", "--springs", "8", "--inner-radius-mm", "20", "--length-mm", "60"]);
    let [soft, stiff] = ["/springs_n_per_m/0", "/springs_n_per_m/1"].map(|path| number(&found, path));
    assert!((number(&found, "/reach_n_m_per_rad/0") - 8.0 * soft * 0.0064).abs() < 1e-9);
    assert!((number(&found, "/reach_ratio") - stiff / soft).abs() < 1e-9);
    assert!((number(&found, "/required_ratio") - 948.0 / 0.7).abs() < 1e-6);
    // A spring of the same material, 12 times as thick and twice as wide: 2 x 12^3 times the stiffness.
    let thick = json(folder.path(), &["joint", "--json", "--thickness-um", "2280", "--width-mm", "39.6"]);
    let usual = json(folder.path(), &["joint", "--json"]);
    for path in ["/springs_n_per_m/0", "/springs_n_per_m/1", "/reach_n_m_per_rad/1"] {
        assert!((number(&thick, path) / number(&usual, path) - 2.0 * 1728.0).abs() < 1e-6, "{path}");
    }
    let whole = number(&found, "/times/4/shortest_s");
    assert!((whole - 5.5 * (10.0f64 / 11.0 / 0.03).ln()).abs() < 1e-6, "{whole}");
    let said = text(&run(folder.path(), &["joint"]).stdout);
    assert!(said.contains("cannot be met with this material"), "{said}");
    let clamped = json(folder.path(), &["joint", "--json", "--outer-end", "clamped"]);
    let supported = json(folder.path(), &["joint", "--json"]);
    // 4/3 (r^2 + r R + R^2) / R^2 with r = 20 mm and R = 79.8 mm.
    let ratio = 4.0 / 3.0 * (0.02 * 0.02 + 0.02 * 0.0798 + 0.0798 * 0.0798) / (0.0798 * 0.0798);
    let found = number(&clamped, "/reach_n_m_per_rad/0") / number(&supported, "/reach_n_m_per_rad/0");
    assert!((found - ratio).abs() < 1e-9, "{found} {ratio}");
}

/// Each error is one line with the fault, exit code 2, and no file is written.
#[test]
fn bad_input_gives_one_error_line_and_writes_no_file() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("one.csv"), "displacement_mm,force_un_0v\n1,1\n2,2\n3,3\n").unwrap();
    fs::write(folder.path().join("rest.csv"), "displacement_mm,force_un_0v,force_un_9v\n0,1,2\n0,2,1\n").unwrap();
    let down = "displacement_mm,force_un_0v,force_un_9v\n1,-10,100\n2,-20,200\n3,-30,301\n";
    fs::write(folder.path().join("down.csv"), down).unwrap();
    fs::write(folder.path().join("l.csv"), "material,youngs_modulus_gpa\nPET,3\n").unwrap();
    fs::write(folder.path().join("r.csv"), "# balance\ndisplacement_mm,force_un_0v,force_un_9v\n# mm,uN,uN\n1,x,2\n")
        .unwrap();
    for (arguments, expected) in [
        (&["beam", "--length-mm", "0"][..], "--length-mm: length_m = 0 is not allowed"),
        (&["beam", "--width-mm", "-1"], "--width-mm: width_m = -0.001 is not allowed"),
        (&["beam", "--thickness-um", "NaN"], "--thickness-um: thickness_m = NaN"),
        (&["beam", "--modulus-gpa", "0"], "--modulus-gpa: youngs_modulus_pa = 0"),
        (&["beam", "--density", "-1"], "--density: density_kg_per_m3 = -1"),
        (&["beam", "--force-un", "inf"], "--force-un: tip_n = inf"),
        (&["beam", "--gravity", "NaN"], "--gravity: gravity_m_per_s2 = NaN"),
        (&["beam", "--at-mm", "60"], "--at-mm: at_mm = 60 is not allowed: expected 0 to 59.8 mm"),
        (&["beam", "--tolerance", "0"], "--tolerance: tolerance = 0"),
        (&["beam", "--voltage-v", "-1"], "--voltage-v: voltage_v = -1"),
        (&["beam", "--interlayer", "-1"], "--interlayer: interlayer_pa_per_m = -1"),
        (&["beam", "--elements", "0"], "--elements: elements = 0"),
        (&["beam", "--stack", "PET,PVdF,PET"], "--stack: 0 layer(s) of aluminium; expected 2"),
        (&["beam", "--layers", "no.csv"], "no.csv: cannot be read"),
        (&["beam", "--layers", "l.csv"], "l.csv, line 1: no column `length_mm`"),
        (&["beam", "--experiment", "r.csv"], "r.csv, line 4, column force_un_0v: `x` is not a finite number"),
        (&["beam", "--experiment", "one.csv"], "one.csv: the beam experiment has 1 voltage(s); expected at least two"),
        (
            &["beam", "--experiment", "rest.csv"],
            "rest.csv: the beam experiment: readings do not determine the fit; expected",
        ),
        (
            &["beam", "--experiment", "down.csv"],
            "down.csv: the beam experiment at 0 V: a spring constant of -0.0100 N/m: expected 0.0279 N/m (layers slide)",
        ),
        (&["beam", "--length-mm", "1e300"], "--length-mm: length_m = 1e297 is not allowed"),
        (&["joint", "--springs", "0"], "'--springs <N>': 0 is not in 1..=1000000000"),
        (&["joint", "--springs", "5000000000"], "'--springs <N>': 5000000000 is not in 1..=1000000000"),
        (&["joint", "--inner-radius-mm", "-1"], "--inner-radius-mm: inner_radius_m = -0.001"),
        (&["joint", "--thickness-um", "0"], "--thickness-um: thickness_m = 0"),
        (&["joint", "--high", "0.1"], "--high: high_n_m_per_rad = 0.1"),
        (&["joint", "--limit-v", "2000"], "--limit-v: limit_v = 2000"),
        (&["joint", "--stiffness", "NaN"], "--stiffness: stiffness_n_m_per_rad = NaN"),
        (&["joint", "--plant", "no.toml"], "no.toml: cannot be read"),
    ] {
        let output = run(folder.path(), &[arguments, &["--out", "result"]].concat());
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(output.stdout.is_empty() && !folder.path().join("result").exists(), "{arguments:?}");
    }
    for command in ["beam", "joint"] {
        assert!(text(&run(folder.path(), &[command, "--help"]).stdout).contains("Examples:"), "{command}");
    }
}

/// The committed figures and texts are up to date.
#[test]
fn the_documentation_equals_the_output_of_the_commands() {
    let folder = tempdir().unwrap();
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    for (arguments, names) in [
        (&["beam"][..], &["beam/beam.txt", "beam/experiment.svg", "beam/beam.svg", "beam/stack.svg"][..]),
        (&["joint"], &["joint/joint.txt"]),
    ] {
        let made = run(folder.path(), &[arguments, &["--out", arguments[0]]].concat());
        assert!(made.status.success(), "{}", text(&made.stderr));
        for name in names {
            let made = fs::read(folder.path().join(name)).unwrap();
            let committed = fs::read(docs.join(name)).unwrap_or_default();
            assert!(
                committed == made,
                "docs/{name} is out of date: cargo run --release -- {0} --out docs/{0}",
                arguments[0]
            );
        }
    }
}
