//! Whether a record can be identified at all: enough readings, a voltage and readings that change.

use anyhow::Result;

use simulation::bad_input;
use simulation::record::Record;

/// Fewest readings of a record.
const FEWEST_READINGS: usize = 8;

/// Refuses a record with too few readings, or whose voltage or reading never changes.
pub(super) fn check(record: &Record) -> Result<()> {
    let readings = || record.rows.iter().filter_map(|row| row.measured);
    if readings().count() < FEWEST_READINGS {
        bad_input!(
            "{}: {} row(s) with a reading; expected at least {FEWEST_READINGS}",
            record.name,
            readings().count()
        );
    }
    let first = record.rows[0].voltage_v;
    if record.rows.iter().all(|row| row.voltage_v == first) {
        bad_input!("{}: the voltage never changes; expected a record in which it does", record.name);
    }
    let first = readings().next();
    if readings().all(|reading| Some(reading) == first) {
        bad_input!("{}: the reading never changes; expected a record in which it does", record.name);
    }
    Ok(())
}
