//! `vsj stair`: the stair experiment compared with the report's Table 3.

use std::fs;
use std::path::Path;

use end_to_end::vsj::{json, run, text};
use serde_json::Value;
use tempfile::tempdir;

fn number(value: &Value, field: &str) -> f64 {
    value[field].as_f64().unwrap_or_else(|| panic!("{field} of {value}"))
}

fn rows(report: &Value) -> &Vec<Value> {
    report["rows"].as_array().expect("rows")
}

/// The reference agrees with every printed number to its last digit except two, each of which has a note.
#[test]
fn the_reference_reproduces_the_simulated_columns_of_table_3() {
    let report = json(tempdir().unwrap().path(), &["stair", "--json"]);
    assert_eq!(rows(&report).len(), 17);
    let mut wrong = Vec::new();
    for row in rows(&report) {
        for column in ["with", "without"] {
            let printed = (number(row, &format!("printed_{column}")) * 100.0).round();
            if (number(row, column) * 100.0).floor() != printed {
                wrong.push((number(row, "time_s"), column, row["note"].as_str().expect("a note").to_owned()));
            }
        }
    }
    assert_eq!((report["printed_compared"].as_u64(), report["printed_agree"].as_u64()), (Some(34), Some(32)));
    assert_eq!(wrong.len(), 2, "{wrong:?}");
    assert_eq!((wrong[0].0, wrong[0].1), (41.0, "without"));
    assert!(wrong[0].2.contains("misses the printed 209.08 by 0.000033"), "{}", wrong[0].2);
    assert_eq!((wrong[1].0, wrong[1].1), (55.0, "with"));
    assert!(wrong[1].2.contains("403.14 with its neighbouring digits 0 and 3 swapped"), "{}", wrong[1].2);
}

#[test]
fn the_rows_are_the_same_in_csv_mcap_and_parquet() {
    let folder = tempdir().unwrap();
    let run_of = |out: &str, reading: &str| {
        let written = run(folder.path(), &["stair", "--out", out, "--every", "0.05"]);
        assert!(written.status.success(), "{}", text(&written.stderr));
        let file = if out == "csv" { "csv/stair.csv" } else { out };
        let columns = ["--voltage", "applied_v:V", "--reading", reading];
        json(folder.path(), &[&["identify", file, "--json"], &columns[..]].concat())
    };
    for reading in ["stiffness:V", "youngs_modulus_pa:Pa"] {
        let expected = run_of("csv", reading);
        for out in ["stair.mcap", "stair.parquet"] {
            let found = run_of(out, reading);
            assert_eq!((&found["rows"], &found["unit"]), (&expected["rows"], &expected["unit"]), "{out}");
            let (own, other) = (&found["nominal"]["share"], &expected["nominal"]["share"]);
            assert!((number(own, "value") / number(other, "value") - 1.0).abs() < 1e-4, "{own} {other}");
        }
    }
}

#[test]
fn the_fixed_point_loop_stays_within_50_mv_of_the_reference() {
    for rate in ["1000", "10000"] {
        for (input, limit) in [("stair", "700"), ("stair", "1000"), ("step", "700"), ("step", "1000")] {
            let arguments = ["stair", "--json", "--rate-hz", rate, "--input", input, "--limit-v", limit];
            let report = json(tempdir().unwrap().path(), &arguments);
            let error = number(&report, "max_fixed_point_error");
            assert!(error < 0.05, "{rate} Hz, {input}: {error} V");
            // An error below the rounding of the DAC would mean that the reference is not independent.
            assert!(error > 0.005, "{rate} Hz, {input}: {error} V");
        }
    }
}

/// The report's gains need 3.5 s for 97 %; the lower bounds are computed by the closed formula.
#[test]
fn steps_are_measured_from_the_start_of_the_ramp() {
    let report = json(tempdir().unwrap().path(), &["stair", "--json"]);
    let steps = report["steps"].as_array().expect("steps");
    assert_eq!(steps.len(), 5);
    for step in steps {
        assert!((3.4..3.6).contains(&number(step, "t97_s")), "{step}");
        assert!((2.6..2.75).contains(&number(step, "t90_s")), "{step}");
        assert!((0.6..0.7).contains(&number(step, "t50_s")), "{step}");
        assert!((4.0..4.3).contains(&number(step, "overshoot_percent")), "{step}");
        assert!(number(step, "bound_t97_s") < number(step, "t97_s"));
    }
    let bound = |from: f64, limit: f64| 5.5 * (10.0 / 11.0 * (limit - from) / (limit - from - 97.0)).ln();
    for (limit, argument) in [(700.0, "700"), (1000.0, "1000")] {
        let report = json(tempdir().unwrap().path(), &["stair", "--json", "--limit-v", argument]);
        for step in report["steps"].as_array().expect("steps") {
            let expected = bound(number(step, "from_v"), limit);
            assert!((number(step, "bound_t97_s") - expected).abs() < 1e-6, "{step}");
        }
    }
}

#[test]
fn without_a_command_it_writes_the_stair_experiment_and_prints_the_paths() {
    let folder = tempdir().unwrap();
    let output = run(folder.path(), &[]);
    assert!(output.status.success());
    let stdout = text(&output.stdout);
    for name in ["stair.csv", "stiffness.svg", "voltage.svg"] {
        assert!(stdout.contains(&format!("wrote out/stair/{name}")), "{stdout}");
        assert!(folder.path().join("out/stair").join(name).exists());
    }
    assert_eq!(fs::read_dir(folder.path().join("out/stair")).unwrap().count(), 3, "and nothing else");

    let csv = fs::read_to_string(folder.path().join("out/stair/stair.csv")).unwrap();
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    assert_eq!(lines.next(), Some("time_s,target_v,applied_v,dac_code,stiffness,youngs_modulus_pa"));
    let ticks: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!(ticks.len(), 70_001);
    for tick in &ticks {
        let [_, _, applied, code, stiffness, modulus] = tick[..] else { panic!("{tick:?}") };
        assert!((applied - code * 700.0 / 4095.0).abs() < 1e-4);
        assert!((modulus - (1.301e9 + 1.069e6 * stiffness)).abs() < 2.0);
    }
    assert_eq!(ticks[20_100][..2], [20.1, 100.0]);
    let stiffness = ["measured", "without controller", ">equivalent static voltage [V]<"];
    for (name, words) in [("stiffness.svg", stiffness), ("voltage.svg", ["applied", "target", ">voltage [V]<"])] {
        let svg = fs::read_to_string(folder.path().join("out/stair").join(name)).unwrap();
        assert!(svg.contains("<svg") && words.iter().all(|word| svg.contains(word)));
    }
}

#[test]
fn user_defined_schedules_and_plants_are_simulated() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("s.csv"), "# up and down\ntime_s,voltage_v\n5,0\n6,200\n20,200\n21,50\n40,50\n")
        .unwrap();
    fs::write(folder.path().join("p.toml"), "schema = 1\n[relaxation]\nshare = 0.4\ntau_s = 2.0\n").unwrap();
    let report =
        json(folder.path(), &["stair", "--input", "s.csv", "--plant", "p.toml", "--controller", "none", "--json"]);
    let steps = report["steps"].as_array().expect("steps");
    assert_eq!(steps.len(), 2, "held between rows: {steps:?}");
    // Without a controller the spring reaches `part` of a step after tau ln(0.6 / (1 - part)).
    assert!((number(&steps[0], "t90_s") - 2.0 * 6.0f64.ln()).abs() < 2e-3, "{}", steps[0]);
    assert!((number(&steps[1], "to_v") - 50.0).abs() < 1e-9);
    assert_eq!(rows(&report).len(), 5);
    assert!(rows(&report)[0]["printed_with"].is_null());
    assert!((number(&rows(&report)[1], "without") - 80.0).abs() < 1e-9, "the instantaneous share of 200 V");
    let output = run(folder.path(), &["stair", "--controller", "none"]);
    assert!(text(&output.stdout).contains("|    with paper controller     |      without controller      |"));

    let straight = ["stair", "--input", "s.csv", "--between", "linear", "--json"];
    let report = json(folder.path(), &straight);
    assert_eq!(report["steps"].as_array().expect("steps").len(), 1, "the first ramp does not start on a plateau");
}

/// Active limits are reported, and the reference has them between the rows too.
#[test]
fn active_limits_are_counted() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("s.csv"), "time_s,voltage_v\n0,100\n10,100\n").unwrap();
    let swinging = ["stair", "--json", "--kp", "1", "--ki", "5", "--input", "s.csv"];
    for (limit, acted) in [(&["--limit-v", "120"][..], "upper"), (&["--slew-v-per-s", "60"], "slew")] {
        let report = json(folder.path(), &[&swinging[..], limit].concat());
        assert!(number(&report["limited_ticks"], acted) > 10.0, "{limit:?}: {}", report["limited_ticks"]);
        let last = &rows(&report)[1];
        assert!((number(last, "with") - number(last, "with_fixed")).abs() < 0.05, "{limit:?}: {last}");
    }
    let soft = ["stair", "--json", "--input", "s.csv", "--min-v", "50", "--slew-v-per-s", "1e9"];
    let report = json(folder.path(), &soft);
    assert!((number(&rows(&report)[1], "with") - number(&rows(&report)[1], "with_fixed")).abs() < 0.05);
}

/// Each error is one line with the fault and the expectation, exit code 2, and no file is written.
#[test]
fn bad_input_gives_one_error_line_and_writes_no_file() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("bad.csv"), "time_s,voltage_v\n0,1\n1,much\n").unwrap();
    fs::write(folder.path().join("high.csv"), "time_s,voltage_v\n0,0\n5,900\n10,900\n").unwrap();
    fs::write(folder.path().join("long.csv"), "time_s,voltage_v\n0,0\n1e9,0\n").unwrap();
    fs::write(folder.path().join("bad.toml"), "schema = 1\n[relaxation]\nshare = -1.0\ntau_s = 5.5\n").unwrap();
    fs::write(folder.path().join("lines.csv"), "time_s,voltage_v\n\"1\n2\",100\n3,100\n").unwrap();
    fs::write(folder.path().join("huge.csv"), "time_s,voltage_v\n0,0\n1e300,100\n").unwrap();
    fs::write(folder.path().join("s.csv"), "time_s,voltage_v\n0,0\n5,100\n").unwrap();
    fs::write(folder.path().join("latin.csv"), b"time_s,voltage_v\n# \xb5s\n0,0\n5,100\n").unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (arguments, expected) in [
        (&["--input", "no.csv"][..], "no.csv: cannot be read"),
        (&["--input", "bad.csv"], "bad.csv, line 3, column voltage_v: `much` is not a finite number"),
        (&["--input", "high.csv"], "high.csv, line 3, column voltage_v: 900 V; expected 0 to 700 V"),
        (&["--input", "long.csv"], "expected at most 10000000"),
        (&["--plant", "no.toml"], "no.toml: cannot be read"),
        (&["--plant", "bad.toml"], "bad.toml, line 3, column 9: share = -1 is not allowed: expected 0 to 0.9"),
        (&["--kp", "-4"], "--kp: proportional_gain = -4 is not allowed: expected 0.001 to 100 V/V"),
        (&["--kp", "NaN"], "proportional_gain = NaN is not allowed"),
        (&["--ki", "-1"], "integral_gain_per_s = -1 is not allowed"),
        (&["--ki", "NaN"], "integral_gain_per_s = NaN is not allowed"),
        (&["--rate-hz", "0"], "rate_hz = 0 is not allowed: expected 100 to 10000 Hz"),
        (&["--rate-hz", "fast"], "invalid value 'fast' for '--rate-hz <HZ>'"),
        (&["--min-v", "600", "--limit-v", "300"], "min_v = 600 is not allowed"),
        (&["--limit-v", "400"], "the stair commands 500 V at 60.1 s; expected 0 to 400 V"),
        (&["--limit-v", "1500"], "--limit-v: full_scale_v = 1500 is not allowed: expected 50 to 1000 V"),
        (&["--min-v", "50"], "the stair commands 0 V at 0 s; expected 50 to 700 V"),
        (&["--slew-v-per-s", "0"], "slew_v_per_s = 0 is not allowed"),
        (&["--dac-bits", "40"], "dac_bits = 40 is not allowed: expected 8 to 16 bits"),
        (
            &["--input", "lines.csv"],
            "lines.csv, line 2, column time_s: a line break, perhaps after an unclosed quote; expected",
        ),
        (&["--input", "s.csv", "--column", "gauge"], "s.csv, line 1: no column `gauge`"),
        (&["--every", "-1"], "--every -1: expected a positive number of seconds"),
        (&["--every", "-1e300"], "--every -1e300: expected a positive number of seconds"),
        (&["--input", "huge.csv"], "huge.csv takes 1e303 ticks at 1000 Hz; expected at most 10000000"),
        (&["--controller", "magic"], "invalid value 'magic' for '--controller <CONTROLLER>'"),
        (&["--out", "file/sub"], "file/sub: cannot be created"),
        (&["--between", "linear"], "--between has no effect with --input stair: expected --input FILE.csv"),
        (&["--input", "step", "--column", "gauge"], "--column has no effect with --input step"),
        (&["--approach-s", "2"], "--approach-s applies to the fast controller only: expected --controller fast"),
        (&["--kp", "1e300"], "--kp: proportional_gain = 1e300 is not allowed"),
        (&["--input", "latin.csv"], "latin.csv, line 2: not UTF-8; expected a text in UTF-8"),
        (&["--plant", "latin.csv"], "latin.csv, line 2, column 3: not UTF-8; expected a text in UTF-8"),
        (&["--nonsense"], "unexpected argument '--nonsense' found"),
    ] {
        let mut all = vec!["stair", "--out", "result"];
        if arguments[0] == "--out" {
            all.truncate(1);
        }
        all.extend(arguments);
        let output = run(folder.path(), &all);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(!folder.path().join("result").exists(), "{arguments:?} wrote a file");
    }
}

#[test]
fn a_failed_run_does_not_change_an_earlier_result() {
    let folder = tempdir().unwrap();
    assert!(run(folder.path(), &["stair", "--out", "result", "--every", "1"]).status.success());
    let before = fs::read(folder.path().join("result/stair.csv")).unwrap();
    // A folder with the name of the last file: moving the file there fails.
    fs::remove_file(folder.path().join("result/voltage.svg")).unwrap();
    fs::create_dir_all(folder.path().join("result/voltage.svg/in the way")).unwrap();
    let output = run(folder.path(), &["stair", "--out", "result", "--every", "1", "--kp", "5"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    let after = fs::read(folder.path().join("result/stair.csv")).unwrap();
    assert!(after == before, "half of the result was replaced");
    assert_eq!(fs::read_dir(folder.path().join("result")).unwrap().count(), 3, "temporary files were left behind");
}

#[test]
fn vsj_diagnose_reads_the_csv_of_vsj_stair() {
    let folder = tempdir().unwrap();
    assert!(run(folder.path(), &["stair", "--out", "result", "--every", "0.5"]).status.success());
    let found = json(folder.path(), &["diagnose", "result/stair.csv", "--json"]);
    assert_eq!(found["rows"], 141);
}

#[test]
fn the_help_has_examples() {
    let folder = tempdir().unwrap();
    let help = run(folder.path(), &["stair", "--help"]);
    assert!(help.status.success() && text(&help.stdout).contains("Examples:"));
    assert!(run(folder.path(), &["--version"]).status.success());
}

/// The pictures and figures that the README shows are those of today.
#[test]
fn the_documentation_equals_the_output_of_the_command() {
    let folder = tempdir().unwrap();
    let output = run(folder.path(), &["stair", "--out", "stair", "--every", "0.1"]);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for name in ["stair.csv", "stiffness.svg", "voltage.svg"] {
        let committed = fs::read(root.join("docs/stair").join(name)).unwrap();
        let made = fs::read(folder.path().join("stair").join(name)).unwrap();
        assert!(
            committed == made,
            "docs/stair/{name} is out of date: cargo run --release -- stair --out docs/stair --every 0.1"
        );
    }
    let page = fs::read_to_string(root.join("docs/stair.md")).unwrap();
    let stdout = text(&output.stdout);
    let shown = stdout
        .lines()
        .filter(|line| line.contains(" -> ") || line.contains("agree to the last digit") || line.contains("stays"));
    for line in shown {
        assert!(page.contains(line), "docs/stair.md lacks: {line}");
    }
}

/// Printed and measured values belong to the report's spring alone.
#[test]
fn another_spring_is_not_compared_with_the_reports_values() {
    let folder = tempdir().unwrap();
    let shown = |arguments: &[&str]| text(&run(folder.path(), arguments).stdout);
    let plant = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/plant.toml");
    let other = shown(&["stair", "--plant", plant.to_str().unwrap()]);
    assert!(other.contains("reference") && !other.contains("printed") && !other.contains("measured"), "{other}");
    let own = shown(&["stair"]);
    assert!(own.contains("printed") && own.contains("measured"), "{own}");
    let answer = json(folder.path(), &["stair", "--plant", plant.to_str().unwrap(), "--json"]);
    assert!(
        answer["rows"].as_array().unwrap().iter().all(|row| row["printed_with"].is_null() && row["measured"].is_null())
    );
}

/// The report's gains would ring on a quick spring: the default is lowered, what a user asks for is refused.
#[test]
fn the_default_gains_suit_a_quick_spring() {
    let folder = tempdir().unwrap();
    let plant = "schema = 1\n[reading]\ngain = 1\nzero = 0\n[relaxation]\nshare = 0.1\ntau_s = 0.002\n";
    fs::write(folder.path().join("quick.toml"), plant).unwrap();
    fs::write(folder.path().join("step.csv"), "time_s,voltage_v\n0,0\n1,100\n3,100\n").unwrap();
    for command in [&["stair", "--input", "step.csv"][..], &["compare", "--limit-v", "700"]] {
        let output = run(folder.path(), &[command, &["--plant", "quick.toml"]].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let remark = "vsj: --kp 2.0668: the largest for this spring at this rate, instead of 4";
        assert_eq!(text(&output.stderr).lines().next(), Some(remark), "{command:?}");
    }
    let asked = run(folder.path(), &["stair", "--plant", "quick.toml", "--kp", "4"]);
    assert!(text(&asked.stderr).contains("--kp: proportional_gain = 4 is not allowed: expected 0.001 to 2.066"));
    let low = run(folder.path(), &["stair", "--input", "step.csv", "--kp", "0.005"]);
    assert_eq!(text(&low.stderr).trim(), "vsj: --ki 0.5000: the largest for this spring at this rate, instead of 1.35");
}
