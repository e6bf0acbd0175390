//! Records that the paper's spring is far from are diagnosed like any other: time constants, gains and zeros of any size, readings
//! of a resonator, and a voltage of both signs.

use std::f64::consts::TAU;

use identify::plant::base::Base;
use identify::{Options, Report, Verdict, diagnose};
use random_numbers::Lcg64;
use simulation::plant_file::{PlantFile, Reading};
use simulation::record::{Record, Row};

struct Spring {
    tau_s: f64,
    share: f64,
    gain: f64,
    zero: f64,
    /// Law from the voltage to the settled stiffness.
    law: fn(f64) -> f64,
}

const PAPER: Spring = Spring { tau_s: 5.5, share: 1.0 / 11.0, gain: 1.0, zero: 0.0, law: |voltage| voltage };

impl Spring {
    /// Returns a record of 600 rows under a stair with the given voltages, each held for four time constants, with noise of 0.1 %
    /// of 500 V.
    fn record(&self, levels: [f64; 6]) -> Record {
        let (mut lag, mut noise) = (0.0, Lcg64::new(7));
        let step_s = self.tau_s / 25.0;
        let row = |row: usize| {
            let voltage_v = levels[row / 100];
            let settled = (self.law)(voltage_v);
            let stiffness = self.share * settled + (1.0 - self.share) * lag + 0.5 * noise.normal();
            lag = settled + (lag - settled) * f64::exp(-step_s / self.tau_s);
            let measured = Some(self.zero + self.gain * stiffness);
            Row { line: row + 2, time_s: step_s * row as f64, voltage_v, measured }
        };
        Record { name: "stair".into(), rows: (0..600).map(row).collect() }
    }
}

const STAIR: [f64; 6] = [0.0, 300.0, 100.0, 500.0, 200.0, 400.0];

fn causes(report: &Report) -> Vec<&'static str> {
    report.findings.iter().map(|finding| finding.cause).collect()
}

fn value(report: &Report, parameter: &str) -> f64 {
    let parameters = report.findings.iter().flat_map(|finding| &finding.parameters);
    parameters.into_iter().find(|(name, _)| name == parameter).expect("a parameter").1.value
}

#[test]
fn time_constants_of_any_size_are_found_from_the_papers() {
    for tau_s in [1e-6, 0.003, 181.0, 1e5] {
        let report = diagnose(&Spring { tau_s, ..PAPER }.record(STAIR), &Options::default()).unwrap();
        assert_eq!(causes(&report), ["time-constant"], "{tau_s}: {report:?}");
        assert!((value(&report, "tau_s") / tau_s - 1.0).abs() < 0.01, "{tau_s}: {report:?}");
    }
}

#[test]
fn gains_of_any_size_and_sign_are_found_from_1() {
    for gain in [1e-6, 0.01, 200.0, -3.0] {
        let report = diagnose(&Spring { gain, ..PAPER }.record(STAIR), &Options::default()).unwrap();
        assert_eq!(causes(&report), ["gain-error"], "{gain}: {report:?}");
        assert!((value(&report, "gain") / gain - 1.0).abs() < 0.01, "{gain}: {report:?}");
    }
}

#[test]
fn a_zero_of_any_size_is_an_offset_of_all_readings() {
    for zero in [-273.15, 1e5] {
        let report = diagnose(&Spring { zero, ..PAPER }.record(STAIR), &Options::default()).unwrap();
        assert_eq!(causes(&report), ["reading-offset"], "{zero}: {report:?}");
        assert!((value(&report, "offset") - zero).abs() < 0.5, "{zero}: {report:?}");
    }
}

#[test]
fn an_instantaneous_spring_agrees_with_a_nominal_share_of_1() {
    let record = Spring { share: 1.0, ..PAPER }.record(STAIR);
    let mut file = PlantFile::from(model::Plant::PAPER);
    file.relaxation.share = 1.0;
    let options = Options { base: Base::new(file).unwrap(), ..Options::default() };
    let report = diagnose(&record, &options).unwrap();
    assert_eq!(report.verdict, Verdict::Consistent, "{report:?}");
    assert_eq!(causes(&diagnose(&record, &Options::default()).unwrap()), ["instantaneous-share"]);
}

#[test]
fn a_spring_that_responds_to_the_magnitude_agrees_with_an_even_nominal_spring() {
    let levels = [0.0, 300.0, -300.0, -500.0, 200.0, -400.0];
    let record = Spring { law: f64::abs, gain: 0.02, zero: 3.0, ..PAPER }.record(levels);
    let file = PlantFile {
        even: true,
        reading: Some(Reading { gain: 0.02, zero: 3.0 }),
        ..PlantFile::from(model::Plant::PAPER)
    };
    let options = Options { base: Base::new(file).unwrap(), ..Options::default() };
    let report = diagnose(&record, &options).unwrap();
    assert_eq!(report.verdict, Verdict::Consistent, "{report:?}");
}

#[test]
fn a_voltage_of_both_signs_agrees_with_the_papers_spring() {
    let record = PAPER.record([0.0, 300.0, -300.0, -500.0, 200.0, -400.0]);
    let report = diagnose(&record, &Options::default()).unwrap();
    assert_eq!(report.verdict, Verdict::Consistent, "{report:?}");
}

/// The resonator has 68 Hz and a damping ratio of 0.05, the multisine 20 lines from 5 Hz to 150 Hz.
#[test]
fn a_resonator_under_a_multisine_is_diagnosed() {
    let (omega, zeta, step_s) = (TAU * 68.0, 0.05, 1.0 / 1600.0);
    let (mut x, mut v, mut noise) = (0.0, 0.0, Lcg64::new(7));
    let row = |row: usize| {
        let time_s = step_s * row as f64;
        let line = |line: i32| (TAU * (5.0 + 7.6 * f64::from(line)) * time_s + f64::from(line * line)).sin();
        let voltage_v: f64 = 30.0 * (0..20).map(line).sum::<f64>();
        let measured = Some(x + 0.2 * noise.normal());
        for _ in 0..20 {
            v += step_s / 20.0 * (omega * omega * (voltage_v - x) - 2.0 * zeta * omega * v);
            x += step_s / 20.0 * v;
        }
        Row { line: row + 2, time_s, voltage_v, measured }
    };
    let record = Record { name: "multisine".into(), rows: (0..600).map(row).collect() };
    let report = diagnose(&record, &Options::default()).unwrap();
    assert!(causes(&report).contains(&"resonance"), "{report:?}");
    assert!((value(&report, "freq_hz") / 68.0 - 1.0).abs() < 0.02, "{report:?}");
    assert!(report.extended.quality.rmse < 0.2 * report.baseline.rmse, "{report:?}");
}

/// A quadratic law that is right at the largest voltage is no error of the gain, in whatever unit the command is.
#[test]
fn the_unit_of_the_command_changes_no_answer() {
    let law = |voltage: f64| voltage * (1.0 - 0.5 * (voltage / 500.0 - 1.0));
    let record = Spring { law, ..PAPER }.record(STAIR);
    let reports = [0.002, 1.0, 1.2, 9.9].map(|unit| {
        let row = |row: &Row| Row { voltage_v: unit * row.voltage_v, ..*row };
        let record = Record { rows: record.rows.iter().map(row).collect(), ..record.clone() };
        let reading = Some(Reading { gain: 1.0 / unit, zero: 0.0 });
        let base = Base::new(PlantFile { reading, ..Base::paper().file().clone() }).unwrap();
        diagnose(&record, &Options { base, ..Options::default() }).unwrap()
    });
    for report in &reports {
        assert_eq!(causes(report), ["static-nonlinearity"], "{report:?}");
        let (probability, of_first) = (report.findings[0].probability, reports[0].findings[0].probability);
        assert!((probability - of_first).abs() < 1e-3, "{probability} {of_first}");
    }
}
