//! `vsj stair --plant FILE` with every table of a plant file.

use std::path::Path;
use std::process::{Command, Output};

use tempfile::tempdir;

const WHOLE: &str = include_str!("../../docs/plant.toml");

fn stair(folder: &Path, file: &str, arguments: &[&str]) -> Output {
    std::fs::write(folder.join("plant.toml"), file).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
    command.current_dir(folder).args(["stair", "--plant", "plant.toml"]).args(arguments).output().unwrap()
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

#[test]
fn what_the_tick_does_not_simulate_is_remarked_on_by_every_command_that_runs_it() {
    let folder = tempdir().unwrap();
    let heater = format!("{}\n", WHOLE.replace("voltage = \"V\"", "voltage = \"%\""));
    std::fs::write(folder.path().join("plant.toml"), heater).unwrap();
    for arguments in ["stair --input step", "compare", "export c --out out"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
        command.current_dir(folder.path()).args(arguments.split(' ')).args(["--plant", "plant.toml"]);
        let said = String::from_utf8(command.output().unwrap().stderr).unwrap();
        assert!(said.contains("plant.toml: not simulated: amplifier.delay_s, drift, remarks\n"), "{arguments}: {said}");
        let unit = "plant.toml: the command is in %: every V of target, voltage and stiffness is a %, within the range of --limit-v";
        assert!(said.contains(unit), "{arguments}: {said}");
    }
}

/// A spring identified from a record of which the tick simulates little, and one of which it lacks little.
#[test]
fn an_oscillation_is_refused_above_three_percent_of_the_response_and_remarked_on_below() {
    let folder = tempdir().unwrap();
    let spring = |weight: f64| {
        format!(
            "schema = 1\n[relaxation]\nshare = 0.09\ntau_s = [5.5, 0.4]\nweights = [{}, 0.01]\n[[mode]]\nfreq_hz = 0.003\nzeta = 0.9\n\
             weight = {weight}\nrate_weight = -0.3\n",
            0.9 - weight
        )
    };
    let said = |command: &str, weight: f64| {
        std::fs::write(folder.path().join("plant.toml"), spring(weight)).unwrap();
        let mut vsj = Command::new(env!("CARGO_BIN_EXE_vsj"));
        let output = vsj.current_dir(folder.path()).arg(command).args(["--plant", "plant.toml"]).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for command in ["stair", "compare", "tune", "bound"] {
        let (code, text) = said(command, 0.8);
        let expected = "mode = 0.8 is not allowed: expected 0 to 0.03 of the settled response, because the tick takes oscillations as";
        assert!(code == Some(2) && text.contains(expected) && text.lines().count() == 1, "{command}: {text}");
    }
    let (code, text) = said("stair", 0.02);
    assert_eq!((code, &*text), (Some(0), "vsj: plant.toml: not simulated: mode (2.0 % of the settled response)\n"));
}

/// A square law as an identification writes it, with more points than the tick takes.
#[test]
fn a_law_of_many_points_runs_with_a_remark_on_its_error() {
    let folder = tempdir().unwrap();
    let volts: Vec<f64> = (0..=32).map(|point| 600.0 * f64::from(point) / 32.0).collect();
    let stiffness: Vec<f64> = volts.iter().map(|volts| volts * volts / 600.0).collect();
    let file = format!(
        "schema = 1\n[law]\nvoltage_v = {volts:?}\nstiffness = {stiffness:?}\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n"
    );
    let output = stair(folder.path(), &file, &["--controller", "none", "--json"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(said, "vsj: plant.toml: [law] of 33 points runs with 9, off by at most 0.39 % of its largest\n");
    assert!(output.status.success());
}

#[test]
fn an_extended_spring_behind_its_recorded_amplifier() {
    let folder = tempdir().unwrap();
    let weaker = WHOLE.replace("650.0", "450.0");
    let output = stair(folder.path(), &weaker, &["--json", "--out", "out", "--every", "1"]);
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stderr.clone()).unwrap();
    assert!(said.contains("plant.toml: not simulated: amplifier.delay_s, drift, remarks"), "{said}");
    let report = json(&output);
    let error = report["max_fixed_point_error"].as_f64().unwrap();
    assert!(error > 0.0 && error < 0.15, "the end of the range at a code of the DAC, 0.1 V lower: {error}");
    assert_eq!(report["steps"].as_array().unwrap().len(), 5);
    assert_eq!(report["bound_from"], "reached");
    let first = &report["steps"][0];
    let [bound, t97] = ["bound_t97_s", "t97_s"].map(|name| first[name].as_f64().unwrap_or(f64::INFINITY));
    assert!(bound > 0.0 && bound.is_finite() && t97 >= bound, "{first}");
    assert!((report["steps"][4]["peak_v"].as_f64().unwrap() - 450.0).abs() < 0.2, "{}", report["steps"][4]);
    for name in ["stair.csv", "stiffness.svg", "voltage.svg"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }
    // The options' amplifier applies where it is stricter.
    let report = json(&stair(folder.path(), &weaker, &["--json", "--slew-v-per-s", "50"]));
    assert!(report["limited_ticks"]["slew"].as_u64().unwrap() > 10_000, "{}", report["limited_ticks"]);
}

/// Every block changes the response, which shows that every block is simulated.
#[test]
fn every_table_changes_the_response() {
    let folder = tempdir().unwrap();
    let tables: Vec<&str> = WHOLE.split_inclusive('\n').collect();
    let without = |table: &str| {
        let mut inside = false;
        let kept = tables.iter().filter(|line| {
            inside = if line.starts_with('[') { line.starts_with(table) } else { inside };
            !inside
        });
        kept.copied().collect::<String>()
    };
    let at_the_end = |file: &str| {
        let report = json(&stair(folder.path(), file, &["--json", "--controller", "none"]));
        assert!(report["max_fixed_point_error_without"].as_f64().unwrap() < 0.15);
        report["rows"].as_array().unwrap().last().unwrap()["without_fixed"].as_f64().unwrap()
    };
    let whole = at_the_end(WHOLE);
    let changes = ["[memory]", "[law]", "[leakage]"].map(|table| at_the_end(&without(table)) - whole);
    assert!(changes.iter().all(|change| change.abs() > 1.0), "{changes:?}");
    let changed = at_the_end(&WHOLE.replace("tau_high_s", "# tau_high_s")) - whole;
    assert!(changed > 1.0, "the quicker spring is further: {changed}");
}

#[test]
fn a_spring_that_the_tick_rejects_is_named_with_its_place() {
    let folder = tempdir().unwrap();
    for (from, to, expected) in [
        ("[10.0, 25.0]", "[10.0, -25.0]", "plant.toml, line 15, column 23: thresholds_v = -25 is not allowed"),
        ("weights = [0.8, 0.109]\n", "", "weights = 0 is not allowed: expected 2 weights, one per time constant"),
        ("[leakage]", "[leak]", "plant.toml, line 22, column 2: unknown field `leak`"),
        ("tau_s = 40.0", "tau_s = 0.5", "--plant: leakage.tau_s = 0.5 is not allowed: expected 1 to 100000 s"),
    ] {
        let output = stair(folder.path(), &WHOLE.replace(from, to), &["--rate-hz", "100"]);
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
    }
}
