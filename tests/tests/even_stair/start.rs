//! The initial state of a record.

use std::collections::VecDeque;

use super::{LEVELS_V, ROWS_PER_LEVEL, SAMPLE_S, causes, diagnosed, noise, read};

/// The record starts at 0 V while the spring still relaxes from an earlier voltage.
#[test]
fn a_spring_that_still_relaxes_at_the_start_gets_no_finding() {
    for (seed, rest) in [(1, 5), (2, 10), (3, 60)] {
        let before = |row: usize| 120.0 * (-(row as f64) * SAMPLE_S / 5.5).exp() * 10.0 / 11.0;
        let skipped = ROWS_PER_LEVEL - rest;
        // The rest at the first row decays in addition to the response to the commands.
        let rows: Vec<_> =
            read(seed, |row, y, noise| if row < skipped { y } else { y + before(row - skipped) + noise });
        let report = diagnosed(&rows[skipped..]);
        assert_eq!(report["verdict"], "consistent", "{rest}: {report}");
    }
}

/// Play operators with an initial condition on the descending branch, and a sensor that was zeroed there.
#[test]
fn hysteresis_that_starts_on_the_descending_branch_is_found() {
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

/// Number of rows before the record in the longer one that it is cut from: 0.3 s after a step from 150 to 370 V.
const CUT: usize = 790;

/// A record cut from a longer stair of uneven steps; `spring` maps each row's voltage to its stiffness.
fn cut(seed: u64, spring: impl FnMut(f64) -> f64) -> Vec<(f64, f64)> {
    const LEVELS_V: [f64; 10] = [0.0, 320.0, 500.0, 150.0, 430.0, 240.0, 370.0, 60.0, 460.0, 200.0];
    let step = |index: usize| (LEVELS_V[index * 3 % 10], 40 + index * 37 % 61);
    let levels = (0..60).flat_map(|index| std::iter::repeat_n(step(index).0, step(index).1)).take(2_800);
    let volts: Vec<f64> = levels.collect();
    let noise = noise(seed, volts.len());
    let read = volts.iter().copied().map(spring).zip(&noise).map(|(y, noise)| y + noise);
    volts.iter().copied().zip(read.collect::<Vec<_>>()).skip(CUT).collect()
}

/// First-order lag with the time constant `tau_s`; returns its output before the input acts.
fn lag(tau_s: f64) -> impl FnMut(f64) -> f64 {
    let (kept, mut value) = ((-SAMPLE_S / tau_s).exp(), 0.0);
    move |input| {
        let now = value;
        value = input + (value - input) * kept;
        now
    }
}

fn relaxed(mut lag: impl FnMut(f64) -> f64) -> impl FnMut(f64) -> f64 {
    move |volts| volts / 11.0 + lag(volts) * 10.0 / 11.0
}

/// The state of leakage, creep, resonance, delay or slew before the first row must not cause a finding of its own.
#[test]
fn a_cause_is_found_in_a_record_cut_out_of_a_longer_one() {
    let leaking = || {
        let (mut spring, mut leaked) = (relaxed(lag(5.5)), lag(25.0));
        move |volts| spring(volts) - 0.2 * leaked(volts)
    };
    let creeping = || {
        let (mut spring, mut slow) = (relaxed(lag(5.5)), lag(40.0));
        move |volts| 0.85 * spring(volts) + 0.15 * slow(volts)
    };
    // The instantaneous part oscillates at 0.6 Hz with a damping ratio of 0.05; its state rotates by an angle per row.
    let swinging = || {
        let (mut spring, mut last, mut x, mut rate) = (relaxed(lag(5.5)), 0.0, 0.0, 0.0);
        move |volts: f64| {
            const OMEGA: f64 = std::f64::consts::TAU * 0.6;
            x -= (volts - last) / 11.0;
            last = volts;
            let now = spring(volts) + x;
            let damped = OMEGA * (1.0 - 0.05f64 * 0.05).sqrt();
            let (decay, (sin, cos)) = ((-0.05 * OMEGA * SAMPLE_S).exp(), (damped * SAMPLE_S).sin_cos());
            let along = (rate + 0.05 * OMEGA * x) / damped;
            let lean = (OMEGA * OMEGA * x + 0.05 * OMEGA * rate) / damped;
            (x, rate) = (decay * (x * cos + along * sin), decay * (rate * cos - lean * sin));
            now
        }
    };
    let late = || {
        let (mut spring, mut sent) = (relaxed(lag(5.5)), VecDeque::from([0.0; 5]));
        move |volts| {
            sent.push_back(volts);
            spring(sent.pop_front().expect("the queue has five entries"))
        }
    };
    let slewing = || {
        let (mut follows, mut at) = (lag(5.5), 0.0);
        move |volts: f64| {
            let next: f64 = volts.clamp(at - 15.0, at + 15.0);
            let now = at / 11.0 + follows(0.5 * (at + next)) * 10.0 / 11.0;
            at = next;
            now
        }
    };
    for seed in 1..=2 {
        for (cause, parameter, value, rows) in [
            ("charge-leakage", "tau_s", 25.0, cut(seed, leaking())),
            ("second-relaxation", "tau_s", 40.0, cut(seed, creeping())),
            ("resonance", "freq_hz", 0.6, cut(seed, swinging())),
            ("delay", "delay_s", 0.5, cut(seed, late())),
            ("amplifier-slew", "slew_v_per_s", 150.0, cut(seed, slewing())),
        ] {
            let report = diagnosed(&rows);
            assert_eq!(causes(&report), [cause], "{seed}: {report}");
            let found = report["findings"][0]["parameters"][parameter]["value"].as_f64().unwrap();
            assert!((found / value - 1.0).abs() < 0.1, "{cause} {seed}: {found}");
        }
    }
}
