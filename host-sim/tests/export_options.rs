//! No option of `vsj export` is without an effect on what is exported.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

fn vsj(arguments: &[&str], out: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
    let output = command.args(["export", "c"]).args(arguments).arg("--out").arg(out).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// What the client in C++ sends is what the command sends.
#[test]
fn an_exported_model_is_the_one_that_the_command_sends() {
    let plant = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/plant.toml");
    let folder = tempfile::tempdir().unwrap();
    for (name, left_out) in [("paper", ""), (plant, "not run by the MCU: amplifier.delay_s, drift")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
        let output =
            command.args(["export", "model", "--json", "--plant", name, "--out"]).arg(folder.path()).output().unwrap();
        assert!(String::from_utf8_lossy(&output.stderr).contains(left_out), "{output:?}");
        let sent = simulation::plant_file::load(name).unwrap().wire().unwrap().payload().unwrap();
        assert_eq!(std::fs::read(folder.path().join("model.bin")).unwrap(), sent[..]);
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let identity = serde_json::to_value(link::BlockId::of(0, &sent)).unwrap();
        for key in ["format", "length", "checksum"] {
            assert_eq!(answer[key], identity[key], "{key}");
        }
    }
}

#[test]
fn every_option_of_the_loop_changes_the_settings_for_c() {
    let plant = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/plant.toml");
    let cases: [&[&str]; 16] = [
        &[],
        &["--controller", "fast"],
        &["--plant", plant],
        &["--limit-v", "500"],
        &["--min-v", "10"],
        &["--slew-v-per-s", "1000"],
        &["--dac-bits", "10"],
        &["--kp", "5"],
        &["--ki", "1"],
        &["--approach-s", "0.1", "--controller", "fast"],
        &["--known", "tau=5"],
        &["--known", "share=5"],
        &["--known", "gain=5"],
        &["--overshoot-percent", "3", "--known", "tau=5"],
        &["--fall-back-percent", "25", "--known", "tau=5"],
        &["--rate-hz", "2000"],
    ];
    let folder = tempfile::tempdir().unwrap();
    let exported = cases.map(|arguments| {
        vsj(arguments, folder.path());
        let text = std::fs::read_to_string(folder.path().join("vsj_settings.h")).unwrap();
        // Without the comments, which name the plant file.
        text.lines().filter(|line| line.trim_start().starts_with('.')).collect::<Vec<_>>().join("\n")
    });
    assert_eq!(exported.iter().collect::<BTreeSet<_>>().len(), cases.len(), "{exported:#?}");
    let help = vsj(&["--help"], folder.path());
    let known = help.lines().filter_map(|line| line.trim_start().strip_prefix("--")?.split_whitespace().next());
    for option in known.filter(|option| !["out", "json"].contains(option)) {
        let tried = |arguments: &&[&str]| arguments.iter().any(|it| it.strip_prefix("--") == Some(option));
        assert!(cases.iter().any(tried), "--{option}");
    }
}

#[test]
fn a_changed_file_of_the_example_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    vsj(&[], folder.path());
    for name in ["main.c", "CMakeLists.txt", "vsj_settings.h", "vsj_tick.h"] {
        std::fs::write(folder.path().join(name), "changed").unwrap();
    }
    std::fs::remove_file(folder.path().join("semihosting.c")).unwrap();
    let answer = vsj(&["--kp", "5", "--json"], folder.path());
    assert!(answer.contains(r#""kept":["main.c","CMakeLists.txt"]"#), "{answer}");
    let is_kept = |name: &str| std::fs::read(folder.path().join(name)).unwrap() == b"changed";
    assert!(is_kept("main.c") && is_kept("CMakeLists.txt") && !is_kept("vsj_settings.h") && !is_kept("vsj_tick.h"));
    assert!(folder.path().join("semihosting.c").exists());
}
