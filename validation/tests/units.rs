//! The answer does not depend on units: the same record in other units of time, voltage and reading, compared with the same
//! spring in those units, has the same causes, verdict and probabilities, and parameters that scale.

use identify::answer::{Parameter, Report};
use identify::dimension::Dimension;
use identify::plant::base::Base;
use identify::{Input, Options, examine::diagnose, identify};
use rayon::prelude::*;
use simulation::plant_file::{PlantFile, Reading};
use simulation::record::{Record, Row};
use simulation::units::Units;
use validation::ground_truth::Cause;
use validation::ground_truth::record::Recipe;

/// Units in which a record is written again: each number of the file per number of the original.
#[derive(Clone, Copy, Debug)]
struct Other {
    start_s: f64,
    time: f64,
    voltage: f64,
    reading: f64,
    zero: f64,
}

const SAME: Other = Other { start_s: 0.0, time: 1.0, voltage: 1.0, reading: 1.0, zero: 0.0 };

const OTHERS: [Other; 9] = [
    // Milliseconds, hours and megaseconds instead of seconds.
    Other { time: 1e-3, ..SAME },
    Other { time: 3600.0, ..SAME },
    Other { time: 1e6, ..SAME },
    Other { voltage: 1e-3, ..SAME },
    Other { voltage: 20.0, ..SAME },
    Other { reading: 1e-3, ..SAME },
    Other { reading: 1e4, zero: -273.15, ..SAME },
    Other { reading: -0.05, ..SAME },
    // Rows of seconds since 1970.
    Other { start_s: 1.7e9, time: 10.0, voltage: 7.0, reading: 3.0, zero: 25.0 },
];

impl Other {
    fn record(self, record: &Record) -> Record {
        let row = |row: &Row| Row {
            time_s: self.start_s + self.time * row.time_s,
            voltage_v: self.voltage * row.voltage_v,
            measured: row.measured.map(|reading| self.zero + self.reading * reading),
            ..*row
        };
        Record { name: record.name.clone(), rows: record.rows.iter().map(row).collect() }
    }

    fn options(self) -> Options {
        let mut plant = PlantFile::from(model::Plant::PAPER);
        plant.relaxation.tau_s[0] *= self.time;
        plant.relaxation.tau_high_at_v = Some(500.0 * self.voltage);
        plant.reading = Some(Reading { gain: self.reading / self.voltage, zero: self.zero });
        Options { base: Base::new(plant).expect("a spring"), ..Options::default() }
    }

    fn number(self, dimension: Dimension, value: f64) -> f64 {
        match dimension {
            Dimension::Ratio | Dimension::OfResponse | Dimension::OfFullScale => value,
            Dimension::Time => self.time * value,
            Dimension::TimePoint => self.start_s + self.time * value,
            Dimension::Frequency | Dimension::Rate => value / self.time,
            Dimension::Voltage => self.voltage * value,
            Dimension::VoltageRate => self.voltage / self.time * value,
            Dimension::Stiffness | Dimension::Reading => self.zero + self.reading * value,
            Dimension::ReadingDifference => self.reading * value,
            Dimension::ReadingSize => self.reading.abs() * value,
        }
    }

    /// Returns how two reports of one record, in its own units and in these, differ beyond rounding; empty if they do not.
    fn differences(self, own: &Report, other: &Report) -> Vec<String> {
        let mut found = Vec::new();
        let mut compare = |what: &str, own: f64, other: f64, tolerance: f64| {
            if (own - other).abs() > tolerance {
                found.push(format!("{what}: {other} instead of {own}"));
            }
        };
        let size = |value: f64| self.number(Dimension::ReadingSize, value);
        for (what, own, other) in [
            ("rmse", own.baseline.rmse, other.baseline.rmse),
            ("extended rmse", own.extended.quality.rmse, other.extended.quality.rmse),
            ("held-out rmse", own.extended.quality.held_out_rmse, other.extended.quality.held_out_rmse),
        ] {
            compare(what, size(own), other, 1e-3 * size(own));
        }
        for (own, other) in own.findings.iter().zip(&other.findings) {
            compare(own.cause, own.probability, other.probability, 0.01);
            for ((name, own), (_, other)) in own.parameters.iter().zip(&other.parameters) {
                let Parameter { dimension, .. } = *own;
                let [value, low, high] = [own.value, own.low, own.high].map(|value| self.number(dimension, value));
                let (low, high) = (low.min(high), low.max(high));
                let close = 1e-3 * (high - low) + 1e-6 * (value - self.number(dimension, 0.0)).abs();
                compare(name, value, other.value, close);
                compare(name, low, other.low, 10.0 * close);
                compare(name, high, other.high, 10.0 * close);
            }
        }
        let causes = |report: &Report| report.findings.iter().map(|finding| finding.cause).collect::<Vec<_>>();
        let words = [own, other].map(|report| format!("{:?} {:?}", report.verdict, causes(report)));
        if words[0] != words[1] {
            found.push(format!("{} instead of {}", words[1], words[0]));
        }
        found
    }
}

#[test]
fn no_unit_changes_the_answer() {
    let of_cause = |cause: Cause| {
        let record = Recipe { rows: 500, ..Recipe::of(&[cause]) }.draw(77).record();
        let own = diagnose(&record, &Options::default()).expect("a report");
        assert_eq!(own.findings.first().map(|finding| finding.cause), Some(cause.name()), "{own:?}");
        wrong(cause, &own, &OTHERS, |other| diagnose(&other.record(&record), &other.options()).expect("a report"))
    };
    let wrong: Vec<String> = Cause::ALL.into_par_iter().flat_map(of_cause).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// An identified spring has no voltage of its own: also within the 500 V over which the paper's spring is curved.
#[test]
fn no_size_of_the_voltage_changes_the_answer_for_an_identified_spring() {
    let judged = |record: &Record| {
        let identified = identify(std::slice::from_ref(record), Input::Hold, &Units::default()).expect("a spring");
        diagnose(record, &Options::default().judging(identified).expect("a spring")).expect("a report")
    };
    // Sizes for which curves are given at voltages of round numbers, too.
    let others = [0.1, 0.4, 0.5, 10.0].map(|voltage| Other { voltage, reading: voltage, ..SAME });
    let causes = [
        Cause::StaticNonlinearity,
        Cause::VoltageDependentTimeConstant,
        Cause::Drift,
        Cause::AmplifierLimit,
        Cause::AmplifierSlew,
    ];
    let of_cause = |cause: Cause| {
        let record = Recipe { rows: 500, ..Recipe::of(&[cause]) }.draw(77).record();
        wrong(cause, &judged(&record), &others, |other| judged(&other.record(&record)))
    };
    let wrong: Vec<String> = causes.into_par_iter().flat_map(of_cause).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// How the reports in other units differ from that in a record's own.
fn wrong(cause: Cause, own: &Report, others: &[Other], report: impl Fn(Other) -> Report) -> Vec<String> {
    let differences = |&other: &Other| {
        let differences = other.differences(own, &report(other));
        (!differences.is_empty()).then(|| format!("{cause} in {other:?}: {}", differences.join("; ")))
    };
    others.iter().filter_map(differences).collect()
}
