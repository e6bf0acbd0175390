//! Plant files with an effect that the spring does not have.

use serde_json::Value;

use super::{causes, diagnosed_with, noise, with_share};

const RELAXATION: &str = "[relaxation]\nshare = 0.09090909090909091\n";
const MEMORY: &str = "[memory]\ndirect = 0.7\nthresholds_v = [20.0, 50.0]\nweights = [0.2, 0.1]\n";

/// Name of each part of a plant file, its text, and the text of the relaxation before it.
const PARTS: [(&str, &str, &str); 6] = [
    ("memory", MEMORY, "tau_s = 5.5\n"),
    ("law", "[law]\nvoltage_v = [0, 200, 350, 500]\nstiffness = [0, 160, 310, 500]\n", "tau_s = 5.5\n"),
    ("leakage", "[leakage]\nshare = 0.1\ntau_s = 40.0\n", "tau_s = 5.5\n"),
    ("amplifier", "[amplifier]\nlimit_v = 420.0\n", "tau_s = 5.5\n"),
    ("relaxation.tau_high_s", "", "tau_s = 5.5\ntau_high_s = 9.0\n"),
    ("relaxation.weights", "", "tau_s = [5.5, 40.0]\nweights = [0.75, 0.1590909090909091]\n"),
];

fn diagnosis_of(gain: f64, seed: u64, part: &str, relaxation: &str) -> Value {
    let exact = with_share(1.0 / 11.0, gain, 5.5);
    let noise = noise(seed, exact.len());
    let rows: Vec<_> = exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect();
    diagnosed_with(&rows, &format!("schema = 1\n{RELAXATION}{relaxation}{part}"))
}

#[test]
fn it_is_taken_out_and_what_is_wrong_beside_it_is_named() {
    for (seed, (name, part, relaxation)) in PARTS.into_iter().enumerate() {
        // A gain error stands beside every second part, but not beside the law: a law times a gain is another law.
        let has_gain = seed % 2 == 0 && name != "law";
        let (gain, wrong) = if has_gain { (1.1, Some("gain-error")) } else { (1.0, None) };
        let report = diagnosis_of(gain, seed as u64, part, relaxation);
        assert_eq!(report["take_out"], serde_json::json!([name]), "{report}");
        assert_eq!(report["verdict"], "explained", "{name}: {report}");
        assert_eq!(causes(&report), Vec::from_iter(wrong), "{name}: {report}");
        let [before, after] = ["baseline", "extended"].map(|of| report[of]["held_out_rmse"].as_f64().unwrap());
        assert!(after < 1.1 && before > 1.2 * after, "{name}: {report}");
    }
}

#[test]
fn what_the_spring_has_stays() {
    // A limit that the record never reaches is not removed.
    let report = diagnosis_of(1.1, 1, "[amplifier]\nlimit_v = 690.0\n", "tau_s = 5.5\n");
    assert!(report["take_out"].is_null() && causes(&report) == ["gain-error"], "{report}");
    // The same spring, its gain written as a law.
    let law = "[law]\nvoltage_v = [0, 500]\nstiffness = [0, 550]\n";
    let report = diagnosis_of(1.1, 2, law, "tau_s = 5.5\n");
    assert!(report["take_out"].is_null() && report["verdict"] == "consistent", "{report}");
}
