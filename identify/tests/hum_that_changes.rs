//! A periodic disturbance whose amplitude is not constant over the record is a hum, not an unexplained error.

use std::f64::consts::TAU;

use identify::{Options, Report, Verdict, examine};
use simulation::record::{Record, Row};

const ROWS: usize = 2000;
const SAMPLE_S: f64 = 0.1;
const FREQ_HZ: f64 = 0.73;

/// Diagnoses the paper's spring under steps, with noise of 1 V and a sine of an amplitude that depends on row and response, both in V.
fn diagnosed(amplitude_v: impl Fn(usize, f64) -> f64) -> Report {
    let mut seed = 11u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1 << 24)
    };
    // Proportional gain 0.1, integral gain 0.2 per s.
    let (share, tau_s) = (0.1 / 1.1, 5.5);
    let remains = f64::exp(-SAMPLE_S / tau_s);
    let (mut voltage_v, mut lag) = (0.0, 0.0);
    let row = |row: usize| {
        if row % 60 == 20 {
            voltage_v = (500.0 * random()).round();
        }
        let response = share * voltage_v + (1.0 - share) * lag;
        lag = voltage_v + (lag - voltage_v) * remains;
        let time_s = SAMPLE_S * row as f64;
        let noise = (0..12).map(|_| random() - 0.5).sum::<f64>();
        let sine = amplitude_v(row, response) * (TAU * FREQ_HZ * time_s).sin();
        Row { line: row + 2, time_s, voltage_v, measured: Some(response + sine + noise) }
    };
    let record = Record { name: "hum".into(), rows: (0..ROWS).map(row).collect() };
    examine(&record, &Options::default(), |_| ()).unwrap().report
}

/// Checks that the hum is all that is found, and returns its amplitude, in V.
fn amplitude_v(report: &Report) -> f64 {
    assert_eq!((report.verdict, report.findings.len()), (Verdict::Explained, 1), "{report:#?}");
    let finding = &report.findings[0];
    let of = |name| finding.parameters.iter().find(|(of, _)| of == name).map(|(_, parameter)| parameter).unwrap();
    assert_eq!(finding.cause, "hum");
    let freq = of("freq_hz");
    assert!(freq.low < FREQ_HZ && FREQ_HZ < freq.high && freq.high - freq.low < 0.0051, "{freq:?}");
    // What is left is the noise.
    assert!(report.extended.quality.rmse < 1.1, "{:?}", report.extended.quality);
    let amplitude = of("amplitude");
    assert!(amplitude.high - amplitude.low < 0.1 * amplitude.value, "{amplitude:?}");
    amplitude.value
}

#[test]
fn a_hum_that_is_switched_on_and_off_has_a_beginning_and_an_end() {
    let report = diagnosed(|row, _| if (520..1310).contains(&row) { 6.0 } else { 0.0 });
    let amplitude = amplitude_v(&report);
    assert!((amplitude - 6.0).abs() < 0.2, "{amplitude} V");
    for (name, row) in [("from_s", 520.0), ("to_s", 1309.0)] {
        let of = report.findings[0].parameters.iter().find(|(of, _)| of == name).map(|(_, parameter)| parameter);
        let parameter = of.unwrap();
        let at_s = SAMPLE_S * row;
        assert!(parameter.low <= at_s && at_s <= parameter.high, "{name}: {parameter:?}");
        assert!(parameter.high - parameter.low < 2.0, "{name}: {parameter:?}");
    }
}

#[test]
fn a_hum_whose_amplitude_changes_slowly_has_its_mean_amplitude() {
    let amplitude_of = |row: usize| 6.0 - 4.0 * (TAU * row as f64 / ROWS as f64).cos();
    let amplitude = amplitude_v(&diagnosed(|row, _| amplitude_of(row)));
    // Mean square: 6^2 + 4^2 / 2.
    assert!((amplitude - 44f64.sqrt()).abs() < 0.2, "{amplitude} V");
}

/// Largest halfway to full scale, as the ripple of a converter with pulses.
#[test]
fn a_hum_whose_amplitude_is_a_parabola_of_the_response_is_found() {
    let of_response = |response: f64| 32.0 * (response / 500.0) * (1.0 - response / 500.0);
    let amplitude = amplitude_v(&diagnosed(|_, response| of_response(response)));
    assert!((3.0..8.0).contains(&amplitude), "{amplitude} V");
}
