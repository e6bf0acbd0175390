//! A sensor's readings as the equivalent static voltage, in which the bank compares them with the model.

use anyhow::Result;

use crate::bad_input;
use crate::plant_file::PlantFile;
use crate::record::{MeasuredRecord, Record, Row};
use crate::units::Units;

/// Converts the readings of a record to the equivalent static voltage, in V, with the gain and zero of a plant file's `[reading]`.
///
/// # Errors
/// [`crate::BadInput`] for readings or commands in another unit than those of the plant file, by default V.
pub fn equivalent(measured: MeasuredRecord, plant: &PlantFile) -> Result<Record> {
    let MeasuredRecord { record: Record { name, rows }, units: Units { voltage, reading, .. }, .. } = measured;
    let names = plant.units.clone().unwrap_or_default();
    if !voltage.is_voltage() && names.other_command() != Some(&voltage.name) {
        let expected = names.other_command().unwrap_or("V");
        bad_input!("{name}: commands in {}; expected {expected}, as the nominal spring's", voltage.name);
    }
    // Without a name, the gain is that of any unit.
    let expected = names.reading.or_else(|| plant.reading.is_none().then(|| "V".to_owned()));
    if let Some(expected) = expected.filter(|expected| *expected != reading) {
        bad_input!(
            "{name}: readings in {reading}; expected {expected}, as the nominal spring's, or --column for a stiffness as the \
             equivalent static voltage"
        );
    }
    let map = plant.reading.unwrap_or_default();
    let equivalent_v = |row: Row| Row { measured: row.measured.map(|reading| (reading - map.zero) / map.gain), ..row };
    Ok(Record { name, rows: rows.into_iter().map(equivalent_v).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csv_table::text::Source;
    use crate::plant_file::parse;
    use crate::record::{ColumnNames, Format};

    const SPRING: &str = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n";

    fn converted(header: &str, tables: &str) -> Result<Vec<(f64, Option<f64>)>, String> {
        let text = format!("{header}\n0,0,0.5\n1,0.1,-\n2,0.2,4.5\n");
        let voltage = header.contains("input").then(|| "input".to_owned());
        let columns = ColumnNames { voltage, ..ColumnNames::default() };
        let measured = Format { columns, ..Format::default() }.read(Source::new("r", text)).unwrap();
        let plant = parse("p", &format!("{SPRING}{tables}")).unwrap();
        let record = equivalent(measured, &plant).map_err(|error| error.to_string())?;
        Ok(record.rows.iter().map(|row| (row.voltage_v, row.measured)).collect())
    }

    #[test]
    fn readings_are_converted_with_gain_and_zero_of_the_plant_file() {
        let map = "[reading]\ngain = 0.02\nzero = 0.5\n";
        let of_mm = format!("[units]\nreading = \"mm\"\n{map}");
        let expected = Ok(vec![(0.0, Some(0.0)), (100.0, None), (200.0, Some(200.0))]);
        assert_eq!(converted("t_ms,u_kV,x_mm", &of_mm), expected);
        assert_eq!(converted("t_ms,u_kV,x_N", map), expected, "a gain without unit");
        let plain = Ok(vec![(0.0, Some(0.5)), (0.1, None), (0.2, Some(4.5))]);
        assert_eq!(converted("time_s,voltage_v,stiffness", ""), plain);
        assert_eq!(
            converted("t_ms,u_kV,x_mm", "").unwrap_err(),
            "r: readings in mm; expected V, as the nominal spring's, or --column for a stiffness as the equivalent static voltage"
        );
        assert!(converted("t_ms,u_kV,x_N", &of_mm).unwrap_err().starts_with("r: readings in N; expected mm,"));
    }

    #[test]
    fn a_command_that_is_no_voltage_is_that_of_the_plant_file() {
        let header = "time_s,input [%],stiffness";
        assert_eq!(converted(header, "").unwrap_err(), "r: commands in %; expected V, as the nominal spring's");
        let of_percent = "[units]\nvoltage = \"%\"\n";
        assert!(converted(header, of_percent).is_ok());
        let error = converted("time_s,input [mA],stiffness", of_percent).unwrap_err();
        assert_eq!(error, "r: commands in mA; expected %, as the nominal spring's");
    }
}
