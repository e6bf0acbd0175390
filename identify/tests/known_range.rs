//! A curve of the spring is reported and exported where a record shows it, and continued as a plant file says.

use identify::Input;
use identify::effects::index_of;
use identify::effects::model::{Block, Model};
use identify::fit::simulator::Simulator;
use identify::plant::base::Base;
use identify::record::data::Data;
use identify::{Options, Report, examine};
use random_numbers::Lcg32;
use simulation::plant_file::{self, PlantFile};
use simulation::record::{Record, Row};

/// Levels of a stair with reversals, in parts of its highest voltage.
const LEVELS: [f64; 12] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.7, 0.3, 0.64, 0.96, 0.5, 0.0];
const SAMPLE_S: f64 = 0.2;
const ROWS_PER_LEVEL: usize = 120;

/// A law that bends upwards, 300 V at 500 V.
fn law(voltage: f64) -> f64 {
    voltage * (1.0 + 0.4 * (voltage / 500.0 - 1.0))
}

/// A record of a spring with a static law and a time constant over the voltage, read with uniform noise of 0.3 V RMS.
fn record(volts: impl Fn(f64) -> f64, settled: impl Fn(f64) -> f64, tau_s: impl Fn(f64) -> f64) -> Record {
    let (mut lag_v, mut numbers) = (settled(volts(LEVELS[0])), Lcg32::new(3));
    let row = |index: usize| {
        let voltage_v = volts(LEVELS[index / ROWS_PER_LEVEL]);
        let noise = numbers.uniform() - 0.5;
        let measured = Some(settled(voltage_v) / 11.0 + lag_v * 10.0 / 11.0 + noise);
        lag_v = settled(voltage_v) + (lag_v - settled(voltage_v)) * f64::exp(-SAMPLE_S / tau_s(voltage_v));
        Row { line: index + 2, time_s: SAMPLE_S * index as f64, voltage_v, measured }
    };
    Record { name: "stair".into(), rows: (0..LEVELS.len() * ROWS_PER_LEVEL).map(row).collect() }
}

fn examined(record: &Record) -> (Report, PlantFile) {
    let diagnosis = examine(record, &Options::default(), |_| ()).expect("a diagnosis");
    (diagnosis.report, diagnosis.plant)
}

/// Names of the parameters of a cause that was found.
fn parameters<'r>(report: &'r Report, cause: &str) -> Vec<&'r str> {
    let found = report.findings.iter().find(|finding| finding.cause == cause);
    let found = found.unwrap_or_else(|| panic!("no {cause}: {report:?}"));
    found.parameters.iter().map(|(name, _)| name.as_str()).collect()
}

#[test]
fn law_above_an_amplifiers_limit_is_neither_reported_nor_tabulated() {
    let (report, plant) = examined(&record(|part| 500.0 * part, |voltage| law(voltage.min(330.0)), |_| 5.5));
    assert_eq!(parameters(&report, "static-nonlinearity"), ["at_100_v", "at_200_v", "at_300_v"]);
    let [low, high] = report.extended.law_range_v.expect("a law");
    assert!(low == 0.0 && (high - 330.0).abs() < 1.0, "{low} {high}");
    let table = plant.law.expect("a law");
    assert_eq!(table.voltage_v.last(), Some(&high));
}

#[test]
fn law_below_the_lowest_voltage_is_not_reported_and_is_straight_in_the_file() {
    let (report, plant) = examined(&record(|part| 250.0 + 250.0 * part, law, |_| 5.5));
    assert_eq!(parameters(&report, "static-nonlinearity"), ["at_300_v", "at_400_v", "at_500_v"]);
    assert_eq!(report.extended.law_range_v, Some([250.0, 500.0]));
    let table = plant.law.expect("a law");
    assert_eq!(table.voltage_v[..2], [0.0, 250.0], "{table:?}");
}

#[test]
fn time_constant_at_a_voltage_that_was_never_applied_is_extrapolated() {
    let tau_s = |voltage: f64| 5.5 + 4.0 * voltage / 500.0;
    for (highest, extrapolated) in [(300.0, Some([0.0, 300.0])), (500.0, None)] {
        let (report, _) = examined(&record(|part| highest * part, |voltage| voltage, tau_s));
        assert_eq!(parameters(&report, "voltage-dependent-time-constant"), ["tau_low_s", "tau_high_s"]);
        let of = |index: usize| report.findings[0].parameters[index].1.extrapolated_from_v;
        assert_eq!([of(0), of(1)], [None, extrapolated], "{report:?}");
    }
}

/// Beyond the last point the spring follows the last line, and a file that was written is read back to the bit.
#[test]
fn exported_law_keeps_its_end_slope_and_survives_the_file_to_the_bit() {
    let data = Data::new(&record(|part| 300.0 * part, law, |_| 5.5), Input::Hold);
    let base = Base::paper();
    let bend = Block { effect: index_of("static-nonlinearity").expect("an effect"), form: 0 };
    let file = Model::default().with(bend, vec![0.4]).extend(&base, &data);
    let text = file.to_toml().expect("a text");
    let read = plant_file::parse("written", &text).expect("a plant file");
    assert_eq!(read, file);

    let beyond = Data::new(&record(|part| 700.0 * part, law, |_| 5.5), Input::Hold);
    let simulated = |file: &PlantFile| {
        let mut readings = Vec::new();
        let base = Base::new(file.clone()).expect("a base");
        Simulator::new(&beyond, &base).run(&Model::default(), &mut readings);
        readings.into_iter().map(f64::to_bits).collect::<Vec<u64>>()
    };
    assert_eq!(simulated(&read), simulated(&file));

    let table = file.law.clone().expect("a law");
    let [(x, y), (end, at_end)] =
        [2, 1].map(|back| table.voltage_v.len() - back).map(|at| (table.voltage_v[at], table.stiffness[at]));
    assert!((end - 300.0).abs() < 1e-9 && (at_end - law_of_bend(300.0)).abs() < 0.5, "{table:?}");
    let slope = (at_end - y) / (end - x);
    let base = Base::new(file).expect("a base");
    let settled = base.chain().law.at(700.0);
    assert!((settled - (at_end + slope * 400.0)).abs() < 1e-9, "{settled}");
}

/// A bend over a full scale of 300 V with a gain of 1 at 500 V.
fn law_of_bend(voltage: f64) -> f64 {
    voltage * (1.0 + 0.4 * (voltage - 500.0) / 300.0)
}
