//! Causes that can stand in for each other are named each for itself.

use identify::{Input, Options, Report, diagnose};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

/// Time between rows, in s.
const SAMPLE_S: f64 = 0.1;

/// A spring: what follows the voltage instantaneously, what relaxes, and what precedes both; and how it is driven and read.
struct Spring {
    gain: f64,
    /// Width of a play in front of the relaxation, in V.
    width_v: f64,
    /// Bend of the settled curve, fixed at 0 and 500 V.
    bend: f64,
    share: f64,
    tau_s: f64,
    /// Time constant at 500 V over that at 0 V; in between it changes geometrically.
    quicker: f64,
    /// Part of the relaxing response with a time constant of its own, in s.
    slow: (f64, f64),
    /// Part of the response that is lost under constant voltage, with its time constant, in s.
    leaks: (f64, f64),
    /// Rows by which all is late.
    late: usize,
    /// Step to which readings are cut off, in V; 0 for none.
    cut_v: f64,
    /// Rows of each level.
    held: usize,
}

const PAPER: Spring = Spring {
    gain: 1.0,
    width_v: 0.0,
    bend: 0.0,
    share: 1.0 / 11.0,
    tau_s: 5.5,
    quicker: 1.0,
    slow: (0.0, 40.0),
    leaks: (0.0, 30.0),
    late: 0,
    cut_v: 0.0,
    held: 120,
};

/// The report on a record of held levels with noise of 1 V.
fn report(spring: &Spring, levels: &[f64]) -> Report {
    let mut numbers = Lcg32::new(1);
    let mut uniform = move || numbers.uniform() - 0.5;
    let (mut play, mut lag, mut slow, mut leak) = (0.0f64, 0.0, 0.0, 0.0);
    let follow =
        |state: &mut f64, target: f64, tau_s: f64| *state += (target - *state) * -f64::exp_m1(-SAMPLE_S / tau_s);
    let mut row = |index: usize| {
        let voltage_v = levels[index / spring.held];
        let late_v = levels[index.saturating_sub(spring.late) / spring.held];
        play = play.clamp(late_v - spring.width_v / 2.0, late_v + spring.width_v / 2.0);
        let input = spring.gain * play * (1.0 + spring.bend * (play.abs() / 500.0 - 1.0));
        let ((part, slow_s), (lost, leak_s)) = (spring.slow, spring.leaks);
        let whole = spring.share * input + (1.0 - spring.share) * ((1.0 - part) * lag + part * slow);
        let noise = 2.0 * (uniform() + uniform() + uniform());
        let mut reading = whole - lost * leak + noise;
        if spring.cut_v > 0.0 {
            reading = spring.cut_v * (reading / spring.cut_v).floor();
        }
        follow(&mut lag, input, spring.tau_s * spring.quicker.powf(late_v / 500.0));
        follow(&mut slow, input, slow_s);
        follow(&mut leak, whole, leak_s);
        Row { line: index + 2, time_s: SAMPLE_S * index as f64, voltage_v, measured: Some(reading) }
    };
    let record = Record { name: String::new(), rows: (0..spring.held * levels.len()).map(&mut row).collect() };
    diagnose(&record, &Options::default()).unwrap()
}

/// The causes that are named, in alphabetical order.
fn causes(spring: &Spring, levels: &[f64]) -> Vec<&'static str> {
    let mut causes: Vec<_> = report(spring, levels).findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    causes
}

/// Up and down with reversals between.
const LOOPS: [f64; 16] =
    [0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 350.0, 200.0, 50.0, 250.0, 450.0, 300.0, 150.0, 0.0, 400.0, 100.0];

#[test]
fn a_gain_is_named_beside_hysteresis_and_beside_a_curve() {
    let loops = Spring { gain: 1.1, width_v: 40.0, ..PAPER };
    assert_eq!(causes(&loops, &LOOPS), ["gain-error", "hysteresis"]);
    let curve = Spring { gain: 0.9, bend: 0.2, ..PAPER };
    assert_eq!(causes(&curve, &LOOPS), ["gain-error", "static-nonlinearity"]);
    assert_eq!(causes(&Spring { width_v: 40.0, ..PAPER }, &LOOPS), ["hysteresis"]);
    assert_eq!(causes(&Spring { bend: 0.2, ..PAPER }, &LOOPS), ["static-nonlinearity"]);
}

/// The curve is that of the voltage, not of the voltage multiplied by the gain.
#[test]
fn a_gain_multiplies_the_curve_beside_it() {
    let report = report(&Spring { gain: 0.9, bend: 0.2, ..PAPER }, &LOOPS);
    let values: Vec<_> = report.findings.iter().flat_map(|finding| &finding.parameters).collect();
    for (name, truth, tolerance) in [("gain", 0.9, 0.004), ("at_100_v", 84.0, 0.6), ("at_300_v", 276.0, 0.9)] {
        let value = values.iter().find(|it| it.0 == name).expect("a parameter").1.value;
        assert!((value - truth).abs() < tolerance, "{name}: {value}, {values:?}");
    }
}

#[test]
fn a_share_and_a_time_constant_are_not_leakage_and_gain() {
    let spring = Spring { share: 0.16, tau_s: 7.5, ..PAPER };
    assert_eq!(causes(&spring, &LOOPS), ["instantaneous-share", "time-constant"]);
    let spring = Spring { gain: 1.1, leaks: (0.15, 40.0), ..PAPER };
    assert_eq!(causes(&spring, &LOOPS), ["charge-leakage", "gain-error"]);
}

#[test]
fn a_slower_second_relaxation_does_not_trade_places_with_the_main_one() {
    let spring = Spring { tau_s: 8.0, slow: (0.2, 60.0), ..PAPER };
    assert_eq!(causes(&spring, &LOOPS), ["second-relaxation", "time-constant"]);
}

/// Creep that is added to the response is the same as creep of everything with a gain that restores what it takes.
#[test]
fn creep_that_is_added_is_not_a_gain_and_creep() {
    for added in [0.06, 0.15] {
        let whole = 1.0 + added;
        let share = PAPER.share / whole;
        let spring = Spring { gain: whole, share, slow: (added / whole / (1.0 - share), 40.0), ..PAPER };
        assert_eq!(causes(&spring, &LOOPS), ["second-relaxation"]);
    }
    let spring = Spring { gain: 1.1, slow: (0.15, 40.0), ..PAPER };
    assert_eq!(causes(&spring, &LOOPS), ["gain-error", "second-relaxation"]);
}

#[test]
fn one_level_shows_no_curve() {
    let spring = Spring { gain: 1.1, tau_s: 7.0, ..PAPER };
    for levels in [&[0.0, 300.0, 300.0, 300.0, 300.0][..], &[0.0, 300.0, 300.0, 300.0, 0.0, 0.0, 0.0]] {
        assert_eq!(causes(&spring, levels), ["gain-error", "time-constant"]);
    }
}

/// Without the other, the delay is found too short, or the share too small.
#[test]
fn a_delay_and_a_share_are_found_together() {
    let spring = Spring { share: 0.3, late: 17, ..PAPER };
    assert_eq!(causes(&spring, &LOOPS), ["delay", "instantaneous-share"]);
}

/// What is cut off shifts all readings, which would take another cause if they were taken as rounded.
#[test]
fn readings_that_are_cut_off_leave_a_gain_a_gain() {
    const LEVELS: [f64; 32] = [
        106.0, 266.0, 126.0, 227.0, 44.0, 109.0, 500.0, 343.0, 53.0, 165.0, 159.0, 0.0, 211.0, 269.0, 419.0, 14.0,
        201.0, 253.0, 46.0, 467.0, 213.0, 367.0, 199.0, 452.0, 1.0, 263.0, 470.0, 336.0, 127.0, 403.0, 13.0, 140.0,
    ];
    let spring = Spring { gain: 0.92, tau_s: 6.8, cut_v: 7.9, held: 40, ..PAPER };
    assert_eq!(causes(&spring, &LEVELS), ["gain-error", "quantisation", "time-constant"]);
    let spring = Spring { gain: 0.82, tau_s: 3.1, quicker: 2.3, cut_v: 9.0, held: 40, ..PAPER };
    assert_eq!(causes(&spring, &LEVELS), ["gain-error", "quantisation", "voltage-dependent-time-constant"]);
}

/// Voltages of at least `rows` rows: ramps between random levels in up to `ramp` rows, most of them followed by a rest of up to `rest`.
fn ramps(rows: usize, [ramp, rest]: [f64; 2], numbers: &mut Lcg32) -> Vec<f64> {
    let mut volts = vec![0.0; 20];
    while volts.len() < rows + 20 {
        let (from, to) = (volts[volts.len() - 1], (500.0 * numbers.uniform()).round());
        let rows = 4.0 + ((ramp - 4.0) * numbers.uniform() * numbers.uniform()).round();
        volts.extend((1..=rows as usize).map(|row| from + (to - from) * row as f64 / rows));
        if numbers.uniform() < 0.6 {
            volts.extend(vec![to; (6.0 + (rest - 6.0) * numbers.uniform()) as usize]);
        }
    }
    volts
}

/// The report on readings under a voltage that is linear between rows of `row_s`; those of a row have its number.
fn report_of_ramps(volts: &[f64], row_s: f64, readings: impl Iterator<Item = f64>) -> Report {
    let row = |(row, reading): (usize, f64)| Row {
        line: row + 2,
        time_s: row_s * row as f64,
        voltage_v: volts[row],
        measured: Some(reading),
    };
    let record = Record { name: String::new(), rows: readings.enumerate().map(row).collect() };
    diagnose(&record, &Options { input: Input::Linear, ..Options::default() }).unwrap()
}

/// A share that is negative for a short time makes a response that is late and reverses first, which ramps hardly distinguish from one that
/// is late and lags.
#[test]
fn a_delay_and_a_lag_in_series_are_no_share_that_reverses() {
    const ROW_S: f64 = 0.275;
    const STEPS: usize = 50;
    let late = (0.95 / ROW_S * STEPS as f64).round() as usize;
    for seed in 1..=3 {
        let mut numbers = Lcg32::new(seed);
        let volts = ramps(900, [100.0, 80.0], &mut numbers);
        let volts_at = |step: usize| {
            let (row, part) = (step / STEPS, (step % STEPS) as f64 / STEPS as f64);
            volts[row] + part * (volts[row + 1] - volts[row])
        };
        let (mut lag, mut series) = (0.0, 0.0);
        let readings = (0..900).map(|row| {
            let reading = series + 2.0 * (numbers.uniform() + numbers.uniform() + numbers.uniform() - 1.5);
            for step in row * STEPS..(row + 1) * STEPS {
                let across_v = volts_at(step.saturating_sub(late));
                lag += (across_v - lag) * ROW_S / STEPS as f64 / PAPER.tau_s;
                series += (PAPER.share * across_v + (1.0 - PAPER.share) * lag - series) * ROW_S / STEPS as f64 / 0.54;
            }
            reading
        });
        let report = report_of_ramps(&volts, ROW_S, readings);
        let causes: Vec<_> = report.findings.iter().map(|finding| finding.cause).collect();
        assert_eq!(causes, ["delay", "series-lag"], "{seed}: {:?}, {:?}", report.verdict, report.findings);
    }
}

/// The report on a gain of 1.125 with a time constant that changes along the record, of which `tau_s` gives that at a part of it, and a bound
/// of the sensor.
fn with_gain_and_bound(seed: u32, tau_s: impl Fn(f64) -> f64) -> Report {
    const ROW_S: f64 = 0.2;
    const STEPS: usize = 20;
    const ROWS: usize = 2400;
    let mut numbers = Lcg32::new(seed);
    let volts = ramps(ROWS, [130.0, 100.0], &mut numbers);
    let mut lag = 0.0;
    let readings = (0..ROWS).map(|row| {
        let noise = 2.0 * (numbers.uniform() + numbers.uniform() + numbers.uniform() - 1.5);
        let reading = 1.125 * (PAPER.share * volts[row] + (1.0 - PAPER.share) * lag) + noise;
        for step in 0..STEPS {
            let part = (step as f64 + 0.5) / STEPS as f64;
            let tau_s = tau_s((row as f64 + part) / ROWS as f64);
            lag +=
                (volts[row] + part * (volts[row + 1] - volts[row]) - lag) * -f64::exp_m1(-ROW_S / STEPS as f64 / tau_s);
        }
        reading.min(472.5)
    });
    report_of_ramps(&volts, ROW_S, readings)
}

/// Rayleigh's law has a slope of its own, which is all that is left of it without a loop.
#[test]
fn a_gain_is_no_hysteresis_without_a_loop() {
    let report = with_gain_and_bound(7, |part| 5.5 + 4.0 * part);
    let causes: Vec<_> = report.findings.iter().map(|finding| finding.cause).collect();
    assert_eq!(causes, ["gain-error", "time-constant", "sensor-saturation"], "{:?}", report.findings);
}

/// The work of this search ends with a curve beside the gain, each of which does what the other may.
#[test]
fn a_gain_is_named_where_a_curve_could_replace_it() {
    let report = with_gain_and_bound(2, |part| 5.5 * (9.5f64 / 5.5).powf(part));
    let causes: Vec<_> = report.findings.iter().map(|finding| finding.cause).collect();
    assert_eq!(causes, ["gain-error", "time-constant", "sensor-saturation"], "{:?}", report.findings);
}
