//! The plant file of an identified spring is the spring that was identified: a diagnosis against it starts from the same error.

use identify::nominal::report::InputLaw;
use identify::{Input, Options, Verdict, examine, examine_several, identify};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};
use simulation::units::Units;

/// Rates of change of a state under a voltage.
type Rates = fn(f64, [f64; 2]) -> [f64; 2];

/// A record of random steps, integrated in small Euler steps; `reading` of voltage and state, with uniform noise of +-0.005.
fn record(rates: Rates, reading: fn(f64, [f64; 2]) -> f64, heights: [f64; 2]) -> Record {
    record_from([0.0; 2], 5, rates, reading, heights)
}

/// A record of random steps as [`record`] makes, from a state at the first row; the first step follows after `first_step` rows.
fn record_from(
    start: [f64; 2],
    first_step: usize,
    rates: Rates,
    reading: fn(f64, [f64; 2]) -> f64,
    heights: [f64; 2],
) -> Record {
    let (sample_s, steps) = (0.05, 400);
    let mut random = Lcg32::new(7);
    let (mut state, mut voltage_v) = (start, 0.0);
    let mut row = |index: usize| {
        if index % 23 == first_step {
            voltage_v = heights[0] + (heights[1] - heights[0]) * random.uniform();
        }
        let measured = Some(reading(voltage_v, state) + 0.01 * (random.uniform() - 0.5));
        for _ in 0..steps {
            let rate = rates(voltage_v, state);
            state = [0, 1].map(|of| state[of] + rate[of] * sample_s / f64::from(steps));
        }
        Row { line: index + 2, time_s: sample_s * index as f64, voltage_v, measured }
    };
    Record { name: "steps".into(), rows: (0..600).map(&mut row).collect() }
}

#[test]
fn a_diagnosis_starts_from_the_error_of_the_identified_spring() {
    let lags: Rates = |u, [x, y]| [(u - x) / 0.8, (x - y) / 0.2];
    let resonator: Rates = |u, [x, v]| [v, 36.0 * (u - x) - 0.2 * 6.0 * v];
    let even: Rates = |u, [x, _]| [(u.abs() - x) / 0.4, 0.0];
    for (name, record, order) in [
        ("two lags", record(lags, |_, [_, y]| 20.0 - 0.5 * y, [-3.0, 5.0]), 2),
        ("resonator", record(resonator, |_, [x, _]| 1.0 + 2.0 * x, [-1.0, 1.0]), 2),
        ("even", record(even, |u, [x, _]| 0.3 * u.abs() + 0.7 * x, [-4.0, 4.0]), 1),
    ] {
        let identified = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
        let report = &identified.report;
        assert_eq!(report.order, order, "{name}: {report:#?}");
        let rmse = report.rmse;
        assert!(rmse < 0.0035, "{name}: {rmse}");
        assert_eq!(identified.plant.even, name == "even");
        let options = Options::default().judging(identified).unwrap();
        let baseline = examine(&record, &options, |_| ()).unwrap().report.baseline;
        assert!(baseline.rmse < 1.1 * rmse, "{name}: {} instead of {rmse}", baseline.rmse);
    }
}

/// At the first row, the only one before the first step, the resonator passes its zero.
#[test]
fn a_spring_that_moves_when_the_record_begins_is_judged_from_its_motion() {
    let resonator: Rates = |u, [x, v]| [v, 36.0 * (u - x) - 0.05 * 6.0 * v];
    let record = record_from([0.0, 12.0], 1, resonator, |_, [x, _]| 1.0 + 2.0 * x, [-1.0, 1.0]);
    let identified = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
    let rmse = identified.report.rmse;
    assert!(!identified.settled && rmse < 0.0035, "{rmse}");
    let options = Options::default().judging(identified).unwrap();
    let report = examine(&record, &options, |_| ()).unwrap().report;
    assert!(report.baseline.rmse < 1.1 * rmse, "{} instead of {rmse}", report.baseline.rmse);
    assert_eq!(report.findings.len(), 0, "{:?}", report.findings);
}

/// The square law in the plant file is the spring's, so that nothing is found beyond it.
#[test]
fn a_diagnosis_of_an_identified_square_law_is_consistent() {
    let square: Rates = |u, [x, _]| [(u * u - x) / 0.4, 0.0];
    for (reading, share) in [
        ((|u, [x, _]| 5.0 + 0.06 * u * u + 0.14 * x) as fn(f64, [f64; 2]) -> f64, 0.3),
        (|u, _| 5.0 + 0.2 * u * u, 1.0),
    ] {
        for heights in [[-4.0, 4.0], [0.0, 4.0]] {
            let record = record(square, reading, heights);
            let identified = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
            assert_eq!((identified.report.input_law, identified.plant.even), (InputLaw::Square, heights[0] < 0.0));
            assert!((identified.report.nominal.share.value - share).abs() < 0.02, "{:?}", identified.report.nominal);
            let options = Options::default().judging(identified).unwrap();
            let report = examine(&record, &options, |_| ()).unwrap().report;
            assert_eq!((report.verdict, report.findings.len()), (Verdict::Consistent, 0), "{report:#?}");
        }
    }
}

/// The curve that is reported is the settled one, in the reading's own zero and gain: where `x + 0.4 x^3 = u`.
#[test]
fn a_hardening_spring_is_a_static_nonlinearity_with_its_settled_curve() {
    let hardening: Rates = |u, [x, v]| [v, 36.0 * (u - x - 0.4 * x.powi(3)) - 0.4 * 6.0 * v];
    let record = record(hardening, |_, [x, _]| 1.0 + 2.0 * x, [-1.0, 1.0]);
    let identified = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
    let options = Options::default().judging(identified).unwrap();
    let report = examine(&record, &options, |_| ()).unwrap().report;
    let finding = &report.findings[0];
    assert_eq!((finding.cause, report.findings.len()), ("static-nonlinearity", 1), "{report:#?}");
    // Uniform noise of +-0.005.
    assert!(report.extended.quality.held_out_rmse < 0.0035, "{report:#?}");
    assert!(finding.parameters.len() > 3, "{:?}", finding.parameters);
    for (name, parameter) in &finding.parameters {
        let voltage: f64 = name.trim_start_matches("at_").trim_end_matches("_v").parse().unwrap();
        let settled = (0..100).fold(0.0f64, |x, _| x - (x + 0.4 * x.powi(3) - voltage) / (1.0 + 1.2 * x * x));
        let reading = 1.0 + 2.0 * settled;
        assert!(parameter.low < reading && reading < parameter.high, "{name}: {reading}, {parameter:?}");
        assert!(parameter.high - parameter.low < 0.03, "{name}: {parameter:?}");
    }
}

/// Fewer readings than a model with a time constant takes: anything could stand in for the response.
#[test]
fn no_cause_is_found_in_fewer_readings_than_a_time_constant_takes() {
    let lag: Rates = |u, [x, _]| [(u - x) / 0.8, 0.0];
    for readings in [8, 10, 14] {
        let mut record = record(lag, |_, [x, _]| x, [1.0, 2.0]);
        record.rows = record.rows.split_off(23).into_iter().step_by(8).take(readings).collect();
        let identified = identify(std::slice::from_ref(&record), Input::Hold, &Units::default()).unwrap();
        let options = Options::default().judging(identified).unwrap();
        let report = examine(&record, &options, |_| ()).unwrap().report;
        assert_eq!((report.verdict, report.findings.len()), (Verdict::Insufficient, 0), "{report:#?}");
    }
}

/// Nor in two such records, in most of which causes would be found together or alone.
#[test]
fn no_cause_is_found_in_several_records_of_few_readings() {
    let lag: Rates = |u, [x, _]| [(u - x) / 0.8, 0.0];
    let whole = record(lag, |_, [x, _]| x, [1.0, 2.0]);
    for (every, first_rows) in [(2, [46, 300]), (6, [10, 400]), (8, [23, 207]), (11, [23, 207]), (11, [10, 400])] {
        let records = first_rows.map(|from: usize| {
            let rows = whole.rows[from..].iter().step_by(every).take(8).cloned().collect();
            Record { name: format!("from row {from}"), rows }
        });
        let identified = identify(&records, Input::Hold, &Units::default()).unwrap();
        let options = Options::default().judging(identified).unwrap();
        let report = examine_several(&records, &options, |_| ()).unwrap().report;
        let single = report.records.iter().map(|of| of.findings.len()).sum::<usize>();
        assert_eq!((report.verdict, report.findings.len(), single), (Verdict::Insufficient, 0, 0), "{report:#?}");
    }
}

/// A dead zone beyond which the gain is the nominal one lowers the static gain; so does creep that is far slower than the record, which
/// is not there.
#[test]
fn a_dead_zone_under_the_plant_file_of_the_same_device_is_a_gain_and_a_law() {
    let nominal: Rates = |u, [x, _]| [(u - x) / 0.4, 0.0];
    let dead: Rates = |u, [x, _]| [(u.signum() * (u.abs() - 0.5).max(0.0) - x) / 0.4, 0.0];
    let [clean, changed] = [nominal, dead].map(|rates| record(rates, |_, [x, _]| 2.0 * x, [-4.0, 4.0]));
    let plant = identify(&[clean], Input::Hold, &Units::default()).unwrap().plant;
    let options = Options::default().judging_file("device", plant).unwrap();
    let report = examine(&changed, &options, |_| ()).unwrap().report;
    let mut causes: Vec<&str> = report.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    assert_eq!(
        (report.verdict, &causes[..]),
        (Verdict::Explained, &["gain-error", "static-nonlinearity"][..]),
        "{report:#?}"
    );
}
