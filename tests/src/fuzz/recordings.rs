//! Recordings of telemetry.

use host_sim::output::recording::{Every, Recording};
use link::{Status, Telemetry, WireVolts};
use simulation::record::{MEASURED, Record};

/// Bytes of a sample: 2 for the ticks since the one before, 4 for the voltage, 4 for the reading, 1 for whether there is one.
const SAMPLE: usize = 11;

/// A recording of any samples: the file is a record with the rows that are counted, however it ends.
pub(super) fn recording(bytes: &[u8]) {
    let Some((&[rate, sample_ticks, rows], samples)) = bytes.split_first_chunk() else { return };
    let folder = tempfile::tempdir().expect("there is room");
    let path = folder.path().join("r.csv");
    let measured = Telemetry { measured: Some(WireVolts(0)), ..Telemetry::default() };
    let status = Status { rate_hz: 1 << (rate % 16), sample: measured, ..Status::default() };
    let every = Every::new(u16::from(rows) + 1, u16::from(sample_ticks));
    assert!(every.row_ticks.is_multiple_of(every.sample_ticks), "{every:?}");
    let mut recording = Recording::new(&path, false, &status, every).expect("the folder is empty");
    let (mut tick, mut last_row) = (1 << 40u64, None);
    for sample in samples.chunks_exact(SAMPLE) {
        let number =
            |from: usize| i32::from_le_bytes([sample[from], sample[from + 1], sample[from + 2], sample[from + 3]]);
        // Now and then an earlier sample arrives again, or the MCU restarts.
        let ahead = i64::from(u16::from_le_bytes([sample[0], sample[1]])) - 0x100;
        tick = u64::saturating_add_signed(tick, ahead);
        let measured = (sample[10] % 4 > 0).then_some(WireVolts(number(6)));
        let telemetry = Telemetry { tick, applied: WireVolts(number(2)), measured, ..Telemetry::default() };
        if recording.add(&telemetry).is_err() {
            break;
        }
        last_row = Some(telemetry);
    }
    let summary = recording.summary();
    assert_eq!(summary.rows > 0, last_row.is_some(), "the first sample is a row");
    assert!(summary.missed_turns <= summary.turns, "{summary:?}");
    if summary.rows >= 2 {
        let record = Record::open(&path, MEASURED).expect("a recording is a record");
        assert_eq!(record.rows.len() as u64, summary.rows, "rows that are not counted");
        let missing = record.rows.iter().filter(|row| row.measured.is_none()).count();
        assert_eq!(missing as u64, summary.without_reading);
    }
}
