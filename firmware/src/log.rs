//! All log lines of the firmware. `vsj log` interprets these formats. Times are in us since boot. Numbers of ticks are the low 32
//! bits of those since boot: at 1 kHz they begin again with 0 after 49.7 days.
//!
//! The control task does not log, because logging takes an unbounded time. It queues [`Event`]s, which the housekeeping task
//! logs. On the real board the logger never waits for a reader: unread lines are overwritten. Panics and hard faults are
//! logged directly, after the amplifier is switched off.

use core::sync::atomic::{AtomicU32, Ordering};

use defmt::{error, info, warn};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::Instant;
use link::Controller;
use micromath::F32Ext;
#[cfg(feature = "isolation")]
use model::isolation::{Cause, Verdict};
use model::supervisor::{Fault, Mismatch};
use model::{Amplifier, Sensor, Volts, device};

use crate::isolation::News;

defmt::timestamp!("{=u64:us}", Instant::now().as_micros());

/// An event of the control task.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// Change of state: the previous and the new one.
    State(&'static str, &'static str),
    /// A fault, and the tick that detected it.
    Fault(Fault, u32),
    /// What disagreed with the output when the monitors became a fault, and the tick.
    Mismatch(Mismatch, u32),
    /// Change of the active limits: the new ones as [`model::Limits::bits`], and the tick.
    Limits(u8, u32),
    /// Change of the stiffness sensor's diagnosis, and the tick.
    Sensor(Sensor, u32),
    /// Change of the isolation bank's verdict, and the tick.
    #[cfg(feature = "isolation")]
    Isolation(News, u64),
    /// Statistics, once per second.
    Summary(Summary),
}

/// Statistics of the last second and since boot.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    /// Low 32 bits of the number of ticks since boot.
    pub tick: u32,
    /// Number of missed ticks since boot.
    pub overruns: u32,
    /// Largest delay of a tick since boot, in us.
    pub worst_lateness_us: u32,
    /// Sum of the squared delays of the last second's ticks, in us^2.
    pub squared_lateness_us2: u32,
    /// Number of ticks with an active limit since boot.
    pub limited_ticks: u32,
    /// State of the output, as named by [`link::State`].
    pub state: &'static str,
    /// Target after limitation and ramping, as equivalent static voltage.
    pub target: Volts,
    /// Output voltage.
    pub applied: Volts,
    /// Estimated stiffness, as equivalent static voltage.
    pub stiffness: Volts,
}

/// Events from the control task to the housekeeping task.
pub static EVENTS: Channel<CriticalSectionRawMutex, Event, 16> = Channel::new();
static DROPPED: AtomicU32 = AtomicU32::new(0);
/// Number of ticks in a second, from [`boot`] on.
static RATE_HZ: AtomicU32 = AtomicU32::new(0);

/// Queues an event. Returns false if the queue is full. Not inlined: an event is large.
#[inline(never)]
pub fn try_queue(event: Event) -> bool {
    EVENTS.try_send(event).is_ok()
}

/// Queues an event. If the queue is full, the event is dropped and counted.
pub fn queue(event: Event) {
    if !try_queue(event) {
        DROPPED.fetch_add(1, Ordering::Relaxed);
    }
}

/// Queues a change of the isolation bank's verdict at `tick`.
pub fn isolation(news: &News, tick: u64) {
    #[cfg(feature = "isolation")]
    if news.report.verdict != news.before {
        queue(Event::Isolation(*news, tick));
    }
    #[cfg(not(feature = "isolation"))]
    let _ = (news, tick);
}

/// Logs a change of the adaptation after the block that ended with `tick`: what it does, and the running parameters as ratios to those of
/// the stored model.
#[cfg(feature = "adaptation")]
pub fn adaptation(change: &crate::adaptation::Change, tick: u64) {
    let parameters = change.parameters;
    info!(
        "adaptation {=str} time_constant={=f64} share={=f64} gain={=f64} tick={=u32}",
        change.phase.name(),
        parameters.time_constant,
        parameters.share,
        parameters.gain,
        tick as u32
    );
}

/// Logs the first lines after a reset: its cause, the code of the last fault, and rate, controller and amplifier in use.
pub fn boot(reset: &'static str, last_fault: u8, settings: &device::Settings) {
    RATE_HZ.store(settings.rate_hz(), Ordering::Relaxed);
    let (version, git) = (env!("CARGO_PKG_VERSION"), env!("GIT_REVISION"));
    info!(
        "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32} controller={=str}",
        version,
        git,
        reset,
        last_fault,
        settings.rate_hz(),
        Controller::of(&settings.control.compensation).name()
    );
    // Only if it differs from the source report's.
    let limit_v = settings.control.amplifier.max_v;
    if limit_v != Amplifier::PAPER.max_v {
        info!("amplifier limit_v={=u16}", limit_v as u16);
    }
}

/// Logs a fault.
pub fn fault(fault: Fault, tick: u32) {
    error!("fault code={=u8} name={=str} tick={=u32}", fault.code(), fault.name(), tick);
}

/// Logs the location of a panic.
pub fn panicked(file: &str, line: u32) {
    error!("panic at {=str}:{=u32}", file, line);
}

/// Logs the field of a model or setting that failed its validation.
pub fn refused(field: &'static str) {
    error!("config refused field={=str}", field);
}

/// Logs which part failed its test at the start, and the value by which it failed.
pub fn self_test(part: &'static str, value: u32) {
    error!("self-test failed part={=str} value={=u32}", part, value);
}

/// Logs that the chip's brown-out level is not the expected one.
pub fn brown_out(level: u8, expected: u8) {
    warn!("brown-out level={=u8} expected={=u8}", level, expected);
}

/// Logs an event.
pub fn event(event: Event) {
    let dropped = DROPPED.swap(0, Ordering::Relaxed);
    if dropped > 0 {
        warn!("dropped events={=u32}", dropped);
    }
    match event {
        Event::State(from, to) => info!("state {=str} -> {=str}", from, to),
        Event::Fault(it, tick) => fault(it, tick),
        Event::Mismatch(it, tick) => warn!("monitor {=str} tick={=u32}", it.name(), tick),
        Event::Limits(bits, tick) => warn!("limit bits={=u8} tick={=u32}", bits, tick),
        Event::Sensor(sensor, tick) => warn!("sensor {=str} tick={=u32}", sensor.name(), tick),
        #[cfg(feature = "isolation")]
        Event::Isolation(news, tick) => isolated(&news, tick),
        Event::Summary(s) => info!(
            "summary tick={=u32} overruns={=u32} worst_lateness_us={=u32} rms_lateness_us={=f32} limited_ticks={=u32} state={=str} target_mv={=i32} applied_mv={=i32} stiffness_mv={=i32}",
            s.tick,
            s.overruns,
            s.worst_lateness_us,
            rms_us(s.squared_lateness_us2),
            s.limited_ticks,
            s.state,
            millivolts(s.target),
            millivolts(s.applied),
            millivolts(s.stiffness)
        ),
    }
}

/// Logs the isolation bank's verdict. A name that goes is `withdrawn`.
#[cfg(feature = "isolation")]
#[inline(never)]
fn isolated(news: &News, tick: u64) {
    let News { report, before, .. } = news;
    let (since_tick, tick) = (news.since_tick(tick) as u32, tick as u32);
    let said = crate::isolation::describe(report, 0, 0);
    match (report.verdict, before) {
        (Verdict::Named(_) | Verdict::Ambiguous(..), _) => {
            let (cause, other) = report.verdict.causes();
            warn!(
                "isolation {=str} cause={=str} other={=str} size={=f64} half_width={=f64} explained={=f64} since_tick={=u32} tick={=u32}",
                report.verdict.name(),
                cause.map_or("-", Cause::name),
                other.map_or("-", Cause::name),
                said.size,
                said.half_width,
                said.explained,
                since_tick,
                tick
            )
        }
        (verdict, Verdict::Named(cause)) => {
            warn!(
                "isolation withdrawn cause={=str} verdict={=str} since_tick={=u32} tick={=u32}",
                cause.name(),
                verdict.name(),
                since_tick,
                tick
            )
        }
        (verdict, _) => warn!("isolation {=str} since_tick={=u32} tick={=u32}", verdict.name(), since_tick, tick),
    }
}

/// Root mean square of one second's delays, in us, from the sum of their squares. Accurate to 6 %, in steps of 0.1 us.
fn rms_us(sum_us2: u32) -> f32 {
    let mean = sum_us2 as f32 / RATE_HZ.load(Ordering::Relaxed) as f32;
    (mean.sqrt() * 10.0).round() / 10.0
}

/// `volts` in mV, rounded down.
fn millivolts(volts: Volts) -> i32 {
    ((i64::from(volts.0.to_bits()) * 1000) >> 20) as i32
}
