//! Tables: measured records and schedules.

use std::fmt::Write;

use record_files::{Container, read};
use simulation::csv_table::text::Source;
use simulation::record::{Format, MEASURED, MeasuredRecord, Record};
use simulation::schedule::{Between, Schedule};

use super::check_error;

/// A measured record: what is accepted has increasing finite times, and reads the same after it was written.
pub(super) fn csv(bytes: &[u8]) {
    for sort in [false, true] {
        let format = Format { sort, ..Format::default() };
        match format.read(Source::new("file", bytes)) {
            Ok(measured) => check_record(&measured),
            Err(error) => check_error(&error, "file"),
        }
    }
}

/// A measured record as MCAP: what holds for a table of text.
pub(super) fn mcap(bytes: &[u8]) {
    container(Container::Mcap, bytes);
}

/// A measured record as Parquet: what holds for a table of text.
pub(super) fn parquet(bytes: &[u8]) {
    container(Container::Parquet, bytes);
}

fn container(container: Container, bytes: &[u8]) {
    match read("file", container, bytes.to_vec(), &Format::default(), None) {
        Ok(measured) => check_record(&measured),
        Err(error) => check_error(&error, "file"),
    }
}

fn check_record(MeasuredRecord { record, .. }: &MeasuredRecord) {
    let rows = &record.rows;
    assert!(rows.len() >= 2, "{} rows", rows.len());
    assert!(rows.windows(2).all(|pair| pair[0].time_s < pair[1].time_s), "times do not increase");
    let numbers = rows.iter().flat_map(|row| [row.time_s, row.voltage_v, row.measured.unwrap_or(0.0)]);
    assert!(numbers.into_iter().all(f64::is_finite), "a number is not finite");
    let mut text = "time_s,voltage_v,stiffness\n".to_owned();
    for row in rows {
        let reading = row.measured.map_or("-".to_owned(), |reading| format!("{reading:e}"));
        let _ = writeln!(text, "{:e},{:e},{reading}", row.time_s, row.voltage_v);
    }
    // A command in another unit may be larger than any voltage.
    if rows.iter().all(|row| row.voltage_v.abs() <= 1e6) {
        let again = Record::parse("again", &text, MEASURED).expect("an accepted record is accepted again");
        let values = |record: &Record| -> Vec<_> {
            record.rows.iter().map(|row| (row.time_s, row.voltage_v, row.measured)).collect()
        };
        assert_eq!(values(&again), values(record), "the record changes when it is written and read");
    }
}

/// A schedule: within its time, the voltage stays between its lowest and highest row.
pub(super) fn schedule(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let record = match Record::parse("file", &text, MEASURED) {
        Ok(record) => record,
        Err(error) => return check_error(&error, "file"),
    };
    let voltages = || record.rows.iter().map(|row| row.voltage_v);
    let (lowest, highest) = (voltages().fold(f64::MAX, f64::min), voltages().fold(f64::MIN, f64::max));
    let rounding = 1e-9 * (highest.abs() + lowest.abs());
    for between in [Between::Hold, Between::Linear] {
        let schedule = Schedule::from_record(&record, between);
        let (start_s, end_s) = (schedule.start_s(), schedule.end_s());
        assert!(start_s <= end_s, "{start_s} s to {end_s} s");
        let mut reader = schedule.reader();
        for step in 0..=64 {
            let part = f64::from(step) / 64.0;
            let volts = reader.at(start_s * (1.0 - part) + end_s * part);
            let is_between = volts >= lowest - rounding && volts <= highest + rounding;
            assert!(is_between, "{volts} V at {part} of the time, with rows from {lowest} V to {highest} V");
        }
        let _ = schedule.changes();
    }
}
