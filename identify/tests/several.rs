//! Several records of one spring are diagnosed together.

use identify::{Diagnosis, Options, Verdict, diagnose, examine_several};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

/// Time between rows, in s.
const SAMPLE_S: f64 = 0.2;

/// What differs between the records of one spring.
struct Test {
    /// Voltages, each held for 20 s.
    volts: [f64; 5],
    /// Offset of the sensor, in V.
    zero_v: f64,
    /// RMS of the noise, in V.
    noise_v: f64,
    /// Output of the lag at the first row, in V.
    start_v: f64,
    /// Largest reading of the sensor, in V.
    largest_v: f64,
}

const PLAIN: Test =
    Test { volts: [0.0, 200.0, 400.0, 100.0, 300.0], zero_v: 0.0, noise_v: 0.5, start_v: 0.0, largest_v: f64::MAX };

/// A record of a spring with a static gain and a time constant, in s.
fn record(name: &str, gain: f64, tau_s: f64, test: &Test) -> Record {
    let share = 1.0 / 11.0;
    let (mut lag_v, mut numbers) = (test.start_v, Lcg32::new(name.len() as u32));
    let mut row = |index: usize| {
        let voltage_v = test.volts[index / 100];
        let mut uniform = || numbers.uniform() - 0.5;
        let noise_v = test.noise_v * (uniform() + uniform() + uniform());
        let stiffness_v = gain * (share * voltage_v + (1.0 - share) * lag_v) + test.zero_v + 2.0 * noise_v;
        lag_v = voltage_v + (lag_v - voltage_v) * f64::exp(-SAMPLE_S / tau_s);
        let measured = Some(stiffness_v.min(test.largest_v));
        Row { line: index + 2, time_s: SAMPLE_S * index as f64, voltage_v, measured }
    };
    Record { name: name.into(), rows: (0..500).map(&mut row).collect() }
}

fn causes(several: &Diagnosis) -> Vec<&'static str> {
    let mut causes: Vec<_> = several.report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    causes
}

#[test]
fn shared_causes_are_found_under_different_offsets_starts_and_noise() {
    let volts = [300.0, 0.0, 500.0, 250.0, 100.0];
    let records = [
        record("first", 1.1, 7.0, &Test { zero_v: 3.0, ..PLAIN }),
        record("second", 1.1, 7.0, &Test { volts, zero_v: -8.0, noise_v: 2.0, start_v: 150.0, ..PLAIN }),
        record("third one", 1.1, 7.0, &Test { volts, ..PLAIN }),
    ];
    let several = examine_several(&records, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert_eq!(causes(&several), ["gain-error", "time-constant"], "{report:#?}");
    assert_eq!((report.verdict, report.rows), (Verdict::Explained, 1500));
    for (cause, truth) in [("gain-error", 1.1), ("time-constant", 7.0)] {
        let finding = report.findings.iter().find(|finding| finding.cause == cause).unwrap();
        let found = &finding.parameters[0].1;
        assert!((found.value - truth).abs() < 0.01 * truth && found.low < truth && truth < found.high, "{found:?}");
    }
    for (of, zero_v) in report.records.iter().zip([3.0, -8.0, 0.0]) {
        assert!((of.offset - zero_v).abs() < 1.0, "{of:?}");
        assert!(of.findings.is_empty() && of.verdict == Verdict::Consistent, "{of:?}");
    }
    assert!(report.records[1].sigma > 3.0 * report.records[0].sigma, "{:?}", report.records);
}

#[test]
fn a_cause_in_one_record_only_is_a_fault_of_that_record() {
    let records = [
        record("first", 1.1, 5.5, &PLAIN),
        record("second", 1.1, 5.5, &Test { largest_v: 380.0, ..PLAIN }),
        record("third one", 1.1, 5.5, &Test { volts: [0.0, 500.0, 300.0, 100.0, 400.0], ..PLAIN }),
    ];
    let several = examine_several(&records, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert_eq!(causes(&several), ["gain-error"], "{report:#?}");
    let faults: Vec<(&str, &str)> = report
        .records
        .iter()
        .flat_map(|of| of.findings.iter().map(|finding| (of.name.as_str(), finding.cause)))
        .collect();
    assert_eq!(faults, [("second", "sensor-saturation")], "{report:#?}");
    assert_eq!((report.verdict, &report.next_experiment), (Verdict::Explained, &None));
}

/// A shift of the readings from the middle of one record on, in V, has a part in its zero, and biases what all records share.
#[test]
fn a_shift_in_one_record_is_found_beside_a_shared_cause_and_nothing_else() {
    const SHIFT_V: f64 = 12.0;
    let volts = [300.0, 0.0, 500.0, 250.0, 100.0];
    let mut records = ["first", "second", "third one"].map(|name| record(name, 1.0, 6.0, &Test { volts, ..PLAIN }));
    records[1].rows[270..].iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading + SHIFT_V));
    let several = examine_several(&records, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert_eq!((report.verdict, causes(&several)), (Verdict::Explained, vec!["time-constant"]), "{report:#?}");
    let tau = &report.findings[0].parameters[0].1;
    assert!(report.findings[0].probability > 0.95 && tau.low < 6.0 && 6.0 < tau.high, "{:?}", report.findings);
    let faults = report.records.iter().map(|of| of.findings.iter().map(|finding| finding.cause).collect());
    assert_eq!(faults.collect::<Vec<Vec<&str>>>(), [vec![], vec!["reading-offset"], vec![]], "{:#?}", report.records);
    assert!(report.records[1].findings[0].probability > 0.95, "{:#?}", report.records);
}

/// The gain of one record hides what all of them share, which is not to be taken out of them with it. The errors of the simulation are those
/// of the readings as they are.
#[test]
fn a_gain_of_one_record_does_not_hide_shared_causes() {
    let volts = [300.0, 0.0, 500.0, 250.0, 100.0];
    let of = |name: &str, gain: f64| record(name, gain, 7.0, &Test { volts, ..PLAIN });
    let records = [of("first", 1.0), of("second", 1.1), of("third one", 1.0)];
    let several = examine_several(&records, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert!(causes(&several).contains(&"time-constant"), "{report:#?}");
    let has_gain = |name: &str| {
        let of = report.records.iter().find(|of| of.name == name).unwrap();
        of.findings.iter().any(|finding| finding.cause == "gain-error")
    };
    assert!(has_gain("second"), "{report:#?}");
    let simulated: Vec<f64> =
        several.data.reading.iter().zip(&several.baseline.residual).map(|(reading, left)| reading - left).collect();
    // Less the zero of each record, at most 500 V; with the fault 550 V.
    assert!(simulated.iter().all(|volts| (-20.0..520.0).contains(volts)), "{simulated:?}");
    let rmse = (several.baseline.residual.iter().map(|left| left * left).sum::<f64>() / 1500.0).sqrt();
    assert!((report.baseline.rmse - rmse).abs() < 1e-9, "{} {rmse}", report.baseline.rmse);
}

/// Readings on a coarse grid repeat, and would look free of noise.
#[test]
fn one_coarse_record_does_not_outweigh_the_others() {
    let volts = [300.0, 0.0, 500.0, 250.0, 100.0];
    let mut records = ["first", "second", "third one"].map(|name| record(name, 1.0, 6.0, &Test { volts, ..PLAIN }));
    records[2]
        .rows
        .iter_mut()
        .for_each(|row| row.measured = row.measured.map(|reading| (reading / 20.0).round() * 20.0));
    let several = examine_several(&records, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert_eq!(causes(&several), ["time-constant"], "{report:#?}");
    let faults = report.records.iter().map(|of| of.findings.iter().map(|finding| finding.cause).collect());
    assert_eq!(faults.collect::<Vec<Vec<&str>>>(), [vec![], vec![], vec!["quantisation"]], "{:#?}", report.records);
}

/// A gain that is off by 0.12 %, with a noise of 2 V: most records do not show it alone.
#[test]
fn a_cause_that_most_records_do_not_show_alone_is_found_in_all_of_them() {
    let gain = 1.0012;
    let names = ["a", "of two", "of three", "number four", "the fifth one", "and the sixth"];
    let levels = [0.0, 200.0, 400.0, 100.0, 300.0];
    let volts = |first: usize| [0, 1, 2, 3, 4].map(|level| levels[(first + level) % levels.len()]);
    let test = |first: usize| Test { volts: volts(first), noise_v: 2.0, ..PLAIN };
    let records: Vec<Record> =
        names.iter().enumerate().map(|(first, name)| record(name, gain, 5.5, &test(first))).collect();
    let shows = |record: &&Record| {
        let alone = diagnose(record, &Options::default()).unwrap();
        alone.findings.iter().any(|finding| finding.cause == "gain-error")
    };
    let shown = records.iter().filter(shows).count();
    assert!(shown < records.len() / 2, "{shown} records");
    let several = examine_several(&records, &Options::default(), |_| ()).unwrap();
    assert_eq!(causes(&several), ["gain-error"]);
    let found = &several.report.findings[0].parameters[0].1;
    assert!(1.0 < found.low && found.low < gain && gain < found.high, "{found:?}");
}

/// The record of a sensor that reports a reading only if it differs from the last one by at least `least_v`.
fn reported(mut record: Record, least_v: f64) -> Record {
    let mut last = f64::INFINITY;
    for row in &mut record.rows {
        let new = row.measured.expect("a reading in each row");
        if (new - last).abs() >= least_v {
            last = new;
        }
        row.measured = Some(last);
    }
    record
}

#[test]
fn a_sensor_that_reports_changes_is_found_in_its_record_or_in_all() {
    const LEAST_V: f64 = 6.0;
    let test = Test { noise_v: 1.0, volts: [300.0, 0.0, 500.0, 250.0, 100.0], ..PLAIN };
    let other = Test { volts: [200.0, 500.0, 300.0, 0.0, 400.0], ..test };
    let all =
        [("first", &test), ("second", &other)].map(|(name, test)| reported(record(name, 1.1, 5.5, test), LEAST_V));
    let [first, second] = all.clone();
    let mixed = [first, record("second", 1.1, 5.5, &other), second];
    let several = examine_several(&mixed, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert_eq!((causes(&several), report.rows), (vec!["gain-error"], 1500), "{report:#?}");
    let of_records = report.records.iter().map(|of| of.findings.iter().map(|finding| finding.cause).collect());
    let of_records: Vec<Vec<&str>> = of_records.collect();
    assert_eq!(of_records, [vec!["quantisation"], vec![], vec!["quantisation"]], "{report:#?}");

    let several = examine_several(&all, &Options::default(), |_| ()).unwrap();
    let report = &several.report;
    assert_eq!((causes(&several), report.rows), (vec!["gain-error", "quantisation"], 1000), "{report:#?}");
    assert!(report.records.iter().all(|of| of.findings.is_empty()), "{report:#?}");
    let step = report.findings.iter().find(|finding| finding.cause == "quantisation").unwrap().parameters[0].1.value;
    assert!((LEAST_V..1.2 * LEAST_V).contains(&step), "{step}");
}
