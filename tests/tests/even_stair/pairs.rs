//! Pairs of causes of which each alone seems to explain the whole error.

use std::collections::VecDeque;

use super::{LEVELS_V, ROWS_PER_LEVEL, causes, diagnosed, noise, seen_through};

/// Diagnosis of the stair with a spring of the instantaneous share `share` after an amplifier, evaluated 1000 times per
/// second.
fn found(seed: u64, share: f64, amplifier: impl FnMut(f64) -> f64) -> serde_json::Value {
    let volts = LEVELS_V.into_iter().flat_map(|volts| std::iter::repeat_n(volts, ROWS_PER_LEVEL));
    let exact = seen_through(volts, share, amplifier);
    let noise = noise(seed, exact.len());
    diagnosed(&exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect::<Vec<_>>())
}

/// Without the delay, the few rows after a step resemble outliers; with it, a fraction of a row resembles a larger
/// share.
#[test]
fn a_delay_and_an_instantaneous_share_are_both_found() {
    for (seed, delay_ms) in [(1, 330), (2, 550), (3, 870)] {
        let mut on_the_way = VecDeque::from(vec![0.0; delay_ms]);
        let report = found(seed, 0.25, |volts| {
            on_the_way.push_back(volts);
            on_the_way.pop_front().unwrap()
        });
        let mut names = causes(&report);
        names.sort_unstable();
        assert_eq!(names, ["delay", "instantaneous-share"], "{delay_ms}: {report}");
        for (index, (name, truth)) in [("delay_s", delay_ms as f64 / 1000.0), ("share", 0.25)].into_iter().enumerate() {
            let finding =
                report["findings"].as_array().unwrap().iter().find(|finding| finding["cause"] == names[index]);
            let parameter = &finding.unwrap()["parameters"][name];
            let [low, high] = ["low", "high"].map(|end| parameter[end].as_f64().unwrap());
            assert!(low <= truth && truth <= high && high - low < 0.25, "{delay_ms}: {name} {low} {high}");
        }
    }
}

#[test]
fn a_slew_limit_and_an_instantaneous_share_are_both_found() {
    for (seed, volts_per_s) in [(4, 120.0), (5, 170.0), (6, 240.0)] {
        let mut out = 0.0;
        let report = found(seed, 0.3, |volts: f64| {
            let step = volts_per_s / 1000.0;
            out += (volts - out).clamp(-step, step);
            out
        });
        let mut names = causes(&report);
        names.sort_unstable();
        assert_eq!(names, ["amplifier-slew", "instantaneous-share"], "{volts_per_s}: {report}");
    }
}
