use std::f64::consts::TAU;

use random_numbers::Lcg32;
use simulation::plant_file::Range;
use simulation::record::Row;

use super::*;
use crate::answer::{LinearError, Verdict};
use crate::examine::{Options, diagnose};
use crate::nominal::models::{MOST_SPOILED, WORTHWHILE};
use crate::nominal::report::{Nominal, Quantity, Report};
use crate::plant::base::Base;
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
        let seeds = 200;
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

/// A drift would be a slow lag, and a hum an oscillation, that begin at the first reading.
#[test]
fn what_the_voltage_does_not_drive_is_no_part_of_the_spring() {
    let plain = record(600, 3000, 0.0, 0.1);
    let with = |more: &dyn Fn(f64) -> f64| {
        let mut record = plain.clone();
        record.rows.iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading + more(row.time_s)));
        found(&[record]).report
    };
    let drift = with(&|time_s| 0.05 * time_s);
    let hum = with(&|time_s| 10.0 * (2.0 * time_s).sin());
    for (report, least) in [(&drift, 1), (&hum, 2)] {
        assert_eq!((report.order, report.oscillation.len()), (1, 0), "{report:?}");
        assert!(report.undriven_order >= least, "{report:?}");
        assert!(report.remarks.iter().any(|remark| remark.contains("does not drive")), "{:?}", report.remarks);
        let Nominal { gain, zero, tau_s, .. } = &report.nominal;
        assert!((gain.value / 0.5 - 1.0).abs() < 0.01 && (tau_s[0].tau.value / 4.0 - 1.0).abs() < 0.02, "{report:?}");
        assert!((zero.low..=zero.high).contains(&3.0), "{zero:?}");
    }
    // That of the first reading.
    assert!((drift.nominal.zero.value - 3.0).abs() < 0.2, "{:?}", drift.nominal.zero);
    // That of the rest of the record.
    let warm_up = with(&|time_s| 5.0 * f64::exp(-time_s / 15.0));
    assert_eq!((warm_up.order, warm_up.undriven_order), (1, 1), "{warm_up:?}");
    assert!((warm_up.nominal.zero.value - 3.0).abs() < 0.2, "{:?}", warm_up.nominal.zero);
    assert_eq!(with(&|_| 0.0).undriven_order, 0);
}

/// Fitted as they are, readings at a bound would lower the gain and add time constants.
#[test]
fn readings_at_a_bound_of_the_sensor_are_left_out() {
    let whole = record(600, 3000, 0.0, 0.1);
    let mut readings: Vec<f64> = whole.rows.iter().filter_map(|row| row.measured).collect();
    readings.sort_by(f64::total_cmp);
    let limit = readings[450];
    let mut stopped = whole.clone();
    stopped.rows.iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading.min(limit)));
    let [report, expected] = [&stopped, &whole].map(|record| found(std::slice::from_ref(record)).report);
    assert_eq!((report.rows, report.order, report.at_bound.len()), (450, expected.order, 1), "{report:?}");
    assert_eq!((report.at_bound[0].limit, report.at_bound[0].readings), (limit, 150));
    let near = |of: &Report| [of.nominal.gain.value / 0.5, of.nominal.tau_s[0].tau.value / 4.0];
    assert!(near(&report).iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{:?}", near(&report));
    assert!(report.remarks[0].contains("150 readings at"), "{:?}", report.remarks);
    assert!(expected.at_bound.is_empty() && expected.rows == 600);
}

/// A record of a lag of 30 rows with share 0.1 that responds three rows late, under levels of 150 rows.
fn late(rows: usize, interval_s: f64) -> Record {
    const DELAY: usize = 3;
    let noise = normals(rows);
    let level = |row: usize| 10.0 * ((row / 150 * 7) % 11) as f64;
    let mut lag = 0.0;
    let row = |row: usize| {
        let late_v = if row < DELAY { 0.0 } else { level(row - DELAY) };
        let reading = 0.1 * late_v + 0.9 * lag + 0.2 * noise[row];
        lag = late_v + (lag - late_v) * f64::exp(-1.0 / 30.0);
        Row { line: 0, time_s: interval_s * row as f64, voltage_v: level(row), measured: Some(reading) }
    };
    Record { name: "late".into(), rows: (0..rows).map(row).collect() }
}

/// A part of the rows is searched: levels of a round number of rows would give it readings at the same times after each step only.
#[test]
fn a_delay_is_found_in_more_rows_than_are_searched_under_levels_of_equal_length() {
    let report = found(&[late(6000, 0.001)]).report;
    let Nominal { share, delay_s, .. } = &report.nominal;
    assert!(report.order == 1 && report.undriven_order == 0, "{report:?}");
    assert!(share.low < 0.1 && 0.1 < share.high && (delay_s.high - 0.003).abs() < 1e-9, "{report:?}");
    assert!(report.linear.iter().all(|of| of.held_out_rmse < 0.21), "{report:?}");
}

/// Taken as they are, times at 30 Hz in whole ms move readings before a step of the voltage, and let a delay of part of a row take the
/// place of a part of the share.
#[test]
fn rounded_times_and_lost_rows_do_not_shift_the_delay() {
    for lost in [0, 7] {
        let mut record = late(1500, 1.0 / 30.0);
        record.rows.iter_mut().for_each(|row| row.time_s = (row.time_s * 1e3).round() / 1e3);
        let mut row = 0;
        record.rows.retain(|_| {
            row += 1;
            lost == 0 || row % lost != 5 || row % 150 == 1
        });
        let report = found(&[record]).report;
        let Nominal { share, delay_s, .. } = &report.nominal;
        assert!(report.order == 1 && share.low < 0.1 && 0.1 < share.high, "{report:?}");
        assert!((delay_s.value * 30.0 - 3.0).abs() < 1e-3 && delay_s.low < 0.1, "{report:?}");
    }
}

/// In uneven rows under a held voltage, a delay is known up to the next one with which a reading changes its place between the steps.
#[test]
fn intervals_contain_delay_and_share_in_uneven_rows() {
    const RECORDS: usize = 20;
    let record = |seed: usize, rows: usize, sigma: f64| {
        let noise = normals(400 * (seed + 20) + rows);
        let gap_s = |row: usize| 0.05 + 0.1 * noise[400 * (seed + 20) + row].abs();
        let times: Vec<f64> = (0..rows)
            .scan(0.0, |time_s, row| {
                *time_s += gap_s(row);
                Some(*time_s)
            })
            .collect();
        let level = |row: usize| 10.0 * ((row / 25 * 7 + seed) % 11) as f64;
        // The lag's response to each step, 0.2 s late.
        let late = |row: usize| -> f64 {
            let steps = (1..=row).filter(|at| level(*at) != level(at - 1));
            let response = |at: usize| match times[row] - times[at] - 0.2 {
                since_s if since_s >= 0.0 => (level(at) - level(at - 1)) * (1.0 - 0.8 * f64::exp(-since_s / 1.5)),
                _ => 0.0,
            };
            level(0) + steps.map(response).sum::<f64>()
        };
        let row = |row: usize| {
            let measured = Some(late(row) + sigma * noise[400 * seed + row]);
            Row { line: 0, time_s: times[row], voltage_v: level(row), measured }
        };
        Record { name: "uneven".into(), rows: (0..rows).map(row).collect() }
    };
    let contains = |of: &Quantity, value: f64| (of.low..=of.high).contains(&value);
    let holds = |report: &&Report| {
        let Nominal { share, delay_s, tau_s, .. } = &report.nominal;
        contains(share, 0.2) && contains(delay_s, 0.2) && tau_s.len() == 1 && contains(&tau_s[0].tau, 1.5)
    };
    // Also where one reading beyond a step decides nothing, so that several places of the delay fit.
    for (sigma, widest) in [(0.2, 0.05), (5.0, 0.3)] {
        let reports: Vec<Report> = (0..RECORDS).map(|seed| found(&[record(seed, 400, sigma)]).report).collect();
        let is_narrow = |report: &&Report| report.nominal.delay_s.high - report.nominal.delay_s.low < widest;
        let counts = [reports.iter().filter(holds).count(), reports.iter().filter(is_narrow).count()];
        println!("{sigma}: {counts:?}");
        // Of three intervals of 95 % each.
        assert!(counts[0] >= 15 && counts[1] >= 17, "{sigma}: {counts:?}");
        let remark =
            |report: &Report| report.remarks.iter().any(|of| of.contains("The times of the readings cannot tell"));
        assert!(reports.iter().all(remark));
    }
    // In the part of the rows that is searched the places are wider.
    let long = found(&[record(3, 4000, 0.2)]).report;
    assert!(holds(&&long) && long.nominal.delay_s.high - long.nominal.delay_s.low < 0.005, "{long:?}");
}

/// Of a delay of 0.6 rows, whole rows leave a part to the share, which is 0.
#[test]
fn interval_of_the_share_contains_that_of_a_delay_of_a_part_of_a_row() {
    let (rows, noise) = (600, normals(600));
    let level = |row: usize| 10.0 * ((row / 25 * 7) % 11) as f64;
    let late = |row: usize| -> f64 {
        let steps = (1..=row).filter(|at| level(*at) != level(at - 1));
        let response = |at: usize| match (row - at) as f64 - 0.6 {
            since if since >= 0.0 => (level(at) - level(at - 1)) * -f64::exp_m1(-since / 12.0),
            _ => 0.0,
        };
        steps.map(response).sum()
    };
    let row = |row: usize| {
        let measured = Some(late(row) + 0.2 * noise[row]);
        Row { line: 0, time_s: 0.05 * row as f64, voltage_v: level(row), measured }
    };
    let report = found(&[Record { name: "late".into(), rows: (0..rows).map(row).collect() }]).report;
    let Nominal { share, delay_s, .. } = &report.nominal;
    assert!((share.low..=share.high).contains(&0.0) && (delay_s.low..=delay_s.high).contains(&0.03), "{report:?}");
    assert!((report.order, delay_s.high <= 0.05 + 1e-9) == (1, true), "{report:?}");
}

/// A negative share whose interval contains 0 is 0 for controllers; any other stays.
#[test]
fn plant_file_has_no_negative_share_that_is_not_shown() {
    let shares = [0.0, -0.2].map(|share| {
        let mut lag = 0.0;
        let noise = normals(400);
        let row = |row: usize| {
            let voltage_v = 10.0 * ((row / 25 * 7) % 11) as f64;
            let measured = Some(share * voltage_v + (1.0 - share) * lag + 0.2 * noise[row]);
            lag = voltage_v + (lag - voltage_v) * f64::exp(-0.1);
            Row { line: 0, time_s: 0.05 * row as f64, voltage_v, measured }
        };
        let identified = found(&[Record { name: "share".into(), rows: (0..400).map(row).collect() }]);
        (identified.report.nominal.share.value, identified.plant.relaxation.share)
    });
    assert!(shares[0].1 == shares[0].0.max(0.0) && (shares[1].1 + 0.2).abs() < 0.02, "{shares:?}");
}

/// Each row in which no new reading came repeats the one before: half of them, by a linear congruential generator.
#[test]
fn readings_that_repeat_because_no_new_one_came_are_left_out() {
    let mut lossy = record(600, 3000, 0.0, 1.0);
    let (mut numbers, mut lost) = (Lcg32::new(1), 0);
    for row in 1..lossy.rows.len() {
        if numbers.draw() >> 31 == 1 {
            lossy.rows[row].measured = lossy.rows[row - 1].measured;
            lost += 1;
        }
    }
    let report = found(&[lossy]).report;
    assert_eq!((report.rows, report.order), (600 - lost, 1), "{report:?}");
    assert!(report.remarks[0].starts_with(&format!("{lost} readings repeat")), "{:?}", report.remarks);
    let Nominal { gain, share, delay_s, .. } = &report.nominal;
    assert!(gain.low < 0.5 && 0.5 < gain.high && share.low < 0.2 && 0.2 < share.high, "{report:?}");
    assert!(delay_s.value == 0.0 && (report.noise.sigma - 1.0).abs() < 0.1, "{report:?}");
}

/// A model of higher order would follow the step with a slow time constant of its own.
#[test]
fn a_shift_of_the_zero_is_fitted_with_the_model_and_spoils_nothing() {
    let clean = record(800, 3000, 0.0, 0.5);
    let expected = found(std::slice::from_ref(&clean)).report;
    assert!(expected.zero_shifts.is_empty());
    let near = |of: &Report| [of.nominal.gain.value / 0.5, of.nominal.tau_s[0].tau.value / 4.0];
    // In a stretch, and to the end.
    for (rows, edges) in [(257..431, vec![(257, 8.0), (431, -8.0)]), (311..800, vec![(311, 8.0)])] {
        let mut shifted = clean.clone();
        shifted.rows[rows].iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading + 8.0));
        let report = found(std::slice::from_ref(&shifted)).report;
        assert_eq!(report.order, expected.order, "{report:?}");
        assert!(near(&report).iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{:?}", near(&report));
        let by: Vec<f64> = report.zero_shifts.iter().map(|shift| shift.by).collect();
        assert_eq!(by.len(), edges.len(), "{:?}", report.zero_shifts);
        for ((row, size), shift) in edges.iter().zip(&report.zero_shifts) {
            assert!((shift.by - size).abs() < 1.0, "{shift:?}");
            assert!((shift.from_s - shifted.rows[*row].time_s).abs() < 1.0, "{shift:?}");
        }
        assert!(report.remarks[0].contains("are shifted by"), "{:?}", report.remarks);
        // Of all rows.
        assert!((report.rmse / expected.rmse - 1.0).abs() < 0.05, "{} {}", report.rmse, expected.rmse);
    }
}

/// Least squares would let a delay, a quick time constant or an oscillation follow such readings, and widen the intervals.
#[test]
fn readings_that_no_spring_made_are_left_out() {
    let clean = record(400, 1000, 0.0, 0.5);
    let width = |report: &Report| report.nominal.tau_s[0].tau.high / report.nominal.tau_s[0].tau.low;
    let expected = found(std::slice::from_ref(&clean)).report;
    for wrong in [vec![0], vec![1], vec![0, 1], vec![67, 150, 233, 234, 399]] {
        let mut record = clean.clone();
        wrong.iter().for_each(|&row| *record.rows[row].measured.as_mut().expect("a reading") += 90.0);
        let report = found(&[record]).report;
        let rows: Vec<usize> = report.left_out.iter().map(|far| (4.0 * far.time_s) as usize).collect();
        assert_eq!(rows, wrong);
        assert_eq!((report.order, report.rows), (expected.order, 400 - wrong.len()), "{wrong:?}");
        assert!(width(&report) < 1.1 * width(&expected), "{wrong:?}: {}", width(&report));
        assert!(report.remarks[0].contains("left out"), "{:?}", report.remarks);
    }
    assert!(expected.left_out.is_empty());
}

/// A quick lag leaves large errors of a static model only after steps, and a decay from an earlier voltage large ones at the start.
#[test]
fn readings_that_follow_the_voltage_or_a_start_are_kept() {
    let noise = normals(600);
    for (tau, decay) in [(0.6, 0.0), (3.0, 0.0), (40.0, 60.0), (2.0, 60.0), (1.0, 60.0)] {
        let (mut lag, mut free) = (0.0, decay);
        let row = |row: usize| {
            let voltage_v = 100.0 * (row / 25 % 3) as f64;
            let reading = 2.0 + lag + free + 0.1 * noise[row];
            let remains = f64::exp(-1.0 / tau);
            lag = voltage_v + (lag - voltage_v) * remains;
            free *= remains;
            Row { line: 0, time_s: row as f64, voltage_v, measured: Some(reading) }
        };
        let record = Record { name: "steps".into(), rows: (0..600).map(row).collect() };
        let report = found(&[record]).report;
        assert!(report.left_out.is_empty(), "{tau}: {:?}", report.left_out);
        assert!((report.nominal.tau_s[0].tau.value / tau - 1.0).abs() < 0.1, "{tau}: {:?}", report.nominal.tau_s);
    }
}

/// A reading that is taken just before a step instead of just after it, as at some steps here, leaves one large error, also where the
/// voltage is a measured one that differs from row to row.
#[test]
fn errors_at_steps_of_the_voltage_are_kept() {
    let noise = normals(1200);
    let mut lag = 0.0;
    let volts = |row: usize| 100.0 * (row / 25 % 3) as f64;
    let row = |row: usize| {
        let late = usize::from(row / 25 % 9 == 1 && row.is_multiple_of(25));
        let reading = 2.0 + 0.5 * (volts(row - late) + lag) + 0.05 * noise[row];
        lag = volts(row) + (lag - volts(row)) * f64::exp(-1.0 / 5.0);
        let voltage_v = volts(row) + 0.05 * noise[600 + row];
        Row { line: 0, time_s: row as f64, voltage_v, measured: Some(reading) }
    };
    let record = Record { name: "late".into(), rows: (0..600).map(row).collect() };
    let report = found(&[record]).report;
    assert!(report.left_out.is_empty(), "{:?}", report.left_out);
}

/// A spring that integrates the voltage has no static gain, and a time constant that no record tells has an open interval.
#[test]
fn an_integral_of_the_voltage_is_a_response_without_a_gain() {
    let (noise, steps) = (normals(800), normals(900).split_off(800));
    let mut sum = 0.0;
    let row = |row: usize| {
        let voltage_v = steps[row / 10].signum();
        sum += voltage_v;
        Row { line: 0, time_s: row as f64, voltage_v, measured: Some(0.1 * sum + 0.2 * noise[row]) }
    };
    let record = Record { name: "integral".into(), rows: (0..800).map(row).collect() };
    let report = found(&[record]).report;
    assert!(report.remarks.iter().any(|remark| remark.contains("integrates the voltage")), "{:?}", report.remarks);
    for lag in &report.nominal.tau_s {
        let known = lag.tau.high < 1e6 * lag.tau.value && lag.tau.low > 1e-6 * lag.tau.value;
        assert!(known || (lag.tau.low, lag.tau.high) == (0.0, f64::INFINITY), "{:?}", lag.tau);
    }
}

/// Two lags in series behind a law that saturates: no order is right, and each held-out error counts.
#[test]
fn order_of_a_spring_that_is_not_linear_has_the_least_held_out_error() {
    let mut record = record(1200, 0, 0.0, 0.0);
    let (mut lag, noise) = (0.0, normals(1200));
    for (row, noise) in record.rows.iter_mut().zip(noise) {
        lag += (row.measured.unwrap() - lag) * 0.1;
        row.measured = Some((0.05 * (lag - 50.0)).tanh() + 0.002 * noise);
    }
    let Report { held_out_rmse, linear, last_40_percent_rmse, .. } = found(&[record]).report;
    let holds = |of: &&LinearError| of.last_40_percent_rmse < MOST_SPOILED * last_40_percent_rmse;
    let least = linear.iter().filter(holds).map(|of| of.held_out_rmse).fold(f64::INFINITY, f64::min);
    assert!(held_out_rmse <= least / (1.0 - WORTHWHILE), "{held_out_rmse} {linear:?}");
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
    let voltages =
        |of: fn(f64, f64) -> f64, start| record(800, 0, 0.0, 0.01).rows.iter().map(|row| row.voltage_v).fold(start, of);
    let (lowest_v, highest_v) = (voltages(f64::min, f64::INFINITY), voltages(f64::max, f64::NEG_INFINITY));
    assert_eq!(plant.range, Some(Range { lowest_v, highest_v }));
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

/// A record of a spring that follows a function of the voltage with a share and a time constant, by its exact recursion; the rows
/// are 1/16 of the time constant apart.
fn of_law(law: impl Fn(f64) -> f64, both_signs: bool, share: f64, tau_s: f64) -> Record {
    let (steps, noise) = (normals(1000), normals(2000).split_off(1000));
    let sign = |row: usize| if both_signs && row / 30 % 2 == 1 { -1.0 } else { 1.0 };
    let mut lag = 0.0;
    let row = |row: usize| {
        let voltage_v = sign(row) * (100.0 + 30.0 * steps[row / 20]).max(0.0);
        let settled = law(voltage_v);
        let reading = 3.0 + 0.5 * (share * settled + (1.0 - share) * lag) + 0.02 * noise[row];
        lag = settled + (lag - settled) * f64::exp(-1.0 / 16.0);
        Row { line: 0, time_s: tau_s / 16.0 * row as f64, voltage_v, measured: Some(reading) }
    };
    Record { name: "spring".into(), rows: (0..1000).map(row).collect() }
}

/// The gain is that at the largest voltage, 1/100 of it for `v^2 / 100`, and the file's law is the square.
#[test]
fn square_law_is_recognised_for_one_sign_and_for_both() {
    for both_signs in [false, true] {
        let record = of_law(|voltage| voltage * voltage / 100.0, both_signs, 0.2, 4.0);
        let full_scale = record.rows.iter().map(|row| row.voltage_v.abs()).fold(0.0, f64::max);
        let Identified { report, plant, .. } = found(std::slice::from_ref(&record));
        let Nominal { gain, share, tau_s, .. } = &report.nominal;
        assert_eq!((report.input_law, plant.even), (InputLaw::Square, both_signs), "{report:#?}");
        let expected = 0.5 * full_scale / 100.0;
        assert!(gain.low < expected && expected < gain.high && gain.high - gain.low < 0.01 * expected, "{gain:?}");
        assert!((share.value - 0.2).abs() < 0.01 && (tau_s[0].tau.value - 4.0).abs() < 0.1, "{report:#?}");
        plant.check_for_host().unwrap();
        let law = plant.law.as_ref().expect("a law");
        let at_half = law.voltage_v.iter().position(|voltage| (voltage - 0.5 * full_scale).abs() < 1e-9).unwrap();
        assert!((law.stiffness[at_half] - 0.25 * full_scale).abs() < 1e-9);
    }
}

/// A linear spring, and one whose gain falls by a third, are not taken for a square law.
#[test]
fn other_laws_of_one_sign_stay_linear() {
    for law in [|voltage: f64| voltage, |voltage: f64| voltage * (1.0 - voltage / 600.0)] {
        assert_eq!(found(&[of_law(law, false, 0.2, 4.0)]).report.input_law, InputLaw::Linear);
    }
}

/// A washout, whose response vanishes: relative to a gain of 0 every share has an interval that contains 0 and 1. The noise is 0.2.
#[test]
fn plant_file_simulates_a_response_that_does_not_settle_at_the_voltage() {
    let (mut lag, noise) = (0.0, normals(600));
    let row = |row: usize| {
        let voltage_v = 10.0 * ((row / 25 * 7) % 11) as f64;
        let measured = Some(voltage_v - lag + 0.2 * noise[row]);
        lag = voltage_v + (lag - voltage_v) * f64::exp(-0.1);
        Row { line: 0, time_s: 0.05 * row as f64, voltage_v, measured }
    };
    let record = Record { name: "washout".into(), rows: (0..600).map(row).collect() };
    let Identified { report, plant, .. } = found(std::slice::from_ref(&record));
    let Nominal { gain, share, .. } = &report.nominal;
    assert!(gain.low < 0.0 && 0.0 < gain.high && share.low < 0.0 && 1.0 < share.high, "{:#?}", report.nominal);
    let options = Options { base: Base::new(plant).unwrap(), ..Options::default() };
    let diagnosis = diagnose(&record, &options).unwrap();
    assert!(diagnosis.baseline.rmse < 0.22, "{:?}", diagnosis.baseline);
}

/// Springs whose first response goes the other way, or beyond the settled one. The noise is 0.02.
#[test]
fn plant_file_simulates_a_share_outside_of_0_to_1() {
    for share in [-0.4, 1.6] {
        let record = of_law(|voltage| voltage, true, share, 4.0);
        let Identified { report, plant, .. } = found(std::slice::from_ref(&record));
        assert!((report.nominal.share.value - share).abs() < 0.02, "{:#?}", report.nominal);
        let options = Options { base: Base::new(plant).unwrap(), ..Options::default() };
        let diagnosis = diagnose(&record, &options).unwrap();
        assert_eq!(diagnosis.verdict, Verdict::Consistent, "{share}: {:?}", diagnosis.baseline);
        assert!(diagnosis.baseline.rmse < 0.022, "{share}: {:?}", diagnosis.baseline);
    }
}

/// Static, mixed and purely delayed springs, of microseconds to days, that follow voltage, magnitude or square.
#[test]
fn any_share_any_time_constant_and_any_law_are_identified() {
    for law in [InputLaw::Linear, InputLaw::Even, InputLaw::Square] {
        let of_voltage = move |voltage: f64| match law {
            InputLaw::Linear => voltage,
            InputLaw::Even => voltage.abs(),
            InputLaw::Square => voltage * voltage / 100.0,
        };
        for share in [0.0, 0.3, 0.8, 1.0] {
            for tau_s in [1e-6, 5.5, 3.0 * 86400.0] {
                let Identified { report, plant, .. } = found(&[of_law(of_voltage, true, share, tau_s)]);
                let context = format!("{law:?}, share {share}, {tau_s} s: {:#?}", report.nominal);
                assert_eq!((report.input_law, plant.even), (law, law != InputLaw::Linear), "{context}");
                let Nominal { share: found, tau_s: lags, .. } = &report.nominal;
                assert!((found.value - share).abs() < 0.01, "{context}");
                assert_eq!(lags.len(), usize::from(share < 1.0), "{context}");
                assert!(lags.iter().all(|lag| (lag.tau.value / tau_s - 1.0).abs() < 0.03), "{context}");
                plant.check_for_host().unwrap();
            }
        }
    }
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

/// An oscillator whose spring hardens with `cubic`, under a multisine that grows, by classical Runge-Kutta steps.
fn hardening(cubic: f64, phase: f64) -> Record {
    const SUBSTEPS: usize = 8;
    let (rows, interval) = (2000, 1.0 / 610.0);
    let (omega, step) = (TAU * 69.0, interval / SUBSTEPS as f64);
    let mut state = [0.0_f64; 2];
    let mut row = |row: usize| {
        let time_s = row as f64 * interval;
        let wave = |line: usize| f64::cos(TAU * (5 + 3 * line) as f64 * time_s + phase * (line * line) as f64);
        let voltage_v = 0.5 * row as f64 / rows as f64 * (0..65).map(wave).sum::<f64>() / 32.5_f64.sqrt();
        let measured = Some(state[0] + 0.006 * (((row * 7919) % 101) as f64 / 101.0 - 0.5));
        let rate = |[x, v]: [f64; 2]| [v, omega * omega * (voltage_v - x - cubic * x.powi(3)) - 0.1 * omega * v];
        for _ in 0..SUBSTEPS {
            let along = |rate: [f64; 2], by: f64| [state[0] + by * rate[0], state[1] + by * rate[1]];
            let first = rate(state);
            let second = rate(along(first, 0.5 * step));
            let third = rate(along(second, 0.5 * step));
            let fourth = rate(along(third, step));
            state = [0, 1].map(|of| state[of] + step / 6.0 * (first[of] + 2.0 * (second[of] + third[of]) + fourth[of]));
        }
        Row { line: 0, time_s, voltage_v, measured }
    };
    Record { name: "oscillator".into(), rows: (0..rows).map(&mut row).collect() }
}

/// The largest half waves of what the linear model leaves are no shifts of the zero.
#[test]
fn half_waves_of_an_oscillation_are_no_shifts() {
    for (cubic, phase) in [(0.03, 3.1), (0.1, 5.3)] {
        let report = found(&[hardening(cubic, phase)]).report;
        assert_eq!(report.oscillation.len(), 1);
        assert!(report.zero_shifts.is_empty(), "{cubic}: {:?}", report.zero_shifts);
    }
    let mut shifted = hardening(0.03, 5.3);
    shifted.rows[700..900].iter_mut().for_each(|row| row.measured = row.measured.map(|reading| reading + 0.5));
    let by: Vec<f64> = found(&[shifted]).report.zero_shifts.iter().map(|shift| shift.by).collect();
    assert!(by.len() == 2 && by.iter().all(|by| (by.abs() - 0.5).abs() < 0.02), "{by:?}");
}

/// A square-root law under steps of one period of a sine, after a rest: no linear model describes it, and free responses would follow
/// the law.
#[test]
fn readings_at_rest_tell_that_a_nonlinear_spring_starts_at_rest() {
    let noise = normals(1000);
    let decay = f64::exp(-1.0 / 12.0);
    let mut lag = 0.0;
    let row = |row: usize| {
        let phase = TAU * row.saturating_sub(40) as f64 / 960.0;
        let voltage_v = (10.0 * phase.sin()).round() / 10.0;
        let measured = Some(10.0 * lag + 0.02 * noise[row]);
        let law = voltage_v.signum() * voltage_v.abs().sqrt();
        lag = law + (lag - law) * decay;
        Row { line: 0, time_s: 0.1 * row as f64, voltage_v, measured }
    };
    let identified = found(&[Record { name: "root".into(), rows: (0..1000).map(row).collect() }]);
    let start = &identified.report.start[0];
    assert!(identified.settled && start.offset.value == 0.0, "{start:?}");
}
