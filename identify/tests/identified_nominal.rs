//! Diagnoses of a spring that was identified from the same record: what a linear model lacks is named, and what it has is no cause.

use identify::{Diagnosis, Effort, Input, Options, Verdict, examine, identify};
use random_numbers::{Lcg32, Lcg64};
use simulation::record::{Record, Row};
use simulation::units::Units;

const ROWS: usize = 1200;

/// Independent, nearly normal noise of variance 1.
fn normals() -> Vec<f64> {
    let mut numbers = Lcg64::new(7);
    (0..ROWS).map(|_| numbers.normal()).collect()
}

/// Voltage in levels of 12 to 20 V, each held for 15 to 45 rows: never near 0 V.
fn levels() -> Vec<f64> {
    let mut numbers = Lcg32::new(1);
    let mut random = |of: u32| (numbers.draw() >> 8) % of;
    let mut voltage = Vec::new();
    while voltage.len() < ROWS {
        let (level, held) = (12.0 + 8.0 * f64::from(random(1000)) / 999.0, 15 + random(30) as usize);
        voltage.extend(std::iter::repeat_n(level, held));
    }
    voltage.truncate(ROWS);
    voltage
}

/// Readings of lags in series, one per second, of a function of the voltage.
fn record(curve: impl Fn(f64) -> f64, taus_s: &[f64], noise: f64) -> Record {
    let voltage = levels();
    let mut lags = vec![curve(voltage[0]); taus_s.len()];
    let errors = normals();
    let row = |row: usize| {
        let measured = Some(lags[lags.len() - 1] + noise * errors[row]);
        for _ in 0..200 {
            let mut input = curve(voltage[row]);
            for (lag, tau_s) in lags.iter_mut().zip(taus_s) {
                *lag += (input - *lag) * 0.005 / tau_s;
                input = *lag;
            }
        }
        Row { line: row + 2, time_s: row as f64, voltage_v: voltage[row], measured }
    };
    Record { name: "levels".into(), rows: (0..ROWS).map(row).collect() }
}

fn diagnosed(record: Record) -> (Diagnosis, f64) {
    diagnosed_with(Effort::Normal, record)
}

fn diagnosed_with(effort: Effort, record: Record) -> (Diagnosis, f64) {
    let records = [record];
    let found = identify(&records, Input::Hold, &Units::default()).unwrap();
    let linear = found.report.held_out_rmse;
    let options = Options { effort, ..Options::default() }.judging(found).unwrap();
    (examine(&records[0], &options, |_| ()).unwrap(), linear)
}

/// A curve as of a titration. A linear model has the slope in the middle of the range, and bends its poles to the rest; the exported
/// spring has the secant of the range and the lag of the record.
#[test]
fn curve_away_from_zero_is_named_alone() {
    let curve = |voltage: f64| 7.0 + 3.0 * ((voltage - 16.0) / 2.5).tanh();
    let (diagnosis, linear) = diagnosed(record(curve, &[6.0], 0.02));
    let report = &diagnosis.report;
    let causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    assert_eq!(causes, ["static-nonlinearity"], "{report:?}");
    assert!(report.extended.quality.held_out_rmse < 0.5 * linear, "{} {linear}", report.extended.quality.held_out_rmse);
    let (reading, tau_s) = (diagnosis.plant.reading.unwrap(), diagnosis.plant.relaxation.tau_s[0]);
    let secant = (curve(20.0) - curve(12.0)) / 8.0;
    assert!((reading.gain / secant - 1.0).abs() < 0.05, "{reading:?}, expected {secant}");
    assert!((reading.zero + 12.0 * reading.gain - curve(12.0)).abs() < 0.2, "{reading:?}");
    assert!((tau_s / 6.0 - 1.0).abs() < 0.1, "{tau_s} s");
}

/// A loop of 70.75 V before one lag of 5.5 s. A linear model imitates it by further lags, which the spring does not have once the loop
/// is known.
#[test]
fn lags_that_imitate_a_loop_are_dropped_with_it() {
    let text = include_str!("../../data/sample_hysteresis.csv");
    let record = Record::parse("sample", text, "stiffness").unwrap();
    let (diagnosis, _) = diagnosed(record);
    let report = &diagnosis.report;
    let [loop_] = report.findings.as_slice() else { panic!("{report:?}") };
    let width = &loop_.parameters[0].1;
    assert!(loop_.cause == "hysteresis" && width.low < 70.75 && 70.75 < width.high, "{loop_:?}");
    assert!(report.nominal.tau_s.len() > 1, "no lag imitates it: {:?}", report.nominal);
    let relaxation = &diagnosis.plant.relaxation;
    assert!((relaxation.share - 1.0 / 11.0).abs() < 0.001, "{relaxation:?}");
    assert!(relaxation.tau_s.len() == 1 && (relaxation.tau_s[0] - 5.5).abs() < 0.02, "{relaxation:?}");
}

/// A loop of 4 V before one lag, under a stair of 4 V that rises and falls twice. Two oscillations imitate it down to the noise; under the
/// spring of one lag, it explains the readings better.
#[test]
fn a_loop_that_oscillations_imitate_down_to_the_noise_is_named() {
    let voltage = |row: usize| 4.0 * (row / 60 % 10).min(10 - row / 60 % 10) as f64;
    let errors = normals();
    let (mut play, mut lag) = (0.0, 0.0);
    let row = |row: usize| {
        let measured = Some(lag + 0.05 * errors[row]);
        play = f64::clamp(play, voltage(row) - 2.0, voltage(row) + 2.0);
        lag += (0.5 * voltage(row) + 0.5 * play - lag) * -f64::exp_m1(-1.0 / 20.0);
        Row { line: row + 2, time_s: row as f64, voltage_v: voltage(row), measured }
    };
    let record = Record { name: "stair".into(), rows: (0..ROWS).map(row).collect() };
    let linear = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
    assert!(linear.plant.modes.len() > 1, "nothing imitates it: {:?}", linear.plant);
    // The work of a normal search may end before the residual is beyond doubt.
    let (diagnosis, _) = diagnosed_with(Effort::Thorough, record);
    let report = &diagnosis.report;
    let [loop_] = report.findings.as_slice() else { panic!("{report:?}") };
    assert_eq!((report.verdict, loop_.cause), (Verdict::Explained, "hysteresis"), "{report:?}");
    assert!(loop_.probability > 0.95 && diagnosis.plant.modes.is_empty(), "{loop_:?}");
}

/// Rows that were not diagnosed are predicted with zero, gain, curve and lag of those that were.
#[test]
fn rows_that_were_not_diagnosed_are_predicted() {
    let curve = |voltage: f64| 7.0 + 3.0 * ((voltage - 16.0) / 2.5).tanh();
    let whole = record(curve, &[6.0], 0.02);
    let rows = 800;
    let (diagnosis, linear) = diagnosed(Record { rows: whole.rows[..rows].to_vec(), ..whole.clone() });
    let errors = diagnosis.errors_on(&whole, Input::Hold);
    assert_eq!(errors.len(), ROWS);
    let rms = |errors: &[f64]| (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    let (seen, rest) = (rms(&errors[..rows]), rms(&errors[rows..]));
    let extended = diagnosis.report.extended.quality.rmse;
    assert!((seen / extended - 1.0).abs() < 0.05, "{seen} {extended}");
    assert!(rest < 1.5 * extended && rest < 0.6 * linear, "{rest} {extended} {linear}");
}

/// Nothing is left to name where a linear model describes the record, and the extended simulation is the identified one.
#[test]
fn linear_spring_is_consistent_with_what_was_identified() {
    let (diagnosis, _) = diagnosed(record(|voltage| 2.0 - 0.5 * voltage, &[9.0, 2.0], 0.02));
    let report = &diagnosis.report;
    assert_eq!((report.verdict, report.findings.len()), (Verdict::Consistent, 0), "{report:?}");
    let ratio = report.extended.quality.rmse / report.baseline.rmse;
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
}

/// The zero of the sensor steps in the middle of the record. An identified spring that followed the step would hide it.
#[test]
fn shifted_zero_is_named_alone() {
    let mut shifted = record(|voltage| 2.0 - 0.5 * voltage, &[9.0, 2.0], 0.02);
    shifted.rows[537..].iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading + 0.4));
    let (diagnosis, _) = diagnosed(shifted);
    let report = &diagnosis.report;
    let causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    assert_eq!((report.verdict, causes), (Verdict::Explained, vec!["reading-offset"]), "{report:?}");
    let offset = report.findings[0].parameters.iter().find(|(name, _)| name == "offset").unwrap().1.value;
    assert!((offset.abs() / 0.4 - 1.0).abs() < 0.1, "{offset}");
    let tau_s = diagnosis.plant.relaxation.tau_s[0];
    assert!((tau_s / 9.0 - 1.0).abs() < 0.1, "{tau_s} s");
}

/// The zero of the sensor steps 20 s before the record ends, no longer than the spring takes to settle: an error of its model would look
/// the same.
#[test]
fn shift_of_the_last_readings_is_less_likely_than_not() {
    let mut shifted = record(|voltage| 2.0 - 0.5 * voltage, &[9.0], 0.02);
    shifted.rows[ROWS - 20..].iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading + 0.4));
    let (Diagnosis { report, .. }, _) = diagnosed(shifted);
    let probabilities: Vec<(&str, bool)> =
        report.findings.iter().map(|finding| (finding.cause, finding.probability < 0.5)).collect();
    assert_eq!((report.verdict, probabilities), (Verdict::Ambiguous, vec![("reading-offset", true)]), "{report:?}");
}

/// A slow amplifier in front of a curve. The linear model that predicts best has a delay instead, which no cause can take away again.
#[test]
fn amplifier_that_a_delay_imitates_is_named_with_the_curve() {
    let curve = |voltage: f64| 7.0 + 3.0 * ((voltage - 16.0) / 2.5).tanh();
    let voltage = levels();
    let (errors, mut across_v, mut lag) = (normals(), voltage[0], curve(voltage[0]));
    let row = |row: usize| {
        let measured = Some(lag + 0.02 * errors[row]);
        for _ in 0..200 {
            across_v += (voltage[row] - across_v).clamp(-0.5 * 0.005, 0.5 * 0.005);
            lag += (curve(across_v) - lag) * 0.005 / 6.0;
        }
        Row { line: row + 2, time_s: row as f64, voltage_v: voltage[row], measured }
    };
    let record = Record { name: "levels".into(), rows: (0..ROWS).map(row).collect() };
    let found = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
    assert!(found.report.nominal.delay_s.value > 0.0, "{:?}", found.report.nominal);
    assert!(found.simpler.unwrap().amplifier.is_none(), "a spring without a delay");
    let (Diagnosis { report, .. }, _) = diagnosed(record);
    let mut causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    assert_eq!(
        (report.verdict, causes),
        (Verdict::Explained, vec!["amplifier-slew", "static-nonlinearity"]),
        "{report:?}"
    );
}
