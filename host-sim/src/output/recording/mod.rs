//! Telemetry as CSV, MCAP or Parquet with the columns `time_s,voltage_v,stiffness`, which a [`simulation::record::Record`] is
//! read from; without a sensor the last one is `estimate`, which no diagnosis takes for a measurement.
//!
//! Rows follow each other at a fixed number of ticks. Between them stand the samples at which the voltage turns, up to down or
//! down to up, so that no extreme value is lost.
//!
//! However a recording ends, by Ctrl-C, a lost connection or a full disk, its rows can be read.

mod sink;
mod turns;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use link::{Status, Telemetry};
use serde::Serialize;

use simulation::record::{ESTIMATE, MEASURED};

use sink::Sink;
pub use turns::Every;
use turns::{Turn, Turns};

/// A recording in progress.
pub struct Recording {
    path: PathBuf,
    sink: Sink,
    rate_hz: f64,
    /// Ticks between two samples that the MCU sends.
    sample_ticks: u64,
    /// Ticks between two rows.
    row_ticks: u64,
    measured: bool,
    first_tick: Option<u64>,
    last_row: u64,
    /// The last sample that arrived.
    last: Option<Telemetry>,
    turns: Turns,
    summary: Summary,
}

/// Totals of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Number of rows.
    pub rows: u64,
    /// Time from the first row to the last, in s.
    pub seconds: f64,
    /// Number of samples that did not arrive: damaged, or not sent because the line was busy.
    pub lost: u64,
    /// Number of rows with `-`, for which the sensor gave no reading.
    pub without_reading: u64,
    /// Number of rows at which the voltage turns, up to down or down to up.
    pub turns: u64,
    /// Number of turns whose extreme value may be among the lost samples.
    pub missed_turns: u64,
    /// `measured` if the MCU has a sensor, otherwise the controller's `estimate`.
    pub stiffness: &'static str,
    /// Where samples are missing, the first [`MOST_GAPS`] of such places.
    pub gaps: Vec<Gap>,
}

/// Missing samples between two that arrived.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gap {
    /// Time of the last sample before them, in s.
    pub after_s: f64,
    /// Number of samples that are missing.
    pub samples: u64,
}

/// Largest number of gaps that are listed.
pub const MOST_GAPS: usize = 1000;
/// Largest number of gaps in a remark.
const SHOWN_GAPS: usize = 5;

impl Summary {
    /// What a user has to know of the recording in `file` before it is diagnosed.
    pub fn remarks(&self, file: &str) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.stiffness == "estimate" {
            let text =
                "no sensor: the column estimate is the controller's own, not a measurement; it cannot be diagnosed";
            remarks.push(text.to_owned());
        }
        if self.lost > 0 {
            let shown: Vec<String> = self
                .gaps
                .iter()
                .take(SHOWN_GAPS)
                .map(|gap| format!("{} after {} s", gap.samples, gap.after_s))
                .collect();
            let listed: u64 = self.gaps.iter().take(SHOWN_GAPS).map(|gap| gap.samples).sum();
            let rest = match self.lost - listed {
                0 => String::new(),
                rest => format!(", {rest} later"),
            };
            remarks.push(format!("{file}: {} samples are missing: {}{rest}", self.lost, shown.join(", ")));
        }
        if self.missed_turns > 0 {
            remarks.push(format!(
                "{file}: samples are missing at {} of {} turns of the voltage: its extreme values there are not in the record",
                self.missed_turns, self.turns
            ));
        }
        remarks
    }
}

impl Recording {
    /// Creates the file, CSV unless its extension is `.mcap` or `.parquet`. An existing one is kept unless `replace`, since a
    /// measurement cannot be repeated.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if the file exists or cannot be created.
    pub fn new(path: &Path, replace: bool, status: &Status, every: Every) -> Result<Self> {
        let measured = status.sample.measured.is_some();
        let stiffness = if measured { "measured" } else { "estimate" };
        let (origin, column) = if measured {
            ("as measured by the sensor", MEASURED)
        } else {
            ("as estimated by the controller, without a sensor: no measurement", ESTIMATE)
        };
        let rate = status.rate_hz;
        let source = format!(
            "recorded over the serial link, control at {rate} Hz; voltage_v across the spring; stiffness {origin}"
        );
        Ok(Self {
            path: path.to_owned(),
            sink: Sink::create(path, replace, column, &source)?,
            rate_hz: f64::from(status.rate_hz.max(1)),
            sample_ticks: u64::from(every.sample_ticks.max(1)),
            row_ticks: u64::from(every.row_ticks.max(1)),
            measured,
            first_tick: None,
            last_row: 0,
            last: None,
            turns: Turns::default(),
            summary: Summary { stiffness, ..Summary::default() },
        })
    }

    /// Adds a sample; one that is not newer than the last is ignored.
    ///
    /// # Errors
    /// If the file cannot be written, or the MCU has restarted.
    pub fn add(&mut self, sample: &Telemetry) -> Result<()> {
        let first = *self.first_tick.get_or_insert(sample.tick);
        if sample.tick < first {
            bail!("the MCU restarted after {} rows; {} ends there", self.summary.rows, self.path.display());
        }
        if let Some(last) = self.last {
            if sample.tick <= last.tick {
                return Ok(());
            }
            // Up to half a period is jitter, not a loss.
            let lost = ((sample.tick - last.tick + self.sample_ticks / 2) / self.sample_ticks).saturating_sub(1);
            self.summary.lost += lost;
            if lost > 0 && self.summary.gaps.len() < MOST_GAPS {
                let after_s = self.time_s(last.tick - first);
                self.summary.gaps.push(Gap { after_s, samples: lost });
            }
            if let Some(Turn { has_gap }) = self.turns.next(last.applied, sample.applied, lost > 0) {
                self.summary.turns += 1;
                self.summary.missed_turns += u64::from(has_gap);
                if last.tick > self.last_row {
                    self.row(&last, first)?;
                }
            }
        }
        self.last = Some(*sample);
        let period = |tick: u64| (tick - first) / self.row_ticks;
        if self.summary.rows == 0 || period(sample.tick) > period(self.last_row) {
            self.row(sample, first)?;
        }
        Ok(())
    }

    fn row(&mut self, sample: &Telemetry, first: u64) -> Result<()> {
        let stiffness = if self.measured { sample.measured } else { Some(sample.estimate) };
        self.summary.without_reading += u64::from(stiffness.is_none());
        let time = self.time_s(sample.tick - first);
        self.sink.row(time, sample.applied.to_f64(), stiffness.map(|stiffness| stiffness.to_f64()))?;
        self.last_row = sample.tick;
        self.summary.rows += 1;
        self.summary.seconds = time;
        Ok(())
    }

    /// Time of a number of ticks, in s, to nine decimals, which hide floating-point errors of decimal times.
    fn time_s(&self, ticks: u64) -> f64 {
        (ticks as f64 / self.rate_hz * 1e9).round() / 1e9
    }

    /// Totals so far.
    pub fn summary(&self) -> &Summary {
        &self.summary
    }

    /// Writes the end of the file, without which a Parquet file does not exist; the rows end here.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(&mut self) -> Result<()> {
        self.sink.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::WireVolts;
    use simulation::record::Record;

    const TEN: Every = Every { sample_ticks: 10, row_ticks: 10 };

    fn status(measured: bool) -> Status {
        let sample = Telemetry { measured: measured.then_some(WireVolts(0)), ..Telemetry::default() };
        Status { rate_hz: 1000, sample, ..Status::default() }
    }

    fn sample(tick: u64) -> Telemetry {
        let volts = |v: i32| WireVolts(v << 20);
        Telemetry { tick, applied: volts(100), estimate: volts(9), measured: Some(volts(8)), ..Telemetry::default() }
    }

    fn start(folder: &Path, measured: bool) -> (PathBuf, Recording) {
        let path = folder.join("r.csv");
        let recording = Recording::new(&path, false, &status(measured), TEN).unwrap();
        (path, recording)
    }

    #[test]
    fn rows_are_readable_at_once_without_repeats_and_losses_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let (path, mut recording) = start(folder.path(), true);
        for tick in [5000, 5010, 5010, 5000, 5050, 5061] {
            recording.add(&sample(tick)).unwrap();
        }
        recording.add(&Telemetry { measured: None, ..sample(5070) }).unwrap();
        let read = Record::open(&path, MEASURED).unwrap();
        let times: Vec<f64> = read.rows.iter().map(|row| row.time_s).collect();
        assert_eq!(times, [0.0, 0.01, 0.05, 0.061, 0.07]);
        assert_eq!((read.rows[1].voltage_v, read.rows[1].measured), (100.0, Some(8.0)));
        // The voltage acts on the spring whether or not the sensor reads.
        assert_eq!((read.rows[4].voltage_v, read.rows[4].measured), (100.0, None));
        let Summary { rows, lost, without_reading, .. } = recording.summary();
        assert_eq!((*rows, *lost, *without_reading), (5, 3, 1));
        assert_eq!(recording.summary().gaps, [Gap { after_s: 0.01, samples: 3 }]);
        assert_eq!(recording.summary().remarks("r.csv"), ["r.csv: 3 samples are missing: 3 after 0.01 s"]);
    }

    #[test]
    fn without_a_sensor_the_file_states_that_it_holds_estimates() {
        let folder = tempfile::tempdir().unwrap();
        let (path, mut recording) = start(folder.path(), false);
        recording.add(&sample(1)).unwrap();
        recording.add(&sample(11)).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().contains("no measurement"));
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("\ntime_s,voltage_v,estimate\n") && text.ends_with(",9.000000\n"), "{text}");
        assert_eq!(Record::open(&path, MEASURED).unwrap().rows[0].measured, None);
    }

    #[test]
    fn rows_at_a_fixed_rate_contain_every_turn_of_the_voltage() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.csv");
        let mut recording =
            Recording::new(&path, false, &status(true), Every { sample_ticks: 1, row_ticks: 10 }).unwrap();
        for tick in (0..=40).filter(|tick| *tick != 35) {
            let volts = match tick {
                0..=13 => tick,
                14..=27 => 26 - tick,
                _ => tick - 28,
            };
            recording.add(&Telemetry { applied: WireVolts(volts << 20), ..sample(tick as u64) }).unwrap();
        }
        let read = Record::open(&path, MEASURED).unwrap();
        let times: Vec<i64> = read.rows.iter().map(|row| (row.time_s * 1e3).round() as i64).collect();
        assert_eq!(times, [0, 10, 13, 20, 27, 30, 40]);
        let Summary { rows, lost, turns, missed_turns, .. } = recording.summary();
        assert_eq!((*rows, *lost, *turns, *missed_turns), (7, 1, 2, 0));
    }

    #[test]
    fn a_turn_next_to_lost_samples_is_counted_as_missed() {
        let folder = tempfile::tempdir().unwrap();
        let (_, mut recording) = start(folder.path(), true);
        for (tick, volts) in [(0, 1), (10, 2), (40, 2), (50, 1), (60, 2), (100, 1)] {
            recording.add(&Telemetry { applied: WireVolts(volts << 20), ..sample(tick) }).unwrap();
        }
        let Summary { turns, missed_turns, .. } = recording.summary();
        assert_eq!((*turns, *missed_turns), (3, 2));
    }

    #[test]
    fn a_restart_of_the_mcu_ends_the_recording_and_keeps_its_rows() {
        let folder = tempfile::tempdir().unwrap();
        let (path, mut recording) = start(folder.path(), true);
        recording.add(&sample(500)).unwrap();
        recording.add(&sample(510)).unwrap();
        assert!(recording.add(&sample(3)).unwrap_err().to_string().contains("restarted after 2 rows"));
        assert_eq!(Record::open(&path, MEASURED).unwrap().rows.len(), 2);
    }

    #[test]
    fn a_file_that_exists_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (path, _) = start(folder.path(), true);
        let error = Recording::new(&path, false, &status(true), TEN).err().unwrap();
        assert!(error.is::<simulation::bad_input::BadInput>() && error.to_string().contains("--force"), "{error}");
        Recording::new(&path, true, &status(true), TEN).unwrap();
    }

    /// A device that is always full stands for a full disk.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_reported() {
        let error = Recording::new(Path::new("/dev/full"), true, &status(true), TEN).err().unwrap();
        assert!(error.to_string().contains("/dev/full cannot be written"), "{error}");
    }
}
