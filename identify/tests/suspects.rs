//! What a report shows of causes that are no findings: suspects, and the best explanations without each finding.

use identify::answer::Judge;
use identify::dimension::significant;
use identify::{Diagnosis, Options, Report, Verdict, examine};
use random_numbers::Lcg32;
use simulation::record::{Record, Row};

const SAMPLE_S: f64 = 0.2;
const ROWS_PER_LEVEL: usize = 100;

/// A record of a spring with the paper's time constant whose settled stiffness is that at another voltage; `error` is a further
/// error of each row as a function of its number, voltage and lag.
fn diagnosed(levels: &[f64], settled: impl Fn(f64) -> f64, error: impl Fn(usize, f64, f64) -> f64) -> Diagnosis {
    let (mut lag_v, mut numbers) = (settled(levels[0]), Lcg32::new(5));
    let row = |index: usize| {
        let voltage_v = levels[index / ROWS_PER_LEVEL];
        let noise = 2.0 * (numbers.uniform() - 0.5);
        let stiffness = settled(voltage_v) / 11.0 + lag_v * 10.0 / 11.0;
        let measured = Some(stiffness + noise + error(index, voltage_v, lag_v));
        lag_v = settled(voltage_v) + (lag_v - settled(voltage_v)) * f64::exp(-SAMPLE_S / 5.5);
        Row { line: index + 2, time_s: SAMPLE_S * index as f64, voltage_v, measured }
    };
    let record = Record { name: "stair".into(), rows: (0..levels.len() * ROWS_PER_LEVEL).map(row).collect() };
    examine(&record, &Options::default(), |_| ()).expect("a diagnosis")
}

const STAIR: [f64; 10] = [0.0, 100.0, 300.0, 500.0, 400.0, 150.0, 350.0, 250.0, 450.0, 50.0];

fn assert_well_formed(report: &Report) {
    assert!(!report.suspects.is_empty() && report.suspects.len() <= 5, "{report:?}");
    assert!(report.suspects.is_sorted_by_key(|suspect| suspect.nats_short), "{report:?}");
    for suspect in &report.suspects {
        let is_found = |finding: &identify::answer::Finding| finding.cause == suspect.cause;
        assert!(!report.findings.iter().any(is_found) && !suspect.with.contains(&suspect.cause), "{suspect:?}");
        assert!(suspect.nats_short >= 0.0 && !suspect.parameters.is_empty(), "{suspect:?}");
        assert!(suspect.parameters.iter().all(|(_, it)| it.low <= it.value && it.value <= it.high), "{suspect:?}");
        let run = suspect.cause == "reading-offset" && suspect.parameters[0].1.value > 0.0;
        assert!(!run || suspect.judge == Judge::LeaveOneOut, "{suspect:?}");
    }
}

/// Half a period of a sine over the record is no cause's law.
#[test]
fn unexplained_record_lists_suspects_and_an_explained_one_none() {
    let swing = |row: usize, _: f64, _: f64| 20.0 * (std::f64::consts::PI * row as f64 / 1000.0).sin();
    let report = diagnosed(&STAIR, |voltage| voltage, swing).report;
    assert_eq!(report.verdict, Verdict::Unexplained);
    assert_well_formed(&report);
    assert!(report.suspects.iter().any(|it| it.judge == Judge::HeldOut), "{report:?}");

    let report = diagnosed(&STAIR, |voltage| 1.1 * voltage, |_, _, _| 0.0).report;
    assert_eq!((report.verdict, report.suspects.len()), (Verdict::Explained, 0));
}

/// On a stair that only rises, hysteresis and a static law are the same.
#[test]
fn rival_of_an_ambiguous_record_is_a_suspect() {
    let rising = [0.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0];
    let play = |voltage: f64| (voltage - 40.0).max(0.0);
    let report = diagnosed(&rising, play, |_, _, _| 0.0).report;
    assert_eq!(report.verdict, Verdict::Ambiguous, "{report:?}");
    assert_well_formed(&report);
    let rivals = ["hysteresis", "static-nonlinearity"];
    assert!(rivals.contains(&report.suspects[0].cause) && rivals.contains(&report.findings[0].cause), "{report:?}");
}

/// A static law contains a gain error and is no explanation without it; the ranking and the evidence name the same other one.
#[test]
fn ranking_and_evidence_agree_on_the_best_without_a_cause() {
    let Diagnosis { report, ranking, .. } = diagnosed(&STAIR, |voltage| 1.1 * voltage, |_, _, _| 0.0);
    assert_eq!(report.findings[0].cause, "gain-error");
    let without: Vec<_> = ranking.iter().filter(|ranked| ranked.best_without == ["gain-error"]).collect();
    let [without] = without.as_slice() else { panic!("{ranking:?}") };
    assert!(!without.causes.contains(&"static-nonlinearity"), "{without:?}");
    let evidence = &report.findings[0].evidence;
    let said = format!("{} V)", significant(without.rmse, 4));
    assert!(
        evidence.contains(&said) && without.causes.iter().all(|cause| evidence.contains(cause)),
        "{said}: {evidence}"
    );
    let behind = format!("{:.1} nats", ranking[0].score - without.score);
    assert!(evidence.contains(&behind), "{behind}: {evidence}");
}
