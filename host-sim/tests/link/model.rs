//! A model for the MCU.

use serde_json::Value;

use crate::mcu::{Mcu, Setup};
use crate::vsj::{bad, good, json, run, stdout};

#[test]
fn a_model_is_sent_checked_stored_and_run() {
    let mcu = Mcu::on_socket(Setup::default());
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    assert!(good(&mcu.port, &["model"]).starts_with("runs    the one that is built in\n"));

    let spring = file("spring.toml", include_str!("../../../docs/plant.toml"));
    let output = run(&mcu.port, &["model", &spring]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("not run by the MCU: amplifier.delay_s, drift"));
    assert!(stdout(&output).starts_with("runs    number 1, format 1, 229 bytes, CRC "), "{output:?}");
    assert!(!String::from_utf8_lossy(&output.stderr).contains("at rest"), "{output:?}");
    let models = json(&mcu.port, &["model"]);
    assert_eq!((&models["active"], &models["active"]["number"]), (&models["stored"], &Value::from(1)));

    // Valid at 10 kHz, but its instantaneous part is too large for the built-in gains, which the MCU detects.
    let steep = file(
        "steep.toml",
        "schema = 1\n[law]\nvoltage_v = [0, 100]\nstiffness = [0, 900]\n[relaxation]\nshare = 0.1\ntau_s = 0.004\n",
    );
    let text = bad(2, &mcu.port, &["model", &steep]);
    assert!(text.contains("steep.toml: the model cannot be run: proportional_gain has to lie within"), "{text}");
    good(&mcu.port, &["arm"]);
    let text = bad(1, &mcu.port, &["model", "paper"]);
    assert!(text.contains("refused: armed; disarm it first"), "{text}");
    good(&mcu.port, &["disarm"]);
    assert_eq!(json(&mcu.port, &["model"]), models, "what is refused changes nothing");

    good(&mcu.port, &["set", "300", "--arm", "--keep", "0.2"]);
    good(&mcu.port, &["disarm"]);
    let output = run(&mcu.port, &["model", "paper"]);
    assert!(stdout(&output).starts_with("runs    number 2, format 1, 25 bytes, CRC "), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("takes it to be at rest"), "{output:?}");
    let text = bad(2, &mcu.port, &["model", "nowhere.toml"]);
    assert!(text.contains("nowhere.toml: cannot be read"), "{text}");
}

#[test]
fn an_mcu_that_does_not_run_the_model_that_was_sent_is_a_failure() {
    let mcu = Mcu::on_socket(Setup { forgets: true, ..Setup::default() });
    let text = bad(1, &mcu.port, &["model", "paper"]);
    assert!(text.contains("does not run what was sent as model (format 1, 25 bytes, CRC "), "{text}");
    assert!(text.contains("it runs the one that is built in, and has stored the one that is built in"), "{text}");
}
