//! Where a record begins.

use super::{LEVELS_V, ROWS_PER_LEVEL, SAMPLE_S, causes, diagnosed, noise, read};

/// At 0 V, but still on the way down from a voltage before; few readings tell of it.
#[test]
fn a_spring_still_on_its_way_down_is_no_cause() {
    for (seed, rest) in [(1, 5), (2, 10), (3, 60)] {
        let before = |row: usize| 120.0 * (-(row as f64) * SAMPLE_S / 5.5).exp() * 10.0 / 11.0;
        let skipped = ROWS_PER_LEVEL - rest;
        // All of it shifted in time: what was left at the first row decays beside all that comes.
        let rows: Vec<_> =
            read(seed, |row, y, noise| if row < skipped { y } else { y + before(row - skipped) + noise });
        let report = diagnosed(&rows[skipped..]);
        assert_eq!(report["verdict"], "consistent", "{rest}: {report}");
    }
}

/// Play operators that come from a large voltage, read by a sensor that was then set to zero.
#[test]
fn hysteresis_is_found_on_the_branch_that_comes_down_too() {
    const PLAYS: [(f64, f64); 3] = [(15.0, 0.1), (50.0, 0.1), (100.0, 0.1)];
    let kept = (-SAMPLE_S / 5.5).exp();
    let mut plays = PLAYS.map(|(threshold, _)| threshold);
    let zero: f64 = PLAYS.iter().map(|(threshold, weight)| threshold * weight).sum();
    let mut lag = 0.0;
    let volts = LEVELS_V.into_iter().flat_map(|volts| std::iter::repeat_n(volts, ROWS_PER_LEVEL));
    let spring = volts.map(|volts| {
        for (play, (threshold, _)) in plays.iter_mut().zip(PLAYS) {
            *play = play.clamp(volts - threshold, volts + threshold);
        }
        let memory = 0.7 * volts + plays.iter().zip(PLAYS).map(|(play, (_, weight))| weight * play).sum::<f64>() - zero;
        let now = lag + (memory - lag) / 11.0;
        lag = memory + (lag - memory) * kept;
        (volts, now)
    });
    let exact: Vec<_> = spring.collect();
    let noise = noise(7, exact.len());
    let rows: Vec<_> = exact.into_iter().zip(noise).map(|((u, y), noise)| (u, y + noise)).collect();
    let report = diagnosed(&rows);
    assert_eq!(causes(&report), ["hysteresis"], "{report}");
    let width = report["findings"][0]["parameters"]["width_v"]["value"].as_f64().unwrap();
    assert!((width / 33.0 - 1.0).abs() < 0.1, "{width}");
    assert!(report["extended"]["rmse"].as_f64().unwrap() < 1.1, "{report}");
}
