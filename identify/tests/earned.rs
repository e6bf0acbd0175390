//! The verdict `explained`, and a high probability, have to be earned: on records of laws that no cause describes, of two lags in
//! series that only a linear model knows, and of a change that ends.

use identify::{Effort, Options, Report, Stop, Verdict, diagnose};
use random_numbers::Lcg64;
use simulation::plant_file;
use simulation::record::{Record, Row};

const ROWS: usize = 2400;
const SAMPLE_S: f64 = 0.1;

/// A record under 48 levels of 5 s each; `step` moves the relaxed part, and `read` is the stiffness, of voltage, state and time.
fn record(step: impl Fn(f64, f64, f64) -> f64, read: impl Fn(f64, f64, f64) -> f64) -> Record {
    let (mut state, mut noise) = (0.0, Lcg64::new(11));
    let row = |row: usize| {
        let (time_s, voltage_v) =
            (SAMPLE_S * row as f64, if row < 50 { 0.0 } else { 50.0 * (row / 50 * 7 % 11) as f64 });
        let measured = Some(read(voltage_v, state, time_s) + noise.normal());
        state = step(voltage_v, state, time_s);
        Row { line: row + 2, time_s, voltage_v, measured }
    };
    Record { name: "record".into(), rows: (0..ROWS).map(row).collect() }
}

fn lag(voltage_v: f64, state: f64, tau_s: f64) -> f64 {
    voltage_v + (state - voltage_v) * f64::exp(-SAMPLE_S / tau_s)
}

fn plain(voltage_v: f64, state: f64) -> f64 {
    voltage_v / 11.0 + state / 1.1
}

fn report(record: &Record) -> Report {
    diagnose(record, &Options::default()).unwrap()
}

/// The time constant grows by a tenth in the first half of the record. The residual of the best causes, 2.3 times the noise, passes
/// for autocorrelated noise with innovations of 1.09 V.
#[test]
fn a_law_that_no_cause_describes_is_not_explained() {
    let found = report(&record(
        |voltage_v, state, time_s| lag(voltage_v, state, 5.5 * (1.0 + 0.1 * (time_s / 120.0).min(1.0))),
        |voltage_v, state, _| plain(voltage_v, state),
    ));
    assert_eq!(found.verdict, Verdict::Unexplained, "{found:?}");
    assert!(found.findings.iter().all(|finding| finding.probability <= 0.9), "{:?}", found.findings);
}

/// A controller brings the noise of the readings into the command, on which the residual of the right simulation then depends. The same
/// disturbance under a schedule leaves nothing but noise.
#[test]
fn a_right_simulation_in_a_control_loop_is_not_wrong() {
    let spring = "schema = 1\n[relaxation]\nshare = 0.0\ntau_s = 5.5\n";
    let options = Options::default().judging_file("loop", plant_file::parse("loop", spring).unwrap()).unwrap();
    for (in_feedback, expected) in [(true, Verdict::Insufficient), (false, Verdict::Consistent)] {
        let (mut state, mut slow, mut sum, mut noise) = (0.0, 0.0, 0.0, Lcg64::new(11));
        let row = |row: usize| {
            slow = 0.95 * slow + 0.5 * noise.normal();
            let target = [100.0, 250.0, 50.0, 300.0, 150.0, 200.0][row / 200 % 6];
            let error = target - (state + slow);
            let controlled: f64 = 5.0 * error + sum;
            sum += 0.1 * error;
            let voltage_v = match (row < 50, in_feedback) {
                (true, _) => 0.0,
                (false, true) => controlled.clamp(0.0, 500.0),
                (false, false) => target,
            };
            let measured = Some(state + slow);
            state = lag(voltage_v, state, 5.5);
            Row { line: row + 2, time_s: SAMPLE_S * row as f64, voltage_v, measured }
        };
        let record = Record { name: "record".into(), rows: (0..ROWS).map(row).collect() };
        let found = diagnose(&record, &options).unwrap();
        assert_eq!(found.verdict, expected, "{found:?}");
        assert_eq!(found.leftover.is_some_and(|left| left.contains("made in feedback")), in_feedback);
    }
}

/// A search that was stopped has nothing to say on what it has not tried.
#[test]
fn a_search_that_was_cut_is_not_explained_while_errors_are_left() {
    let record =
        record(|voltage_v, state, _| lag(voltage_v, state, 5.7), |voltage_v, state, _| plain(voltage_v, state));
    let stop = Stop::after(std::time::Duration::ZERO);
    let found = diagnose(&record, &Options { effort: Effort::Quick, stop, ..Options::default() }).unwrap();
    assert_eq!(found.verdict, Verdict::Unexplained, "{found:?}");
    assert!(found.leftover.is_some());
    assert_eq!(report(&record).verdict, Verdict::Explained);
}

/// A gain error is as certain as before; the best linear model knows it as well.
#[test]
fn a_cause_that_leaves_nothing_but_noise_is_explained_and_sure() {
    let found = report(&record(
        |voltage_v, state, _| lag(voltage_v, state, 5.5),
        |voltage_v, state, _| 1.1 * plain(voltage_v, state),
    ));
    assert_eq!((found.verdict, found.findings[0].cause), (Verdict::Explained, "gain-error"), "{found:?}");
    assert!(found.findings[0].probability > 0.99, "{:?}", found.findings[0]);
}

/// Readings at a bound say only that the stiffness is beyond it, also where the rest of a record is predicted.
#[test]
fn a_drift_into_the_bound_of_the_sensor_is_explained() {
    let mut drifting = record(
        |voltage_v, state, _| lag(voltage_v, state, 5.5),
        |voltage_v, state, time_s| (1.0 + 0.002 * time_s) * plain(voltage_v, state),
    );
    for row in &mut drifting.rows {
        row.measured = row.measured.map(|reading| reading.min(150.0));
    }
    let found = report(&drifting);
    let mut causes: Vec<_> = found.findings.iter().map(|finding| finding.cause).collect();
    causes.sort_unstable();
    assert_eq!((found.verdict, causes), (Verdict::Explained, vec!["drift", "sensor-saturation"]), "{found:?}");
}
