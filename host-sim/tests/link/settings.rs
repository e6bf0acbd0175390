//! Settings for the MCU.

use firmware::store::{Page, Pages, Side, WORD};
use link::{Block, State};
use serde_json::Value;

use crate::mcu::{Mcu, Setup};
use crate::vsj::{bad, good, json, run};

/// A file of this text, for the command line.
fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn settings_are_sent_checked_stored_and_run() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let port = &mcu.port;
    let shown = good(port, &["settings"]);
    assert!(shown.starts_with("# runs    the one that is built in\n# stored  the one that is built in\nschema = 1\n"));
    assert_eq!(good(port, &["settings", "--show"]), shown);

    let smaller = "schema = 1\nrate_hz = 500\n[gains]\nproportional = 3.5\n[amplifier]\nfull_scale_v = 450\nmax_v = 400\n\
                   [watchdogs]\nhang_ms = 20\n";
    let smaller = file(&folder, "smaller.toml", smaller);
    let shown = good(port, &["settings", &smaller]);
    assert!(shown.starts_with("# runs    number 1, format 1, "), "{shown}");
    for line in
        ["rate_hz = 500", "proportional = 3.5", "integral_per_s = 1.35", "full_scale_v = 450.0", "max_v = 400.0"]
    {
        assert!(shown.lines().any(|shown| shown == line), "{line}: {shown}");
    }
    let status = json(port, &["status"]);
    assert_eq!((&status["rate_hz"], &status["highest_v"]), (&500.into(), &400.0.into()));
    // What is shown can be sent again.
    let again = file(&folder, "again.toml", &shown);
    let resent = good(port, &["settings", &again]);
    assert_eq!(resent.lines().skip(2).collect::<Vec<_>>(), shown.lines().skip(2).collect::<Vec<_>>());

    // They are those of the tick, not of the report alone.
    good(port, &["set", "390", "--arm", "--keep", "0.3"]);
    bad(2, port, &["set", "401"]);
    let sample = mcu.wait_for(State::Armed);
    assert!(sample.applied.to_f64() <= 400.0 && f64::from(sample.code) * 450.0 / 4095.0 <= 400.05, "{sample:?}");
    let text = bad(1, port, &["settings", "--default"]);
    assert!(text.contains("refused: armed; disarm it first"), "{text}");
    good(port, &["disarm"]);

    let report = json(port, &["settings", "--default"]);
    assert_eq!((&report["active"]["number"], &report["stored"]), (&Value::from(3), &report["active"]));
    assert_eq!(
        (&report["settings"]["rate_hz"], &report["settings"]["amplifier"]["max_v"]),
        (&1000.into(), &700.0.into())
    );
    let ordered = mcu.with(|shared| shared.ordered.len());
    assert_eq!(ordered, 3, "nothing but arming, one target and disarming reached the tick");
}

/// The range of the built-in settings, which the program falls back to, is the larger one.
#[test]
fn settings_that_are_damaged_raise_no_limit_and_others_are_taken_meanwhile() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let port = &mcu.port;
    let small = file(&folder, "small.toml", "schema = 1\n[amplifier]\nmax_v = 400\n");
    good(port, &["settings", &small]);
    mcu.with(|shared| {
        let page = Page { block: Block::Settings, side: Side::A };
        let mut word = *shared.flash.bytes(page)[2 * WORD..].first_chunk().unwrap();
        word[0] ^= 1;
        shared.flash.program(page, 2 * WORD, word).unwrap();
        shared.restart = true;
    });
    mcu.wait_for(State::Faulted);
    assert_eq!(json(port, &["status"])["highest_v"], 700.0);
    for (command, refused) in
        [("acknowledge", "the cause of the fault is still there: config (7)"), ("arm", "faulted: config (7)")]
    {
        let arguments: &[&str] = if command == "arm" { &["arm"] } else { &["acknowledge", "config"] };
        let text = bad(1, port, arguments);
        assert!(text.contains(refused), "{text}");
    }
    good(port, &["settings", &small]);
    assert_eq!(json(port, &["status"])["highest_v"], 400.0);
    good(port, &["set", "390", "--arm", "--keep", "0.1"]);
    bad(2, port, &["set", "401"]);
}

#[test]
fn settings_that_cannot_run_change_nothing_and_the_error_says_why() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let port = &mcu.port;
    let before = json(port, &["settings"]);
    for (name, text, expected) in [
        (
            "range.toml",
            "schema = 1\n[amplifier]\nmax_v = 800\n",
            "range.toml, line 3, column 9: max_v = 800 is not allowed",
        ),
        ("pins.toml", "schema = 1\n[pins]\ndac = 5\n", "pins.toml, line 2, column 2: unknown field `pins`"),
        (
            "order.toml",
            "schema = 1\n[watchdogs]\nreset_ms = 40\n",
            "reset_ms = 40 is not allowed: expected 65 to 2000 ms",
        ),
    ] {
        let text = bad(2, port, &["settings", &file(&folder, name, text)]);
        assert!(text.contains(expected), "{text}");
    }
    let text = bad(2, port, &["settings", "nowhere.toml"]);
    assert!(text.contains("nowhere.toml: cannot be read"), "{text}");
    bad(2, port, &["settings", "nowhere.toml", "--default"]);
    // This image is built without the time-optimal controller unless a feature is enabled.
    let fast = file(&folder, "fast.toml", "schema = 1\ncontroller = \"fast\"\n");
    if model::Approach::new(0.0).is_none() {
        let text = bad(2, port, &["settings", &fast]);
        assert!(text.contains("fast.toml: the MCU's image is built without it: controller; flash an image"), "{text}");
    } else {
        good(port, &["settings", &fast]);
        assert_eq!(json(port, &["status"])["controller"], "fast");
        good(port, &["settings", "--default"]);
    }
    assert_eq!(json(port, &["settings"])["settings"], before["settings"]);
}

#[test]
fn the_robust_controller_runs_with_the_margin_of_a_file() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let port = &mcu.port;
    let robust = file(&folder, "robust.toml", "schema = 1\ncontroller = \"robust\"\n[margin]\nshare = 0.1\n");
    let shown = good(port, &["settings", &robust]);
    assert!(shown.starts_with("# runs    number 1, format 3, "), "{shown}");
    for line in ["controller = \"robust\"", "time_constant = 0.05", "share = 0.1", "gain = 0.0", "overshoot = 0.02"] {
        assert!(shown.lines().any(|shown| shown == line), "{line}: {shown}");
    }
    assert_eq!(json(port, &["status"])["controller"], "robust");

    let wide = file(&folder, "wide.toml", "schema = 1\ncontroller = \"robust\"\n[margin]\ngain = 0.5\n");
    let text = bad(2, port, &["settings", &wide]);
    assert!(
        text.contains("wide.toml, line 4, column 8: margin.gain = 0.5 is not allowed: expected 0 to 0.25"),
        "{text}"
    );
    let shown = good(port, &["settings", "--default"]);
    assert!(shown.starts_with("# runs    number 2, format 1, ") && shown.contains("controller = \"paper\""), "{shown}");
}

/// The remarks of `vsj stair`, also where the settings came first and the model, which does not come back, came later.
#[test]
fn a_fall_back_that_has_no_effect_with_the_model_is_a_remark() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let remarks = |arguments: &[&str]| {
        let output = run(&mcu.port, arguments);
        assert!(output.status.success(), "{output:?}");
        let said = String::from_utf8(output.stderr).unwrap();
        let expected =
            format!("vsj: {}: a fall back by 12.5 % has no effect within these errors: it helps where", mcu.port);
        assert!(said.is_empty() || said.starts_with(&expected) && said.lines().count() == 1, "{said}");
        !said.is_empty()
    };
    let robust = |margin: &str| {
        let text = format!("schema = 1\ncontroller = \"robust\"\n[margin]\nfall_back = 0.125\n{margin}\n");
        file(&folder, &format!("{margin}.toml").replace('\n', " "), &text)
    };
    let (as_well, exactly) = (robust("share = 0.05"), robust("share = 0.0"));
    let for_a_small_share = robust("share = 0.0\ntime_constant = 0.02\ngain = 0.01");
    assert!(remarks(&["settings", &for_a_small_share]), "with the model that is built in");
    assert!(remarks(&["settings", &as_well]) && remarks(&["settings"]), "with the model that is built in");
    assert!(!remarks(&["settings", &exactly]) && !remarks(&["settings"]));
    let half = file(&folder, "half.toml", "schema = 1\n[relaxation]\nshare = 0.5\ntau_s = 5.5\n");
    assert!(remarks(&["model", &half]) && !remarks(&["model", "paper"]), "with the model that was sent");
    assert!(!remarks(&["settings"]) && !remarks(&["settings", &for_a_small_share]), "some models would have one");
    assert!(remarks(&["settings", &as_well]), "with none");
    assert!(!remarks(&["settings", "--default"]) && !remarks(&["model", &half]), "another controller");
}

/// The model that is stored decides which gains can run.
#[test]
fn settings_that_the_stored_model_cannot_run_with_are_refused_by_the_mcu() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let spring = file(&folder, "short.toml", "schema = 1\n[relaxation]\nshare = 0.0\ntau_s = 0.01\n");
    good(&mcu.port, &["model", &spring]);
    let strong = file(&folder, "strong.toml", "schema = 1\n[gains]\nproportional = 90\n");
    let text = bad(2, &mcu.port, &["settings", &strong]);
    assert!(text.contains("strong.toml: the settings cannot be run: proportional_gain has to lie within"), "{text}");
    assert!(good(&mcu.port, &["settings"]).starts_with("# runs    the one that is built in"));
}

#[test]
fn an_mcu_that_does_not_run_the_settings_that_were_sent_is_a_failure() {
    let mcu = Mcu::on_socket(Setup { forgets: true, ..Setup::default() });
    let text = bad(1, &mcu.port, &["settings", "--default"]);
    assert!(text.contains("does not run what was sent as settings (format 1, "), "{text}");
}
