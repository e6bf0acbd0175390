//! Laws of a cause that differ from its usual one, in records of a small simulator in this file: the cause is the first finding.

use identify::{Options, Report, Verdict, diagnose};
use random_numbers::Lcg64;
use simulation::record::{Record, Row};

const ROWS: usize = 2400;
const SAMPLE_S: f64 = 0.1;
/// Integration steps per row.
const STEPS: usize = 40;
const TAU_S: f64 = 5.5;

/// Returns a record of levels that are held for 6 to 16 s. `tau_s` is the time constant over settled stiffness and relaxed part,
/// `reads` makes a reading of row and stiffness; noise of 1 V is added.
fn record(seed: u64, tau_s: impl Fn(f64, f64) -> f64, reads: impl FnMut(usize, f64) -> f64) -> Record {
    settling(seed, |voltage_v| voltage_v, tau_s, reads)
}

/// Returns the same of a spring whose settled stiffness `settles` computes from each new voltage.
fn settling(
    seed: u64,
    mut settles: impl FnMut(f64) -> f64,
    tau_s: impl Fn(f64, f64) -> f64,
    mut reads: impl FnMut(usize, f64) -> f64,
) -> Record {
    let mut random = Lcg64::new(seed);
    let (mut voltage_v, mut settled, mut relaxed, mut until) = (0.0, 0.0, 0.0, 40);
    let row = |row: usize| {
        if row == until {
            voltage_v = 50.0 * (11.0 * random.uniform()).floor();
            settled = settles(voltage_v);
            until += 60 + (100.0 * random.uniform()) as usize;
        }
        let stiffness = settled / 11.0 + 10.0 / 11.0 * relaxed;
        for _ in 0..STEPS {
            relaxed += (settled - relaxed) * SAMPLE_S / STEPS as f64 / tau_s(settled, relaxed);
        }
        let noise = random.normal();
        Row { line: row + 2, time_s: SAMPLE_S * row as f64, voltage_v, measured: Some(reads(row, stiffness) + noise) }
    };
    Record { name: "levels".into(), rows: (0..ROWS).map(row).collect() }
}

fn first(record: &Record) -> (String, Report) {
    let report = diagnose(record, &Options::default()).expect("a report");
    (report.findings.first().map_or_else(String::new, |finding| finding.cause.to_string()), report)
}

fn value(report: &Report, parameter: &str) -> f64 {
    let parameters = &report.findings[0].parameters;
    parameters
        .iter()
        .find(|(name, _)| name == parameter)
        .unwrap_or_else(|| panic!("{parameter}: {parameters:?}"))
        .1
        .value
}

#[test]
fn time_constant_that_depends_on_the_direction_is_a_voltage_dependent_one() {
    for (seed, rising_s, falling_s) in [(1, 3.5, 7.0), (2, 8.0, 4.5)] {
        let tau_s = |settled: f64, relaxed: f64| if settled > relaxed { rising_s } else { falling_s };
        let (cause, report) = first(&record(seed, tau_s, |_, stiffness| stiffness));
        assert_eq!(cause, "voltage-dependent-time-constant", "{report:?}");
        assert!((value(&report, "tau_rising_s") - rising_s).abs() < 0.1, "{report:?}");
        assert!((value(&report, "tau_falling_s") - falling_s).abs() < 0.1, "{report:?}");
    }
}

#[test]
fn backlash_of_the_sensor_is_hysteresis() {
    let (threshold, mut shown) = (12.0, 0.0f64);
    let reads = |_, stiffness: f64| {
        shown = shown.clamp(stiffness - threshold, stiffness + threshold);
        shown
    };
    let (cause, report) = first(&record(4, |_, _| TAU_S, reads));
    assert_eq!(cause, "hysteresis", "{report:?}");
    assert!((value(&report, "width_v") - 2.0 * threshold).abs() < 0.5, "{report:?}");
}

#[test]
fn step_of_the_gain_is_a_drift() {
    for (seed, factor, at) in [(5, 1.06, 900), (6, 0.94, 1500)] {
        let reads = |row: usize, stiffness: f64| if row >= at { factor * stiffness } else { stiffness };
        let (cause, report) = first(&record(seed, |_, _| TAU_S, reads));
        assert_eq!(cause, "drift", "{report:?}");
        assert!((value(&report, "factor") - factor).abs() < 0.003, "{report:?}");
        assert!((value(&report, "at_s") - SAMPLE_S * at as f64).abs() < 1.0, "{report:?}");
    }
}

#[test]
fn friction_under_load_is_hysteresis() {
    let mut before = 0.0;
    let mut gain = 1.05;
    let settles = |voltage_v: f64| {
        if voltage_v != before {
            gain = if voltage_v > before { 1.05 } else { 0.95 };
            before = voltage_v;
        }
        gain * voltage_v
    };
    let (cause, report) = first(&settling(7, settles, |_, _| TAU_S, |_, stiffness| stiffness));
    assert_eq!(cause, "hysteresis", "{report:?}");
    // Equal outputs of both branches: 475 V of 500 V down and of 452.4 V up.
    assert!((value(&report, "width_v") - (500.0 - 475.0 / 1.05)).abs() < 0.5, "{report:?}");
}

/// From rest 0.7 u + 0.3 u^2 / 500 V; after a reversal half of the curvature: 500 plays of thresholds 1 V apart.
#[test]
fn rayleighs_law_is_hysteresis_without_a_gain_error() {
    for seed in [21, 22] {
        let mut plays = [0.0f64; 500];
        let settles = |voltage_v: f64| {
            let steps = plays.iter_mut().enumerate().map(|(play, state)| {
                let threshold = play as f64 + 0.5;
                *state = state.clamp(voltage_v - threshold, voltage_v + threshold);
                *state
            });
            0.7 * voltage_v + 2.0 * 0.3 / 500.0 * steps.sum::<f64>()
        };
        let record = settling(seed, settles, |_, _| TAU_S, |_, stiffness| stiffness);
        let (cause, report) = first(&record);
        assert_eq!((cause.as_str(), report.findings.len()), ("hysteresis", 1), "{report:?}");
        assert!((value(&report, "slope") - 0.7).abs() < 0.03, "{report:?}");
        assert!(report.extended.quality.held_out_rmse < 1.2, "{report:?}");
    }
}

/// What is linear of it is a gain error. Whatever else is named, the record is then not explained.
#[test]
fn dead_band_is_a_static_nonlinearity() {
    let (cause, report) =
        first(&settling(8, |voltage_v| (voltage_v - 40.0).max(0.0), |_, _| TAU_S, |_, stiffness| stiffness));
    let causes: Vec<_> = report.findings.iter().map(|finding| finding.cause).collect();
    let is_of_it = |cause: &str| ["static-nonlinearity", "gain-error"].contains(&cause);
    assert!(causes.contains(&"static-nonlinearity") && is_of_it(&cause), "{report:?}");
    assert!(report.verdict == Verdict::Unexplained || causes.iter().all(|cause| is_of_it(cause)), "{report:?}");
}

#[test]
fn slow_wave_and_warming_up_are_drifts() {
    let time_s = |row: usize| SAMPLE_S * row as f64;
    let wave = |row: usize, y: f64| y * (1.0 + 0.04 * (std::f64::consts::TAU * time_s(row) / 150.0).sin());
    let warm = |row: usize, y: f64| y + 20.0 * -(-time_s(row) / 60.0).exp_m1();
    let (cause, report) = first(&record(9, |_, _| TAU_S, wave));
    assert_eq!(cause, "drift", "{report:?}");
    assert!((value(&report, "freq_hz") - 1.0 / 150.0).abs() < 1e-4, "{report:?}");
    let (cause, report) = first(&record(9, |_, _| TAU_S, warm));
    assert_eq!(cause, "drift", "{report:?}");
    assert!((value(&report, "change") - 20.0 / 500.0).abs() < 0.002, "{report:?}");
}

#[test]
fn flow_is_a_second_relaxation_that_is_added() {
    let mut flowing = record(10, |_, _| TAU_S, |_, stiffness| stiffness);
    let mut flow = 0.0;
    for row in &mut flowing.rows {
        row.measured = row.measured.map(|reading| reading + flow);
        flow += 5e-4 * SAMPLE_S * row.voltage_v;
    }
    let (cause, report) = first(&flowing);
    assert_eq!(cause, "second-relaxation", "{report:?}");
}

#[test]
fn sensor_that_overshoots_slightly_is_a_lag() {
    // A damping ratio of 0.7 at 2 rad/s; the voltage passes the sensor before the spring, which has the same response.
    let mut overshoots = record(12, |_, _| TAU_S, |_, stiffness| stiffness);
    let mut random = Lcg64::new(16);
    let (mut x, mut rate, mut relaxed) = (0.0f64, 0.0f64, 0.0f64);
    for row in &mut overshoots.rows {
        let noise = random.normal();
        row.measured = Some(x / 11.0 + 10.0 / 11.0 * relaxed + noise);
        for _ in 0..STEPS {
            let step_s = SAMPLE_S / STEPS as f64;
            relaxed += (x - relaxed) * step_s / TAU_S;
            rate += step_s * (4.0 * (row.voltage_v - x) - 2.0 * 0.7 * 2.0 * rate);
            x += step_s * rate;
        }
    }
    let (cause, report) = first(&overshoots);
    assert_eq!(cause, "series-lag", "{report:?}");
    assert!((value(&report, "zeta") - 0.7).abs() < 0.05, "{report:?}");
}

#[test]
fn hum_may_follow_the_response() {
    let modulated = |row: usize, y: f64| y * (1.0 + 0.03 * (std::f64::consts::TAU * 0.7 * SAMPLE_S * row as f64).sin());
    let (cause, report) = first(&record(13, |_, _| TAU_S, modulated));
    assert_eq!(cause, "hum", "{report:?}");
    assert!((value(&report, "freq_hz") - 0.7).abs() < 1e-3, "{report:?}");
}

/// Nothing else is wrong with the spring whose readings were lost.
#[test]
fn readings_that_were_lost_are_late_and_the_others_are_diagnosed() {
    let mut held = record(14, |_, _| TAU_S, |_, stiffness| stiffness);
    let mut random = Lcg64::new(15);
    for row in 1..ROWS {
        if random.uniform() < 0.4 {
            held.rows[row].measured = held.rows[row - 1].measured;
        }
    }
    let (cause, report) = first(&held);
    assert!(cause == "delay" && report.findings.len() == 1 && report.rows == ROWS, "{report:?}");
    assert!((value(&report, "delay_s") - 0.1 * 0.4 / 0.6).abs() < 0.01, "{report:?}");
}

/// An outflow with the square root of the level, and a spring that gets stiffer: forces that are not linear in what is relaxed.
#[test]
fn restoring_force_that_is_not_linear_is_a_static_nonlinearity() {
    for (seed, power) in [(17, 0.6), (18, 1.6)] {
        let mut flowing = record(seed, |_, _| TAU_S, |_, stiffness| stiffness);
        let mut random = Lcg64::new(seed + 10);
        let mut level = 0.0f64;
        for row in &mut flowing.rows {
            let noise = random.normal();
            row.measured = Some(level + noise);
            for _ in 0..STEPS {
                level +=
                    (row.voltage_v - 500.0 * (level.max(0.0) / 500.0).powf(power)) * SAMPLE_S / STEPS as f64 / TAU_S;
            }
        }
        let (cause, report) = first(&flowing);
        let causes: Vec<_> = report.findings.iter().map(|finding| finding.cause).collect();
        assert!(cause == "static-nonlinearity" && report.verdict != Verdict::Unexplained, "{report:#?}");
        // The level has no instantaneous part, the paper's spring has.
        assert!(
            causes.iter().all(|cause| ["static-nonlinearity", "instantaneous-share"].contains(cause)),
            "{causes:?}"
        );
        assert!(report.extended.quality.held_out_rmse < 1.1, "{report:#?}");
        for (name, parameter) in &report.findings[0].parameters {
            let voltage: f64 = name.trim_start_matches("at_").trim_end_matches("_v").parse().unwrap();
            let settled = 500.0 * (voltage / 500.0).powf(1.0 / power);
            assert!((parameter.value - settled).abs() < 1.0, "{name}: {settled} V, {parameter:?}");
        }
    }
}
