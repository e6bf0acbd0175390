use simulation::record::Row;

use super::*;
use crate::stats::scale::normals;

/// A record of a lag of 4 s with share 0.2, gain 0.5 and zero 3, by its exact recursion.
fn record(rows: usize, first: usize, phi: f64, sigma: f64) -> Record {
    let noise = normals(first + rows).split_off(first);
    let steps = normals(rows + 77).split_off(77);
    let (mut lag, mut error) = (0.0, 0.0);
    let row = |row: usize| {
        let voltage_v = 100.0 + 50.0 * steps[row / 20];
        error = phi * error + sigma * (1.0 - phi * phi).sqrt() * noise[row];
        let reading = 3.0 + 0.5 * (0.2 * voltage_v + 0.8 * lag) + error;
        lag = voltage_v + (lag - voltage_v) * f64::exp(-0.25 / 4.0);
        Row { line: 0, time_s: 0.25 * row as f64, voltage_v, measured: Some(reading) }
    };
    Record { name: "lag".into(), rows: (0..rows).map(row).collect() }
}

fn found(records: &[Record]) -> Identified {
    identify(records, Input::Hold, &Units::default()).expect("a spring")
}

/// In white and in autocorrelated noise.
#[test]
fn intervals_contain_the_truth_in_about_95_percent_of_the_records() {
    for phi in [0.0, 0.8] {
        let mut inside = [0; 4];
        let mut orders = [0; 5];
        let seeds = 100;
        for seed in 0..seeds {
            let report = found(&[record(400, 400 * seed + 1000, phi, 0.5)]).report;
            orders[report.order] += 1;
            let Nominal { gain, zero, share, tau_s, .. } = &report.nominal;
            let contains =
                |quantity: &Quantity, value: f64| usize::from((quantity.low..=quantity.high).contains(&value));
            inside[0] += contains(gain, 0.5);
            inside[1] += contains(zero, 3.0);
            inside[2] += contains(share, 0.2);
            inside[3] += tau_s.first().map_or(0, |lag| contains(&lag.tau, 4.0));
        }
        println!("{phi}: inside {inside:?}, orders {orders:?}");
        assert!(
            inside.iter().all(|&inside| (90..=99).contains(&(100 * inside / seeds))),
            "{phi}: {inside:?} {orders:?}"
        );
        assert!(orders[1] * 100 >= 80 * seeds, "{orders:?}");
    }
}

#[test]
fn plant_file_holds_the_spring_in_its_units() {
    let units = Units { reading: "mm".into(), ..Units::default() };
    let identified = identify(&[record(800, 0, 0.0, 0.01)], Input::Hold, &units).unwrap();
    let plant = &identified.plant;
    let reading = plant.reading.unwrap();
    assert!((reading.gain - 0.5).abs() < 1e-3 && (reading.zero - 3.0).abs() < 0.02, "{reading:?}");
    assert!((plant.relaxation.share - 0.2).abs() < 1e-3 && (plant.relaxation.tau_s[0] - 4.0).abs() < 0.01);
    assert_eq!((plant.relaxation.tau_s.len(), plant.amplifier.clone(), plant.even), (1, None, false));
    assert_eq!(plant.units.as_ref().unwrap().reading.as_deref(), Some("mm"));
    assert_eq!(identified.report.nominal.gain.unit, "mm/V");
    plant.check_for_host().unwrap();
}

#[test]
fn even_springs_are_recognised_where_the_voltage_has_both_signs() {
    let switched = |even: bool| {
        let mut record = record(800, 0, 0.0, 0.05);
        for (at, row) in record.rows.iter_mut().enumerate() {
            if at / 30 % 2 == 1 {
                row.voltage_v = -row.voltage_v;
                row.measured = row.measured.map(|value| if even { value } else { 6.0 - value });
            }
        }
        found(&[record]).report.input_law
    };
    assert_eq!(switched(true), InputLaw::Even);
}

#[test]
fn records_without_information_are_rejected_in_one_line() {
    let mut still = record(100, 0, 0.0, 0.1);
    still.rows.iter_mut().for_each(|row| row.voltage_v = 5.0);
    let mut dead = record(100, 0, 0.0, 0.1);
    dead.rows.iter_mut().for_each(|row| row.measured = Some(1.0));
    for (record, expected) in [
        (still, "the voltage never changes"),
        (dead, "the reading never changes"),
        (record(5, 0, 0.0, 0.1), "5 row(s)"),
    ] {
        let error = identify(&[record], Input::Hold, &Units::default()).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
}
