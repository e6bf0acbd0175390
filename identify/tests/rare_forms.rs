//! Records of a spring whose cause has a form that is seldom needed are explained by that cause alone.

use std::f64::consts::TAU;

use identify::answer::Parameter;
use identify::{Options, Report, Verdict, examine};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

const ROWS: usize = 2000;
const SAMPLE_S: f64 = 0.1;
/// The nominal time constant, in s.
const TAU_S: f64 = 5.5;
/// Integration steps from row to row.
const STEPS: usize = 100;
/// Height of the first step, the largest.
const FULL_SCALE_V: f64 = 500.0;
const FREQ_HZ: f64 = 0.73;

/// Diagnoses the paper's spring under steps of 6 s between 0 and 500 V, with noise of 1 V; the arguments are those of
/// [`diagnosed_from`].
fn diagnosed(
    amplified_v: impl Fn(f64, f64) -> f64,
    tau_s: impl Fn(usize) -> f64,
    read: impl FnMut(usize, f64, f64) -> f64,
) -> Report {
    diagnosed_from(0.0, amplified_v, tau_s, read)
}

/// Diagnoses the paper's spring under steps of 6 s between `lowest_v` and 500 V, with noise of 1 V. `amplified_v` returns the voltage
/// across it from the commanded one and the one 1 ms ago, `tau_s` the time constant in a row, in s, and `read` the reading in a row from
/// response and noise; all others in V.
fn diagnosed_from(
    lowest_v: f64,
    amplified_v: impl Fn(f64, f64) -> f64,
    tau_s: impl Fn(usize) -> f64,
    mut read: impl FnMut(usize, f64, f64) -> f64,
) -> Report {
    let mut random = Lcg32::new(11);
    // Proportional gain 0.1, integral gain 0.2 per s.
    let share = 0.1 / 1.1;
    let (mut voltage_v, mut across_v, mut lag) = (0.0, 0.0, 0.0);
    let row = |row: usize| {
        if row % 60 == 20 {
            let part = if row == 20 { 1.0 } else { random.uniform() };
            voltage_v = (lowest_v + (FULL_SCALE_V - lowest_v) * part).round();
        }
        // The first reading after a step has its feedthrough.
        let response = share * amplified_v(voltage_v, across_v) + (1.0 - share) * lag;
        for _ in 0..STEPS {
            across_v = amplified_v(voltage_v, across_v);
            lag += (across_v - lag) * SAMPLE_S / STEPS as f64 / tau_s(row);
        }
        let noise = random.normal();
        let measured = Some(read(row, response, noise));
        Row { line: row + 2, time_s: SAMPLE_S * row as f64, voltage_v, measured }
    };
    let record = Record { name: "steps".into(), rows: (0..ROWS).map(row).collect() };
    examine(&record, &Options::default(), |_| ()).unwrap().report
}

fn ideal(voltage_v: f64, _: f64) -> f64 {
    voltage_v
}

/// Diagnoses an ideal amplifier's spring with an error that is added to the readings.
fn with_added(added_v: impl Fn(usize, f64) -> f64) -> Report {
    diagnosed(ideal, |_| TAU_S, |row, response, noise| response + added_v(row, response) + noise)
}

fn plain(_: usize, response: f64, noise: f64) -> f64 {
    response + noise
}

/// Diagnoses an ideal amplifier's spring with a sine of an amplitude that depends on row and response.
fn with_hum(amplitude_v: impl Fn(usize, f64) -> f64) -> Report {
    let sine = |row: usize| (TAU * FREQ_HZ * SAMPLE_S * row as f64).sin();
    with_added(|row, response| amplitude_v(row, response) * sine(row))
}

/// Checks that a cause is all that is found, and that what is left is the noise. Returns one of its parameters.
fn of_only_finding<'r>(report: &'r Report, cause: &str, name: &str) -> &'r Parameter {
    assert_eq!((report.verdict, report.findings.len()), (Verdict::Explained, 1), "{report:#?}");
    let finding = &report.findings[0];
    assert_eq!(finding.cause, cause);
    assert!(report.extended.quality.rmse < 1.1, "{:?}", report.extended.quality);
    finding.parameters.iter().find(|(of, _)| of == name).map(|(_, parameter)| parameter).unwrap()
}

/// Checks that the hum is all that is found, and returns its amplitude, in V.
fn amplitude_v(report: &Report) -> f64 {
    let freq = of_only_finding(report, "hum", "freq_hz");
    assert!(freq.low < FREQ_HZ && FREQ_HZ < freq.high && freq.high - freq.low < 0.0051, "{freq:?}");
    let amplitude = of_only_finding(report, "hum", "amplitude");
    assert!(amplitude.high - amplitude.low < 0.1 * amplitude.value, "{amplitude:?}");
    amplitude.value
}

#[test]
fn a_hum_that_is_switched_on_and_off_has_a_beginning_and_an_end() {
    let report = with_hum(|row, _| if (520..1310).contains(&row) { 6.0 } else { 0.0 });
    let amplitude = amplitude_v(&report);
    assert!((amplitude - 6.0).abs() < 0.2, "{amplitude} V");
    for (name, row) in [("from_s", 520.0), ("to_s", 1309.0)] {
        let parameter = of_only_finding(&report, "hum", name);
        let at_s = SAMPLE_S * row;
        assert!(parameter.low <= at_s && at_s <= parameter.high, "{name}: {parameter:?}");
        assert!(parameter.high - parameter.low < 2.0, "{name}: {parameter:?}");
    }
}

#[test]
fn a_hum_whose_amplitude_changes_slowly_has_its_mean_amplitude() {
    let amplitude_of = |row: usize| 6.0 - 4.0 * (TAU * row as f64 / ROWS as f64).cos();
    let amplitude = amplitude_v(&with_hum(|row, _| amplitude_of(row)));
    // Mean square: 6^2 + 4^2 / 2.
    assert!((amplitude - 44f64.sqrt()).abs() < 0.2, "{amplitude} V");
}

/// Largest halfway to full scale, as the ripple of a converter with pulses.
#[test]
fn a_hum_whose_amplitude_is_a_parabola_of_the_response_is_found() {
    let of_response = |response: f64| 32.0 * (response / 500.0) * (1.0 - response / 500.0);
    let amplitude = amplitude_v(&with_hum(|_, response| of_response(response)));
    assert!((3.0..8.0).contains(&amplitude), "{amplitude} V");
}

/// The charger takes 2 s from 0 V to full scale.
#[test]
fn an_amplifier_of_constant_power_has_a_bounded_rate() {
    const POWER_V2_PER_S: f64 = FULL_SCALE_V * FULL_SCALE_V / 2.0;
    let charged = |voltage_v: f64, before_v: f64| {
        let most = POWER_V2_PER_S * SAMPLE_S / STEPS as f64;
        let square = before_v * before_v;
        (square + (voltage_v * voltage_v - square).clamp(-most, most)).sqrt()
    };
    let report = diagnosed(charged, |_| TAU_S, plain);
    let slew = of_only_finding(&report, "amplifier-slew", "slew_v_per_s");
    let exact = POWER_V2_PER_S / (2.0 * FULL_SCALE_V);
    assert!(slew.low < exact && exact < slew.high && slew.high - slew.low < 0.05 * exact, "{exact}: {slew:?}");
}

fn holds(report: &Report, name: &str, exact: f64) {
    let parameter = of_only_finding(report, "time-constant", name);
    assert!(parameter.low < exact && exact < parameter.high, "{name}: {exact}, {parameter:?}");
    assert!(parameter.high - parameter.low < 0.15 * exact, "{name}: {parameter:?}");
}

#[test]
fn a_time_constant_that_steps_has_two_values_and_a_time() {
    let report = diagnosed(ideal, |row| if row < 1117 { TAU_S } else { 9.0 }, plain);
    holds(&report, "tau_first_s", TAU_S);
    holds(&report, "tau_last_s", 9.0);
    holds(&report, "at_s", 111.7);
}

#[test]
fn a_time_constant_that_drifts_has_a_first_and_a_last_value() {
    let report = diagnosed(ideal, |row| TAU_S * (4.0f64 / TAU_S).powf(row as f64 / ROWS as f64), plain);
    holds(&report, "tau_first_s", TAU_S);
    holds(&report, "tau_last_s", 4.0);
}

fn contains(report: &Report, cause: &str, name: &str, exact: f64, widest: f64) {
    let parameter = of_only_finding(report, cause, name);
    assert!(parameter.low <= exact && exact <= parameter.high, "{name}: {exact}, {parameter:?}");
    assert!(parameter.high - parameter.low < widest, "{name}: {parameter:?}");
}

#[test]
fn a_shift_that_decays_has_a_beginning_and_a_time() {
    let report = with_added(|row, _| if row < 713 { 0.0 } else { 18.0 * (-((row - 713) as f64) / 150.0).exp() });
    contains(&report, "reading-offset", "offset", 18.0, 2.0);
    contains(&report, "reading-offset", "decay_s", 15.0, 2.0);
    contains(&report, "reading-offset", "from_s", 71.3, 1.0);
}

/// With ramps of 8 and 12 s at its ends.
#[test]
fn a_shift_that_comes_and_goes_by_ramps_has_its_level_between_them() {
    let rises = |row: usize| (row as f64 - 700.0) / 80.0;
    let falls = |row: usize| (1130.0 - row as f64) / 120.0;
    let report = with_added(|row, _| -14.0 * rises(row).min(falls(row)).clamp(0.0, 1.0));
    let value = |name| of_only_finding(&report, "reading-offset", name).value;
    assert!((value("offset") + 14.0).abs() < 0.5, "{report:#?}");
    assert!((value("rise_s") - 8.0).abs() < 2.0 && (value("fall_s") - 12.0).abs() < 2.0, "{report:#?}");
    assert!((value("from_s") - 70.0).abs() < 3.0 && (value("to_s") - 113.0).abs() < 3.0, "{report:#?}");
}

/// A bound of a value that is approached as a power of 12.
fn soft(value: f64, limit: f64) -> f64 {
    value / (1.0 + (value.abs() / limit).powi(12)).powf(1.0 / 12.0)
}

#[test]
fn a_bound_of_the_sensor_that_is_approached_gradually_has_a_knee() {
    let report = diagnosed(ideal, |_| TAU_S, |_, response, noise| soft(response, 230.0) + noise);
    let found = &report.findings[0];
    let value = |name| found.parameters.iter().find(|(of, _)| of == name).map(|(_, parameter)| parameter.value);
    assert!(found.cause == "sensor-saturation" && found.probability > 0.5, "{report:#?}");
    assert!((value("limit").unwrap() - 230.0).abs() < 5.0, "{report:#?}");
    assert!((8.0..30.0).contains(&value("knee").unwrap()), "{report:#?}");
}

#[test]
fn a_limit_of_the_amplifier_that_is_approached_gradually_has_a_knee() {
    let report = diagnosed(|voltage_v, _| soft(voltage_v, 330.0), |_| TAU_S, plain);
    let value = |name| of_only_finding(&report, "amplifier-limit", name).value;
    assert!((value("limit_v") - 330.0).abs() < 5.0 && (10.0..40.0).contains(&value("knee_v")), "{report:#?}");
}

#[test]
fn a_limit_of_the_amplifier_for_one_sign_is_found() {
    let found_v = |amplified_v: fn(f64, f64) -> f64, name: &str| {
        let report = diagnosed_from(-FULL_SCALE_V, amplified_v, |_| TAU_S, plain);
        of_only_finding(&report, "amplifier-limit", name).value
    };
    assert!((found_v(|volts, _| volts.min(330.0), "limit_v") - 330.0).abs() < 2.0);
    assert!((found_v(|volts, _| volts.max(-270.0), "lower_limit_v") + 270.0).abs() < 2.0);
}

/// The link after a sensor that stops at 230 V spoils single readings.
#[test]
fn a_bound_of_the_sensor_below_outliers_is_no_stuck_sensor() {
    let read = |row: usize, response: f64, noise: f64| {
        let reading = f64::min(response + noise, 230.0);
        if row % 67 == 33 { reading + 60.0 + row as f64 / 100.0 } else { reading }
    };
    let report = diagnosed(ideal, |_| TAU_S, read);
    let mut causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    assert_eq!(causes, ["outliers", "sensor-saturation"], "{report:#?}");
    let bound = report.findings.iter().find(|finding| finding.cause == "sensor-saturation").unwrap();
    assert!(bound.proved && bound.evidence.contains("the highest of all but for single ones"), "{}", bound.evidence);
}

/// A sensor whose reading saturates gradually on both sides, and one that becomes more sensitive.
#[test]
fn a_curve_behind_the_relaxation_that_bends_evenly_is_found() {
    let laws: [fn(f64) -> f64; 2] =
        [|part| (3.0 * part).tanh() / 3f64.tanh(), |part| (2.5 * part).sinh() / 2.5f64.sinh()];
    for law in laws {
        let report = with_added(|_, response| FULL_SCALE_V * law(response / FULL_SCALE_V) - response);
        of_only_finding(&report, "static-nonlinearity", "at_100_v");
    }
}

/// Checks that the converter is all that is wrong, and returns its step.
fn step_of_converter(report: &Report) -> f64 {
    let causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    assert_eq!((report.verdict, causes), (Verdict::Explained, vec!["quantisation"]), "{report:#?}");
    report.findings[0].parameters.iter().find(|(name, _)| name == "step").unwrap().1.value
}

#[test]
fn missing_codes_of_a_converter_are_no_law_of_the_spring() {
    const STEP_V: f64 = 9.0;
    for (every, read_as) in [(4, -1), (5, 1)] {
        let report = diagnosed(
            ideal,
            |_| TAU_S,
            |_, response, noise| {
                let code = ((response + noise) / STEP_V).round() as i64;
                STEP_V * (if code.rem_euclid(every) == 2 { code + read_as } else { code }) as f64
            },
        );
        assert!((step_of_converter(&report) - STEP_V).abs() < 1e-3);
    }
}

#[test]
fn a_sensor_that_reports_changes_is_no_delay_and_no_law_of_the_spring() {
    for least_v in [12.0, 25.0, 40.0] {
        let mut last = f64::INFINITY;
        let report = diagnosed(
            ideal,
            |_| TAU_S,
            |_, response, noise| {
                let new = response + noise;
                if (new - last).abs() >= least_v {
                    last = new;
                }
                last
            },
        );
        assert!((least_v..1.1 * least_v).contains(&step_of_converter(&report)), "{least_v}");
    }
}

/// The code of a failed reading is a hundred times the error that the limit removes.
#[test]
fn a_limit_of_the_amplifier_beside_the_code_of_failed_readings_is_found() {
    let read = |row: usize, response: f64, noise: f64| if row % 33 == 7 { 1e4 } else { response + noise };
    let report = diagnosed(|voltage_v, _| voltage_v.min(430.0), |_| TAU_S, read);
    let mut causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    assert_eq!((report.verdict, causes), (Verdict::Explained, vec!["amplifier-limit", "outliers"]), "{report:#?}");
    let errors = report.findings.iter().map(|finding| finding.rmse_after);
    assert!(errors.into_iter().all(|error| error < 1.1), "{:?}", report.findings);
}
