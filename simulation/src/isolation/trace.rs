//! The fixed-point bank over a record: the model runs on the voltages of the record, which are held between its rows, and the
//! readings of its rows are the sensor's.

use std::fmt::{self, Display, Formatter};

use anyhow::Result;
use model::estimator::Estimator;
use model::isolation::{Cause, Finding, Report, Settings, State, Verdict, bank};
use model::{SampleTime, ScaledStiffness, Validate, Volts};
use serde::Serialize;

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::record::Record;

/// A change of the bank's verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Event {
    /// Time in the record, in s.
    pub time_s: f64,
    /// `quiet`, `alarm`, `named`, `ambiguous` or `unknown`.
    pub verdict: &'static str,
    /// Code of the cause that explains most; `None` unless named or ambiguous.
    pub cause: Option<&'static str>,
    /// Code of the other cause if the verdict is ambiguous.
    pub other: Option<&'static str>,
    /// Beginning of the fault: time of the last restart of the sums, in s.
    pub since_s: Option<f64>,
    /// Size of the cause with its 95 % interval.
    pub size: Option<Size>,
    /// Part of the residual's energy, its noise included, that the cause explains, 0 to 1.
    pub explained: Option<f64>,
}

/// Verdict, cause, size, part of the energy, beginning.
impl Display for Event {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.verdict)?;
        match (self.cause, self.other) {
            (Some(cause), Some(other)) => write!(f, " {cause} or {other}")?,
            (Some(cause), None) => write!(f, " {cause}")?,
            _ => {}
        }
        if let Some(size) = self.size {
            let unit = if size.unit.is_empty() { String::new() } else { format!(" {}", size.unit) };
            write!(f, ", size {:.4}{unit} ({:.4} to {:.4})", size.value, size.low, size.high)?;
        }
        if let Some(explained) = self.explained {
            write!(f, ", explains {:.2} %", 100.0 * explained)?;
        }
        if let Some(since_s) = self.since_s {
            write!(f, ", since {since_s:.2} s")?;
        }
        Ok(())
    }
}

impl Event {
    /// The verdict of `report` at `time_s`, in s, by a bank with these settings and `rate_hz` ticks per second.
    pub fn new(report: &Report, time_s: f64, settings: &Settings, rate_hz: f64) -> Self {
        let finding = report.finding(settings, rate_hz);
        let size = |Finding { cause, size, half_width, .. }| Size::around(size, half_width, cause);
        Self {
            time_s,
            verdict: report.verdict.name(),
            cause: finding.map(|finding| finding.cause.name()),
            other: finding.and_then(|finding| finding.other).map(Cause::name),
            since_s: (report.verdict != Verdict::Quiet)
                .then(|| time_s - f64::from(report.since_blocks) * bank::block_s(rate_hz)),
            size: finding.map(size),
            explained: finding.map(|finding| finding.explained),
        }
    }
}

/// A size with its 95 % interval, that of [`Finding::half_width`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Size {
    /// The size.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit; empty for a ratio.
    pub unit: &'static str,
}

impl Size {
    /// The size `value` of a cause, with half of the width of its interval.
    pub fn around(value: f64, half_width: f64, cause: Cause) -> Self {
        Self { value, low: value - half_width, high: value + half_width, unit: cause.unit() }
    }
}

/// Verdicts of the bank over a record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trace {
    /// Version of the JSON.
    pub schema: u32,
    /// Number of rows.
    pub rows: usize,
    /// Ticks per second.
    pub rate_hz: f64,
    /// Length of a block, in s.
    pub block_s: f64,
    /// Standard deviation of a reading, in V.
    pub noise_v: f64,
    /// Verdict at the end of the record.
    pub last: Event,
    /// Every change of the verdict.
    pub trace: Vec<Event>,
}

/// Standard deviation of the readings' noise, in V, if it is white, from the median of the magnitudes of their second
/// differences; `None` for fewer than 10 readings.
pub fn noise_v(record: &Record) -> Option<f64> {
    let readings: Vec<f64> = record.rows.iter().filter_map(|row| row.measured).collect();
    let mut bent: Vec<f64> = readings.windows(3).map(|at| (at[0] - 2.0 * at[1] + at[2]).abs()).collect();
    bent.sort_by(f64::total_cmp);
    // Their variance is six times that of a reading.
    (bent.len() >= 8).then(|| 1.4826 * bent[bent.len() / 2] / 6f64.sqrt())
}

/// Runs the bank over a record of a spring that is at rest at 0 V at its first row. The rate is 1 kHz, or 100 Hz for rows further
/// apart than half a block of 1 kHz, 64 ms; `settings.interval_s` is set to the mean distance of the rows.
///
/// # Errors
/// [`BadInput`] for settings that the bank rejects, voltages beyond +-2000 V, and rows more than 0.6 s apart.
pub fn run(record: &Record, mut settings: Settings) -> Result<Trace> {
    let [first, .., last] = &record.rows[..] else { bad_input!("{}: expected at least 2 rows", record.name) };
    settings.interval_s = (last.time_s - first.time_s) / (record.rows.len() - 1) as f64;
    let rate_hz = if settings.interval_s > 0.5 * bank::block_s(1000.0) { 100.0 } else { 1000.0 };
    if settings.interval_s > 0.6 {
        bad_input!("{}: rows {:.3} s apart; expected at most 0.6 s", record.name, settings.interval_s);
    }
    let sample_time = SampleTime::from_rate(rate_hz).map_err(BadInput::from)?;
    settings.interval_s = settings.interval_s.max(sample_time.seconds());
    let config = settings.validate(sample_time).map_err(BadInput::from)?.quantize();
    let plant = settings.plant.validate(sample_time).map_err(BadInput::from)?.quantize();
    let (mut spring, mut state) = (Default::default(), State::default());
    let event = |state: &State, time_s: f64| Event::new(&state.report(), time_s, &settings, rate_hz);
    let mut trace = vec![event(&state, first.time_s)];
    let mut verdict = state.verdict();
    let mut tick = 0u64;
    for (row, next) in record.rows.iter().zip(record.rows.iter().skip(1)) {
        let applied = Volts::new(row.voltage_v).map_err(BadInput::from)?;
        let reading = |volts: f64| Volts::new(volts.clamp(-2000.0, 2000.0)).map(|volts| ScaledStiffness(volts.0));
        let mut reading = row.measured.map(reading).transpose().map_err(BadInput::from)?;
        let until = ((next.time_s - first.time_s) * rate_hz).round() as u64;
        while tick < until {
            let model = plant.run(&mut spring, applied);
            // Only the row's first tick has its reading.
            config.tick(&mut state, applied, model, reading.take());
            tick += 1;
            if state.verdict() != verdict {
                verdict = state.verdict();
                trace.push(event(&state, first.time_s + tick as f64 / rate_hz));
            }
        }
    }
    let last = event(&state, last.time_s);
    let (rows, block_s) = (record.rows.len(), bank::block_s(rate_hz));
    Ok(Trace { schema: 1, rows, rate_hz, block_s, noise_v: settings.noise_v, last, trace })
}
