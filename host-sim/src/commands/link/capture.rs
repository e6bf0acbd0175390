//! `vsj link PORT capture`: every tick of a few seconds, from the MCU's RAM.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use host_sim::link::Failure;
use host_sim::output::recording::{Every, Recording};
use host_sim::output::terminal::{print, remark};
use link::capture::Row;
use link::{Reason, Request, Telemetry, WireVolts};
use model::{Amplifier, DacCode, SampleTime, Validate, amplifier, device};
use serde_json::json;
use simulation::bad_input;
use simulation::schedule::Schedule;

use super::schedule::{Drive, ScheduleArguments, check_schedule};
use super::session::{Session, seconds, stopped};

/// Longest accepted capture, in s: more than any MCU has RAM for.
const LONGEST_S: f64 = 1e6;
/// Time between two questions of how far the capture is.
const POLL: Duration = Duration::from_millis(50);

/// Widths of converters that an amplifier may have.
const DAC_BITS: std::ops::RangeInclusive<u32> = 8..=16;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// The file to write: MCAP or Parquet if its name ends in .mcap or .parquet, otherwise CSV
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    /// Length of the capture; default: that of --input
    #[arg(long, value_name = "S", required_unless_present = "input", allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    schedule: ScheduleArguments,
    /// Arm the MCU first; it is disarmed before the rows are sent
    #[arg(long)]
    arm: bool,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

impl Arguments {
    pub(super) fn check(&self) -> Result<()> {
        self.schedule.read()?;
        self.seconds.map(|time| seconds("--seconds", time, LONGEST_S)).transpose().map(drop)
    }
}

pub(super) fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let schedule = arguments.schedule.read()?;
    if let (Some(schedule), Some(name)) = (&schedule, &arguments.schedule.input) {
        check_schedule(session, schedule, name, arguments.arm)?;
    }
    let name = session.client.name().to_owned();
    let length_s = arguments.seconds.or(schedule.as_ref().map(|it| it.end_s() - it.start_s())).unwrap_or_default();
    let rate_hz = session.status.rate_hz;
    let rows = (length_s * f64::from(rate_hz)).round().clamp(1.0, f64::from(u32::MAX)) as u32;
    let amplifier = amplifier_of(session)?;
    let room = session.client.capture_state().with_context(|| name.clone())?.most;
    if rows > room {
        let (row_rate, most_s) = (f64::from(rate_hz), f64::from(room) / f64::from(rate_hz));
        bad_input!("{length_s} s at {row_rate} Hz are {rows} rows: {}, {most_s} s", Reason::TooManyRows { most: room });
    }
    let every = Every { sample_ticks: 1, row_ticks: 1 };
    // Created before anything is armed: what was measured must find its file.
    let mut recording = Recording::new(&arguments.out, arguments.force, &session.status, every)?;
    if arguments.arm {
        session.order(Request::Arm)?;
    }
    let begun = session.client.capture(rows).with_context(|| name.clone());
    let followed = begun.and_then(|_| follow(session, schedule.as_ref(), Duration::from_secs_f64(length_s), rows));
    // Sending the rows takes longer than the capture, and must not hold a voltage meanwhile.
    let ends = arguments.arm || schedule.is_some() || stopped();
    // After a signal and a failure the end of the session disables the output.
    let disarmed =
        if ends && !(followed.is_err() && stopped()) { session.order(Request::Disarm).map(drop) } else { Ok(()) };
    let (captured, shown) = followed?;
    disarmed?;
    let volts = volts_of(&amplifier, rate_hz, shown.as_ref()).with_context(|| name.clone())?;
    let mut all = Vec::new();
    // A signal does not wait for the rows either.
    while (all.len() as u32) < captured && !stopped() {
        let first = all.len() as u32;
        let rows = session.client.rows(first).with_context(|| name.clone())?;
        if rows.is_empty() {
            bail!("{name}: the MCU has no row {first} of {captured}; has it restarted?");
        }
        all.extend(rows);
    }
    // Not every tick of a sensor has a reading, the one before the capture perhaps neither.
    let read = all.iter().find(|row| row.measured).map(|row| row.stiffness);
    if session.status.sample.measured.is_none() && read.is_some() {
        session.status.sample.measured = read;
        recording.finish()?;
        recording = Recording::new(&arguments.out, true, &session.status, every)?;
    }
    let mut tick = 0;
    for row in &all {
        tick += 1 + u64::from(row.missed);
        recording.add(&telemetry(tick, row, &volts))?;
    }
    recording.finish()?;
    let (summary, file) = (recording.summary(), arguments.out.display());
    summary.remarks(&file.to_string()).iter().for_each(|text| remark(text));
    if session.json {
        let mut report = serde_json::to_value(summary)?;
        (report["file"], report["wanted"], report["room"]) = (json!(arguments.out), json!(rows), json!(room));
        print(&format!("{report}\n"))
    } else {
        let (rows, seconds, lost) = (summary.rows, summary.seconds, summary.lost);
        print(&format!("wrote {file}: {rows} rows, {seconds} s, {lost} missing; room for {room} rows\n"))
    }
}

/// Commands the schedule until all rows are captured. Returns their number, fewer after a signal, and a sample of the time with a
/// voltage.
fn follow(
    session: &mut Session,
    schedule: Option<&Schedule>,
    length: Duration,
    rows: u32,
) -> Result<(u32, Option<Telemetry>)> {
    let mut drive = Drive::new(session, schedule);
    let start = Instant::now();
    let (mut asked, mut shown) = (start, None);
    loop {
        if !stopped() {
            drive.step(session)?;
        }
        if start.elapsed() >= length || asked.elapsed() >= POLL || stopped() {
            asked = Instant::now();
            let state = session.client.capture_state().with_context(|| session.client.name().to_owned())?;
            session.show_reports();
            if state.wanted != rows {
                bail!("{}: the capture was replaced or lost: {state:?}", session.client.name());
            }
            if shown.is_none() {
                let status = session.client.status().with_context(|| session.client.name().to_owned())?;
                shown = Some(status.sample).filter(|sample| sample.code > 0);
            }
            if state.captured >= rows || stopped() {
                return Ok((state.captured, shown));
            }
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The amplifier that the MCU runs, with the converter of the report's.
fn amplifier_of(session: &mut Session) -> Result<Amplifier> {
    let running = session.client.read_settings(false).with_context(|| session.client.name().to_owned())?;
    let settings = running.over(&device::Settings::PAPER);
    Ok(settings.map_err(|field| Failure::Refused(Reason::NotBuiltIn(field)))?.control.amplifier)
}

/// The voltages of codes. The settings of an MCU do not contain the width of its converter: it is the one with which the code of the
/// sample `shown` has the sample's voltage. Without a voltage in the capture it does not matter.
fn volts_of(amplifier: &Amplifier, rate_hz: u32, shown: Option<&Telemetry>) -> Result<amplifier::Config> {
    let sample_time = SampleTime::from_rate(f64::from(rate_hz))?;
    let of = |dac_bits| anyhow::Ok(Amplifier { dac_bits, ..*amplifier }.validate(sample_time)?.quantize());
    let Some(shown) = shown else { return of(amplifier.dac_bits) };
    for dac_bits in DAC_BITS {
        let volts = of(dac_bits)?;
        if WireVolts::from(volts.volts(DacCode(shown.code))) == shown.applied {
            return Ok(volts);
        }
    }
    let (code, applied, full) = (shown.code, shown.applied.to_f64(), amplifier.full_scale_v);
    bail!("code {code} is {applied} V; expected a converter of 8 to 16 bits with {full} V at its highest code")
}

/// The row as the telemetry of that tick.
fn telemetry(tick: u64, row: &Row, volts: &amplifier::Config) -> Telemetry {
    Telemetry {
        tick,
        state: row.state,
        applied: volts.volts(DacCode(row.code)).into(),
        estimate: row.stiffness,
        measured: row.measured.then_some(row.stiffness),
        code: row.code,
        limits: row.limits,
        ..Telemetry::default()
    }
}
