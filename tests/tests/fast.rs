//! The fast controller, `vsj compare` and `vsj tune`.

use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use tempfile::tempdir;

fn number(value: &Value, field: &str) -> f64 {
    value[field].as_f64().unwrap_or_else(|| panic!("{field} of {value}"))
}

fn docs() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

/// Within 1.05 of the bound and 1 % of overshoot; 0.6 s for all five steps at 1000 V; on an extended spring too.
#[test]
fn every_step_is_as_fast_as_the_amplifier_allows() {
    let folder = tempdir().unwrap();
    let everything = docs().join("plant.toml");
    // Without what it records of its amplifier: 650 V.
    let spring = fs::read_to_string(&everything).unwrap();
    let spring = spring.split("[amplifier]").next().unwrap();
    fs::write(folder.path().join("spring.toml"), spring).unwrap();
    for (plant, limit) in [("paper", "700"), ("paper", "1000"), ("spring.toml", "700"), ("spring.toml", "1000")] {
        let arguments =
            ["stair", "--controller", "fast", "--input", "step", "--plant", plant, "--limit-v", limit, "--json"];
        let report = json(folder.path(), &arguments);
        let steps = report["steps"].as_array().expect("steps");
        assert_eq!(steps.len(), 5);
        for step in steps {
            assert!(number(step, "t97_s") <= 1.05 * number(step, "bound_t97_s"), "{plant} {limit}: {step}");
            assert!(number(step, "overshoot_percent") <= 1.0, "{plant} {limit}: {step}");
            assert!(number(step, "peak_v") <= limit.parse::<f64>().unwrap(), "{plant} {limit}: {step}");
            assert!(plant != "paper" || limit != "1000" || number(step, "t97_s") < 0.6, "{step}");
        }
        assert!(number(&report, "max_fixed_point_error") < 0.1, "{plant} {limit}");
    }
}

/// docs/fast-controller.md shows what the command prints today.
#[test]
fn the_documentation_shows_the_comparison() {
    let folder = tempdir().unwrap();
    let output = run(folder.path(), &["compare"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let page = fs::read_to_string(docs().join("fast-controller.md")).unwrap();
    let stdout = text(&output.stdout);
    assert_eq!(stdout.lines().filter(|line| line.contains(" -> ")).count(), 30);
    for line in stdout.lines() {
        assert!(page.contains(line), "docs/fast-controller.md lacks: {line}");
    }
    let report = json(folder.path(), &["compare", "--limit-v", "800", "--json"]);
    assert_eq!(report["limits"].as_array().expect("limits").len(), 1);
    let step = &report["limits"][0]["steps"][4];
    assert!(number(&step["fast"], "t97_s") < number(&step["paper"], "t97_s"), "{step}");
    assert_eq!(step["none"]["t97_s"], Value::Null);
}

/// What it prints, `vsj stair` takes, and finds what was promised; the files are those of `docs/tune`.
#[test]
fn tuned_settings_do_what_is_said_of_them() {
    let folder = tempdir().unwrap();
    let known = ["--known", "tau=2", "--known", "share=2", "--known", "gain=1"];
    let of = ["tune", "--limit-v", "1000", "--overshoot-percent", "2", "--out", "tune"];
    let output = run(folder.path(), &[&of[..], &known].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let stdout = text(&output.stdout);
    let tuning: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("tune/tune.json")).unwrap()).unwrap();
    assert_eq!(tuning["trade"].as_array().expect("trade").len(), 63);
    let commands: Vec<&str> = stdout.lines().filter_map(|line| line.trim().strip_prefix("vsj ")).collect();
    assert_eq!(commands.len(), 2, "{stdout}");
    for (command, promised) in commands.into_iter().zip([&tuning["proportional_integral"], &tuning["fast"]]) {
        let mut arguments: Vec<&str> = command.split_whitespace().collect();
        arguments.push("--json");
        let report = json(folder.path(), &arguments);
        let worst = |field: &str| {
            report["steps"].as_array().unwrap().iter().map(|step| number(step, field)).fold(0.0, f64::max)
        };
        assert!((worst("t97_s") - number(promised, "t97_s")).abs() < 0.002, "{command}: {promised}");
        assert!(
            (worst("overshoot_percent") - number(promised, "overshoot_percent")).abs() < 0.1,
            "{command}: {promised}"
        );
        assert!(worst("overshoot_percent") <= 2.1);
    }
    let page = fs::read_to_string(docs().join("fast-controller.md")).unwrap();
    let (_, within) = stdout.split_once("\nOn a spring that is known").expect("the errors are known");
    for line in within.lines().take_while(|line| !line.starts_with("wrote ")) {
        assert!(page.contains(line), "docs/fast-controller.md lacks: {line}");
    }
    robust_beside_others(folder.path(), &tuning["uncertainty"], &known);
    for name in ["tune.txt", "trade.csv", "t97.svg", "overshoot.svg"] {
        let committed = fs::read(docs().join("tune").join(name)).unwrap();
        let made = fs::read(folder.path().join("tune").join(name)).unwrap();
        assert!(
            committed == made,
            "docs/tune/{name} is old: cargo run --release -- tune --limit-v 1000 --overshoot-percent 2 {} --out docs/tune",
            known.join(" ")
        );
    }
}

/// The robust controller keeps the overshoot that the others exceed, is as fast on its nominal spring as in `vsj compare`, and what
/// each parameter has to be known to is what `vsj bound` says.
fn robust_beside_others(folder: &Path, uncertainty: &Value, known: &[&str]) {
    let controllers = uncertainty["controllers"].as_array().expect("controllers");
    let names: Vec<&str> = controllers.iter().filter_map(|it| it["controller"].as_str()).collect();
    assert_eq!(names, ["paper", "fast", "robust"]);
    let overshoot = |at: usize, of: &str| number(&controllers[at][of], "overshoot_percent");
    assert!(overshoot(2, "guaranteed") <= 2.1 && overshoot(1, "guaranteed") > 2.1, "{uncertainty}");
    for at in 0..3 {
        assert!(overshoot(at, "nominal") <= overshoot(at, "guaranteed") + 0.01, "{uncertainty}");
        assert!(overshoot(at, "worst_95") <= overshoot(at, "guaranteed") + 0.01, "{uncertainty}");
    }
    let compared = json(folder, &[&["compare", "--limit-v", "1000", "--json"], known].concat());
    let steps = compared["limits"][0]["steps"].as_array().expect("steps");
    let slowest = steps.iter().map(|step| number(&step["robust"], "t97_s")).fold(0.0, f64::max);
    assert!((number(&controllers[2]["nominal"], "t97_s") - slowest).abs() < 0.003, "{slowest}: {uncertainty}");
    assert_eq!(uncertainty["needed"], json(folder, &["bound", "--json"])["needed"]);
}

/// Slowest t97 in s, a dash if a step does not reach 97 %, and largest overshoot in percent, of the fast controller up to 1000 V.
fn fast_on(folder: &Path, options: &[&str]) -> (Option<f64>, f64) {
    let report = json(folder, &[&["compare", "--limit-v", "1000", "--json"], options].concat());
    let steps = report["limits"][0]["steps"].as_array().expect("steps");
    let t97_s: Option<Vec<f64>> = steps.iter().map(|step| step["fast"]["t97_s"].as_f64()).collect();
    let overshoot = steps.iter().map(|step| number(&step["fast"], "overshoot_percent")).fold(0.0, f64::max);
    (t97_s.map(|times| times.into_iter().fold(0.0, f64::max)), overshoot)
}

/// The table of docs/fast-controller.md is what the command computes today; a sensor keeps all steps but those of a weaker spring, which
/// no controller drives faster, within 0.6 s.
#[test]
fn the_documentation_shows_what_an_error_of_the_model_costs_and_a_sensor_saves() {
    let folder = tempdir().unwrap();
    let page = fs::read_to_string(docs().join("fast-controller.md")).unwrap();
    for key in ["tau", "gain", "share"] {
        for percent in ["10", "-10"] {
            let error = format!("{key}={percent}");
            let without = fast_on(folder.path(), &["--spring-error", &error]);
            let with = fast_on(folder.path(), &["--spring-error", &error, "--sensor-noise", "0.2"]);
            let cells = |(t97_s, overshoot): (Option<f64>, f64)| {
                format!("{} | {overshoot:.2}", t97_s.map_or("-".to_owned(), |t97_s| format!("{t97_s:.3}")))
            };
            let row = format!("| `{error}` | {} | {} |", cells(without), cells(with));
            assert!(page.contains(&row), "docs/fast-controller.md lacks: {row}");
            let limit_s = if error == "gain=-10" { 0.67 } else { 0.6 };
            assert!(with.0.is_some_and(|t97_s| t97_s < limit_s), "{error}: {with:?}");
            assert!(with.1 <= without.1.max(2.0), "{error}: {with:?}, without {without:?}");
        }
    }
}

/// docs/fast-controller.md shows what the command prints today; the intervals of an identification are errors as well.
#[test]
fn the_documentation_shows_how_well_the_spring_has_to_be_known() {
    let folder = tempdir().unwrap();
    let page = fs::read_to_string(docs().join("fast-controller.md")).unwrap();
    let output = run(folder.path(), &["bound", "--spring-error", "tau=5"]);
    let stdout = text(&output.stdout);
    assert!(output.status.success() && page.contains(stdout.trim_end()), "docs/fast-controller.md lacks: {stdout}");
    let quantity =
        |value: f64, half: f64| serde_json::json!({"value": value, "low": value - half, "high": value + half});
    let nominal = serde_json::json!({
        "gain": quantity(2.0, 0.0), "share": quantity(0.1, 0.0), "tau_s": [quantity(5.5, 0.275)]
    });
    fs::write(folder.path().join("identified.json"), serde_json::json!({ "nominal": nominal }).to_string()).unwrap();
    let report = json(folder.path(), &["bound", "--identified", "identified.json", "--json"]);
    let error = number(&report["spring_error"], "time_constant");
    assert!((error - 0.05).abs() < 1e-9, "{report}");
    let times = report["steps"].as_array().unwrap().iter().map(|step| number(step, "t97_s"));
    assert!(stdout.contains(&format!("{:.3}", times.fold(0.0, f64::max))), "{report} {stdout}");
}

/// The heater's command is in percent, and its law ends there: targets of 100 to 500 % would be beyond its range.
#[test]
fn steps_are_within_the_range_of_the_spring() {
    let folder = tempdir().unwrap();
    let units = "schema = 1\n[units]\nvoltage = \"%\"\n[relaxation]\nshare = 0.1\ntau_s = 4.0\n";
    let law = "[law]\nvoltage_v = [0.0, 50.0, 100.0]\nstiffness = [0.0, 25.0, 100.0]\n";
    let limit = "[amplifier]\nlimit_v = 100.0\n";
    for (name, plant, options) in [
        ("limit.toml", units.to_owned() + limit, &["--limit-v", "700"][..]),
        ("volts.toml", units.replace('%', "V") + limit, &["--limit-v", "700"]),
        ("option.toml", units.to_owned(), &["--limit-v", "100"]),
        ("law.toml", units.to_owned() + law, &["--limit-v", "700"]),
        ("range.toml", units.to_owned() + "[range]\nlowest_v = 0\nhighest_v = 70\n", &["--limit-v", "700"]),
    ] {
        fs::write(folder.path().join(name), plant).unwrap();
        let answer = |command| json(folder.path(), &[&[command, "--plant", name, "--json"], options].concat());
        let compared = answer("compare");
        let steps = compared["limits"][0]["steps"].as_array().unwrap();
        let ends: Vec<f64> = steps.iter().map(|step| number(&step["fast"], "to_v")).collect();
        assert_eq!(ends, [10.0, 20.0, 30.0, 40.0, 50.0], "{name}");
        assert!(steps.iter().all(|step| number(&step["fast"], "t97_s") < 1.0), "{name}: {compared}");
        assert!(answer("tune")["fast"]["t97_s"].is_number(), "{name}");
        let stair = answer("stair");
        assert_eq!(stair["steps"][4]["to_v"], 50.0, "{name}");
        assert_eq!(stair["rows"].as_array().unwrap().last().unwrap()["voltage_v"], 50.0, "{name}");
        if !["law.toml", "range.toml"].contains(&name) {
            let bound = answer("bound");
            assert!(bound["steps"][4]["known_s"].is_number() && bound["steps"][4]["to_v"] == 50.0, "{name}: {bound}");
        }
    }
    let said = run(folder.path(), &["tune", "--plant", "limit.toml"]);
    let remark = "vsj: limit.toml: the stair has steps of 10 % up to 50 %, within the spring's own range\n";
    assert!(text(&said.stderr).ends_with(remark), "{}", text(&said.stderr));
}

/// At the errors that `--known` has by default.
#[test]
fn a_fall_back_that_has_no_effect_is_a_remark() {
    let folder = tempdir().unwrap();
    let stair: &[&str] = &["stair", "--controller", "robust", "--input", "step", "--out", "result"];
    for command in [stair, &["compare"], &["tune", "--overshoot-percent", "2"]] {
        let said = |share: &str| {
            let options = ["--limit-v", "1000", "--known", "tau=5", "--known", share, "--fall-back-percent", "12.5"];
            let output = run(folder.path(), &[command, &options].concat());
            assert!(output.status.success(), "{}", text(&output.stderr));
            text(&output.stderr).contains("a fall back by 12.5 % has no effect within these errors: it helps where")
        };
        assert!(said("share=5") && !said("share=0"), "{command:?}");
    }
}

/// A spring without an instantaneous share, as a record shows it: the error of the share is a part of the response.
#[test]
fn a_share_near_zero_is_known_to_a_part_of_the_response() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("plant.toml"), "schema = 1\n[relaxation]\nshare = 0.0\ntau_s = 4.0\n").unwrap();
    let interval =
        |value: f64, half: f64| serde_json::json!({"value": value, "low": value - half, "high": value + half});
    let identified = |share: serde_json::Value, tau_half: f64| {
        let nominal =
            serde_json::json!({"gain": interval(2.0, 0.002), "share": share, "tau_s": [interval(4.0, tau_half)]});
        fs::write(folder.path().join("identify.json"), serde_json::json!({ "nominal": nominal }).to_string()).unwrap();
    };
    let arguments = |command| [command, "--limit-v", "1000", "--plant", "plant.toml", "--identified", "identify.json"];
    let slowest =
        |json: &Value| json["steps"].as_array().unwrap().iter().map(|step| number(step, "t97_s")).fold(0.0, f64::max);
    let mut times = Vec::new();
    for half in [0.001, 0.06] {
        identified(interval(-1e-5, half), 0.004);
        let output = run(folder.path(), &[&arguments("bound")[..], &["--json"]].concat());
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
        let bound: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!((number(&bound["spring_error"], "share_of_response") - half).abs() < 1e-9, "{bound}");
        times.push(slowest(&bound));
    }
    assert!(times[0] < 0.9 * times[1], "{times:?}");
    // So is how well it has to be known: a quarter of next to nothing says nothing.
    let bound = run(folder.path(), &["bound", "--within-s", "2", "--plant", "plant.toml"]);
    let share = text(&bound.stdout).lines().find(|line| line.starts_with("  share ")).unwrap().to_owned();
    assert!(share.contains(" %") && share.contains(" of the response"), "{share}");
    let tuned = run(folder.path(), &arguments("tune"));
    assert!(text(&tuned.stdout).contains("known to within errors: share to +-6.000 % of the response, time constant"));
    let remark =
        "vsj: the robust controller's margin is 25 % of a share of 0.000 %; its error is 6.000 % of the response\n";
    assert_eq!(text(&tuned.stderr), remark);
    for (share, tau_half, expected) in [
        (interval(0.0, 0.02), 1.6, "vsj: --identified: time constant known to 40 %; expected 0 to 25\n"),
        (interval(0.0, 2.0), 0.1, "vsj: --identified: share known to 200 % of the response; expected 0 to 100\n"),
    ] {
        identified(share, tau_half);
        let output = run(folder.path(), &arguments("tune"));
        assert_eq!((output.status.code(), text(&output.stderr)), (Some(2), expected.to_owned()));
    }
}

#[test]
fn what_cannot_be_run_is_one_line_and_exit_code_2() {
    let folder = tempdir().unwrap();
    let falling = "schema = 1\n[law]\nvoltage_v = [0, 300, 600]\nstiffness = [0, 300, 250]\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n";
    fs::write(folder.path().join("falling.toml"), falling).unwrap();
    for (arguments, expected) in [
        (
            &["stair", "--controller", "fast", "--approach-s", "2"][..],
            "--approach-s: approach_s = 2 is not allowed: expected 0 to 1 s",
        ),
        (&["stair", "--controller", "fast", "--plant", "falling.toml"], "--plant: law.stiffness = 250 is not allowed"),
        (&["compare", "--plant", "falling.toml"], "--plant: law.stiffness = 250 is not allowed"),
        (&["compare", "--limit-v", "400"], "expected 0 to 400 V"),
        (&["tune", "--plant", "falling.toml"], "--plant: law.stiffness = 250 is not allowed"),
        (&["tune", "--plant", "no.toml"], "no.toml: cannot be read"),
        (&["compare", "--spring-error", "mass=3"], "`mass=3`: expected tau, gain or share, then `=` and -90 to 900"),
        (&["compare", "--spring-error", "tau=inf"], "`tau=inf`: expected tau, gain or share"),
        (&["compare", "--spring-error", "tau=1", "--spring-error", "tau=2"], "time constant twice"),
        (&["bound", "--plant", "falling.toml"], "the plant has [law]; expected a linear spring"),
        (&["bound", "--spring-error", "gain=-3"], "--spring-error: gain known to -3 %; expected 0 to 90"),
        (&["bound", "--identified", "falling.toml"], "expected the JSON of `vsj identify`"),
        (&["bound", "--limit-v", "5"], "--limit-v: full_scale_v = 5 is not allowed"),
        (&["bound", "--within-s", "nan"], "--within-s NaN: expected a number above 0"),
        (&["tune", "--known", "gain=-3"], "--known: gain known to -3 %; expected 0 to 90"),
        (&["tune", "--known", "tau=30"], "--known: margin.time_constant = 0.3 is not allowed: expected 0 to 0.25"),
        (&["tune", "--identified", "falling.toml"], "expected the JSON of `vsj identify`"),
        (&["tune", "--within-s", "0"], "--within-s 0: expected a number above 0"),
        (&["stair", "--controller", "fast", "--known", "tau=5"], "--known applies to the robust controller only"),
        (&["stair", "--controller", "fast", "--kp", "5"], "--kp and --ki apply to the paper controller only"),
        (&["export", "c", "--known", "tau=3", "--ki", "1"], "--kp and --ki apply to the paper controller only"),
        (&["export", "c", "--known", "tau=30"], "--known: margin.time_constant = 0.3 is not allowed"),
        (&["export", "fmu", "--controller", "paper", "--known", "tau=3"], "--known applies to the robust controller"),
        (&["compare", "--sensor-noise", "0"], "--sensor-noise 0: expected 0.001 to 10"),
        (&["compare", "--limit-v", "nan"], "--limit-v: full_scale_v = NaN is not allowed"),
        (&["compare", "--slew-v-per-s", "0"], "--slew-v-per-s: slew_v_per_s = 0 is not allowed"),
        (&["tune", "--limit-v", "2000"], "--limit-v: full_scale_v = 2000 is not allowed"),
        (&["tune", "--rate-hz", "5"], "--rate-hz: rate_hz = 5 is not allowed"),
        (&["tune", "--overshoot-percent", "NaN"], "--overshoot-percent NaN: expected 0 to 100"),
    ] {
        let output = run(folder.path(), arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{arguments:?}: {stderr}");
    }
    for command in ["compare", "tune"] {
        assert!(text(&run(folder.path(), &[command, "--help"]).stdout).contains("Examples:"));
    }
}
