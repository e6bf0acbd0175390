//! `vsj plan`: the next experiment decides what a diagnosis left undecided.

use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tempfile::{TempDir, tempdir};
use validation::ground_truth::{Cause, Effect, LabelledRecord, Noise, Schedule};

/// A stair that only rises, under which hysteresis looks like a static law.
fn rising() -> Schedule {
    let time_s: Vec<f64> = (0..600).map(|row| f64::from(row) / 10.0).collect();
    let voltage_v = time_s.iter().map(|time| (100.0 * ((time - 4.0) / 8.0).ceil()).clamp(0.0, 500.0)).collect();
    Schedule { time_s, voltage_v }
}

/// The voltages of a written schedule, sampled every 0.1 s.
fn played(path: &Path) -> Schedule {
    let text = fs::read_to_string(path).expect("a schedule");
    let numbers = |line: &str| -> Option<(f64, f64)> {
        let (time, voltage) = line.split_once(',')?;
        Some((time.parse().ok()?, voltage.parse().ok()?))
    };
    let rows: Vec<(f64, f64)> = text.lines().filter_map(numbers).collect();
    let end_s = rows.last().expect("rows").0;
    let time_s: Vec<f64> = (0u32..).map(|row| f64::from(row) / 10.0).take_while(|time| *time < end_s - 0.05).collect();
    let at = |time: &f64| rows[rows.partition_point(|row| row.0 <= time + 1e-6) - 1].1;
    Schedule { voltage_v: time_s.iter().map(at).collect(), time_s }
}

fn causes(report: &Value) -> Vec<&str> {
    report["findings"].as_array().expect("findings").iter().map(|it| it["cause"].as_str().expect("a cause")).collect()
}

/// A folder with the record `first.csv` of a spring with one cause, and its diagnosis `first.json`.
fn diagnosed(cause: Cause, seed: u64) -> (TempDir, Vec<Effect>, Value) {
    let folder = tempdir().unwrap();
    let schedule = rising();
    let effect = Effect::draw(&mut ChaCha8Rng::seed_from_u64(seed), cause, 0, &schedule, 1.0);
    let record = LabelledRecord::new(schedule, vec![effect.clone()], Noise::white(0.2), seed);
    fs::write(folder.path().join("first.csv"), record.csv()).unwrap();
    let report = json(folder.path(), &["diagnose", "first.csv", "--json"]);
    fs::write(folder.path().join("first.json"), report.to_string()).unwrap();
    (folder, vec![effect], report)
}

#[test]
fn planned_experiment_decides_between_hysteresis_and_a_static_law() {
    for cause in [Cause::Hysteresis, Cause::StaticNonlinearity] {
        let (folder, effects, first) = diagnosed(cause, 11);
        assert_eq!(first["verdict"], "ambiguous", "{first}");
        assert!(first["next_experiment"].as_str().unwrap().contains("vsj plan"), "{first}");
        let plan = json(folder.path(), &["plan", "first.json", "--minutes", "2", "--out", "next", "--json"]);
        assert_eq!(plan["schedule"], "next/schedule.csv");
        let decides = plan["decides"].as_array().unwrap();
        assert!(decides.iter().any(|set| *set == serde_json::json!([cause.name()])) && decides.len() > 1, "{plan}");
        let minutes = plan["minutes"].as_f64().unwrap();
        assert!(plan["probability"].as_f64().unwrap() > 0.9 && (minutes - 2.0).abs() < 0.01, "{plan}");

        let schedule = played(&folder.path().join("next/schedule.csv"));
        let volts = &schedule.voltage_v;
        assert!(volts[0] == 0.0 && volts[volts.len() - 1] == 0.0);
        assert!(volts.iter().all(|volts| (0.0..=500.0).contains(volts)), "beyond the range of the record");
        let record = LabelledRecord::new(schedule, effects, Noise::white(0.2), 12);
        fs::write(folder.path().join("next.csv"), record.csv()).unwrap();
        let next = json(folder.path(), &["diagnose", "next.csv", "--json"]);
        assert_eq!((next["verdict"].as_str(), causes(&next)), (Some("explained"), vec![cause.name()]), "{next}");
    }
}

/// The report's own stair: nothing explains its 17 readings.
#[test]
fn suspects_of_the_reports_stair_are_decided_by_the_planned_experiment() {
    let folder = tempdir().unwrap();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/table3_stair.csv");
    let report = json(folder.path(), &["diagnose", data, "--column", "measured", "--input", "stair", "--json"]);
    assert_eq!(report["verdict"], "unexplained", "{report}");
    assert!(report["next_experiment"].as_str().unwrap().contains("`vsj plan DIAGNOSIS.json`"), "{report}");
    fs::write(folder.path().join("first.json"), report.to_string()).unwrap();
    let plan = json(folder.path(), &["plan", "first.json", "--out", "next", "--json"]);
    let short = |cause: &str| {
        let suspect = report["suspects"].as_array().unwrap().iter().find(|it| it["cause"] == cause);
        suspect.expect("a suspect")["nats_short"].as_f64().unwrap()
    };
    for cause in [Cause::StaticNonlinearity, Cause::VoltageDependentTimeConstant] {
        let suspect = plan["suspects"].as_array().unwrap().iter().find(|it| it["cause"] == cause.name());
        let suspect = suspect.unwrap_or_else(|| panic!("{cause}: {plan}"));
        let nats = suspect["nats"].as_f64().unwrap();
        assert!((nats + short(cause.name())).abs() < 1e-9 && nats < 0.0, "{suspect}");
        assert!((0.0..=1.0).contains(&suspect["probability"].as_f64().unwrap()), "{suspect}");

        let schedule = played(&folder.path().join("next/schedule.csv"));
        let effect = Effect::draw(&mut ChaCha8Rng::seed_from_u64(21), cause, 0, &schedule, 1.0);
        let record = LabelledRecord::new(schedule, vec![effect], Noise::white(0.2), 21);
        fs::write(folder.path().join("next.csv"), record.csv()).unwrap();
        let next = json(folder.path(), &["diagnose", "next.csv", "--json"]);
        assert_eq!((next["verdict"].as_str(), causes(&next)), (Some("explained"), vec![cause.name()]), "{next}");
    }
    let said = text(&run(folder.path(), &["plan", "first.json"]).stdout);
    assert!(said.contains("odds today") && said.contains("run the same schedule again"), "{said}");
}

/// A folder with the record `first.csv` of a law that no cause describes.
fn with_law(name: &str) -> TempDir {
    let folder = tempdir().unwrap();
    let forms = validation::ground_truth::out_of_model::all();
    let form = forms.iter().find(|form| form.name == name).expect("a form");
    fs::write(folder.path().join("first.csv"), form.draw(71).csv()).unwrap();
    folder
}

#[test]
fn every_suspect_that_a_voltage_shows_is_in_the_plan() {
    let folder = with_law("sagging supply");
    let report = json(folder.path(), &["diagnose", "first.csv", "--json"]);
    assert_eq!(report["verdict"], "unexplained", "{report}");
    fs::write(folder.path().join("first.json"), report.to_string()).unwrap();
    let plan = json(folder.path(), &["plan", "first.json", "--minutes", "2", "--json"]);
    let of = |value: &Value| -> Vec<String> {
        let suspects = value["suspects"].as_array().unwrap().iter();
        suspects.map(|it| it["cause"].as_str().unwrap().to_owned()).collect()
    };
    let shown: Vec<String> = of(&report).into_iter().filter(|cause| cause != "reading-offset").collect();
    assert!(shown.len() >= 2 && of(&plan) == shown, "{shown:?}, {plan}");
    let decides = plan["decides"].as_array().unwrap();
    for suspect in plan["suspects"].as_array().unwrap() {
        assert!(decides.contains(&suspect["causes"]) && decides.contains(&suspect["rival"]), "{suspect}, {plan}");
    }
}

/// The spring that is reported is not the one of the search, where the causes need no other gain and time constant.
#[test]
fn the_suspects_beside_an_identified_spring_are_in_the_plan() {
    let folder = with_law("ageing");
    let report = json(folder.path(), &["diagnose", "first.csv", "--plant", "identify", "--json"]);
    assert_eq!((&report["verdict"], &report["rivals"][0]["nats"]), (&"unexplained".into(), &0.0.into()), "{report}");
    fs::write(folder.path().join("first.json"), report.to_string()).unwrap();
    let plan = json(folder.path(), &["plan", "first.json", "--minutes", "2", "--json"]);
    let count = |list: &Value| list.as_array().expect("a list").len();
    assert!(count(&plan["suspects"]) >= 1 && count(&plan["decides"]) >= 2, "{plan}");
}

#[test]
fn schedule_keeps_limit_slew_and_time_and_is_played_by_the_stair() {
    let (folder, _, first) = diagnosed(Cause::Hysteresis, 11);
    let arguments =
        ["plan", "first.json", "--minutes", "1.5", "--limit-v", "300", "--slew-v-per-s", "50", "--out", "next"];
    let output = run(folder.path(), &arguments);
    let said = text(&output.stdout);
    assert!(output.status.success(), "{said}");
    let schedule = played(&folder.path().join("next/schedule.csv"));
    assert!(schedule.time_s.last().is_some_and(|end| (89.0..=90.0).contains(end)));
    assert!(schedule.voltage_v.iter().all(|volts| (0.0..=300.0).contains(volts)));
    let steepest = schedule.voltage_v.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(steepest <= 50.0 * 0.1 + 1e-6 && steepest > 4.0, "{steepest} V in 0.1 s");
    assert!(schedule.voltage_v.iter().any(|volts| *volts > 150.0), "the limit is hardly used");
    // What it says to run runs as it stands, with the spring that the record was compared with.
    let simulated = said.lines().find_map(|line| line.strip_prefix("Simulated: vsj ")).expect("a command");
    assert!(simulated.contains("--plant next/plant.toml"), "{simulated}");
    let stair = json(folder.path(), &simulated.split(' ').chain(["--json"]).collect::<Vec<_>>());
    assert!(stair["max_fixed_point_error"].is_number(), "{stair}");
    let spring = fs::read_to_string(folder.path().join("next/plant.toml")).unwrap();
    assert_eq!(first["experiment"]["plant"], spring);
    for name in ["plan.json", "schedule.svg", "responses.svg", "differences.svg"] {
        assert!(folder.path().join("next").join(name).is_file(), "{name}");
    }
    // The same diagnosis gives the same plan.
    let again =
        ["plan", "first.json", "--minutes", "1.5", "--limit-v", "300", "--slew-v-per-s", "50", "--out", "again"];
    assert!(run(folder.path(), &again).status.success());
    let rows = |name: &str| {
        let text = fs::read_to_string(folder.path().join(name).join("schedule.csv")).unwrap();
        text.lines().skip(1).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(rows("next"), rows("again"));
}

#[test]
fn a_decided_diagnosis_gets_the_tightest_intervals() {
    let folder = tempdir().unwrap();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/sample_hysteresis.csv");
    let report = json(folder.path(), &["diagnose", data, "--json"]);
    fs::write(folder.path().join("d.json"), report.to_string()).unwrap();
    let plan = json(folder.path(), &["plan", "d.json", "--json"]);
    assert!(plan["decides"].as_array().unwrap().is_empty() && plan["probability"].is_null(), "{plan}");
    assert!(plan["schedule"].is_null() && (plan["minutes"].as_f64().unwrap() - 4.0).abs() < 0.01, "{plan}");
    let width = plan["intervals"].as_array().unwrap().iter().find(|it| it["parameter"] == "width_v").unwrap();
    let [now, planned] = ["now", "planned"].map(|name| width[name].as_f64().unwrap());
    assert!(planned > 0.0 && planned < 1.5 * now, "{width}");
    let said = text(&run(folder.path(), &["plan", "d.json"]).stdout);
    assert!(said.starts_with("Nothing is undecided;") && said.contains("hysteresis width_v"), "{said}");
}

#[test]
fn bad_input_is_one_line_that_says_what_was_expected() {
    let folder = tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("none.json", "time_s,voltage_v\n0,0\n");
    write("other.json", r#"{"schema":7,"verdict":"ambiguous"}"#);
    write("old.json", r#"{"schema":1,"verdict":"ambiguous","alternatives":[]}"#);
    write("list.json", "[1, 2]");
    let experiment = r#"{"plant":"schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n","lowest_v":0,"highest_v":500,
        "sample_s":0.1,"duration_s":60,"reading_unit":"V","coordinates":{"second_s":1,"volt_v":1,"zero":0,"reading":1,"output":1,
        "share":0.1,"even":false,"start":null,"full_scale_v":500,"sample_s":0.1,"uniform":true},"noise":{"sigma":1,"tail":null,
        "ar":[],"power":0,"half_step":0,"unexplained":0,"upper":null,"lower":null}}"#;
    write("good.json", &format!(r#"{{"schema":1,"verdict":"consistent","rivals":[],"experiment":{experiment}}}"#));
    // The limit of a command that is no voltage is in its unit and has no amplifier's maximum.
    let bar = experiment.replace("[relaxation]", r#"[units]\nvoltage = \"bar\"\n[relaxation]"#);
    write("bar.json", &format!(r#"{{"schema":1,"verdict":"consistent","rivals":[],"experiment":{bar}}}"#));
    let unknown = r#"[{"causes":["ghost"],"nats":0,"blocks":[{"cause":"ghost","form":0,"point":[]}],"covariance":[]}]"#;
    write(
        "ghost.json",
        &format!(r#"{{"schema":1,"verdict":"explained","rivals":{unknown},"experiment":{experiment}}}"#),
    );
    let plan = |more: &[&str]| run(folder.path(), &[&["plan"], more].concat());
    assert!(plan(&["good.json"]).status.success());
    let large = plan(&["bar.json", "--limit-v", "5000", "--slew-v-per-s", "2000"]);
    assert!(large.status.success() && text(&large.stdout).contains("between 0 and 5000 bar"), "{large:?}");
    for (arguments, expected) in [
        (&["absent.json"][..], "absent.json: cannot be read"),
        (&["none.json"], "none.json, line 1, column "),
        (&["list.json"], "expected the JSON of `vsj diagnose`"),
        (&["other.json"], "other.json: schema 7; expected 1"),
        (&["old.json"], "old.json: no field `experiment`"),
        (&["ghost.json"], "ghost.json: cause ghost, form 0: expected"),
        (&["good.json", "--minutes", "0"], "--minutes 0: expected a number above 0"),
        (&["good.json", "--minutes", "0.01"], "--minutes 0.01: expected 0.06"),
        (&["good.json", "--limit-v", "-5"], "--limit-v -5: expected"),
        (&["good.json", "--limit-v", "1200"], "--limit-v 1200: expected above 0, at most 1000 V"),
        (&["bar.json", "--limit-v", "2e9"], "--limit-v 2000000000: expected above 0, at most 1000000000 bar"),
        (&["bar.json", "--slew-v-per-s", "1"], "--slew-v-per-s 1: expected at least 8.3"),
        (&["good.json", "--slew-v-per-s", "1"], "--slew-v-per-s 1: expected at least"),
    ] {
        let output = plan(arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(expected) && said.lines().count() == 1, "{arguments:?}: {said}");
    }
}
