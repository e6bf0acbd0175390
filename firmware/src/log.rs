//! Every log line, in one place: `vsj log` reads them by these very formats. Times in us since boot.
//!
//! The control task does not log, because a logger takes its time. It puts [`Event`]s into a queue and goes on; housekeeping
//! logs them. On the real board a logger never waits for a reader: what nobody reads in time is overwritten. Panics and hard
//! faults log directly, after the voltage is gone.

use core::sync::atomic::{AtomicU32, Ordering};

use defmt::{error, info, warn};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::Instant;
use link::Controller;
use micromath::F32Ext;
use model::supervisor::Fault;
use model::{Sensor, Volts};

use crate::settings::AMPLIFIER;

defmt::timestamp!("{=u64:us}", Instant::now().as_micros());

/// What the control task has to say.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// From one state to another.
    State(&'static str, &'static str),
    /// A fault and its tick.
    Fault(Fault, u32),
    /// The limits that act have changed.
    Limits(u8, u32),
    /// The stiffness sensor is trusted from this tick on, or is not.
    Sensor(Sensor, u32),
    /// Once a second.
    Summary(Summary),
    /// The end of an emulated run.
    Done(Done),
}

/// The last second and all before.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    /// Ticks since boot.
    pub tick: u32,
    /// Ticks missed since boot.
    pub overruns: u32,
    /// Since boot, in us.
    pub worst_lateness_us: u32,
    /// Of the last second's ticks, squared and summed up, in us^2.
    pub squared_lateness_us2: u32,
    /// Ticks in a limit since boot.
    pub limited_ticks: u32,
    /// As the link names it.
    pub state: &'static str,
    /// Pursued.
    pub target: Volts,
    /// Put out.
    pub applied: Volts,
    /// Estimated, on the scale of volts.
    pub stiffness: Volts,
}

/// An emulated run.
#[derive(Clone, Copy, Debug)]
pub struct Done {
    /// Ticks that were run.
    pub ticks: u32,
    /// Ticks that were missed.
    pub missed: u32,
    /// See [`crate::digest`].
    pub digest: u64,
    /// Instructions of a tick of the model.
    pub instructions: Instructions,
}

/// Instructions of a tick of the model.
#[derive(Clone, Copy, Debug, Default)]
pub struct Instructions {
    /// Fewest.
    pub min: u32,
    /// Rounded.
    pub mean: u32,
    /// Most.
    pub max: u32,
}

/// From the control task to housekeeping.
pub static EVENTS: Channel<CriticalSectionRawMutex, Event, 16> = Channel::new();
static DROPPED: AtomicU32 = AtomicU32::new(0);

/// Queues an event; if the queue is full, counts it instead.
pub fn queue(event: Event) {
    if EVENTS.try_send(event).is_err() {
        DROPPED.fetch_add(1, Ordering::Relaxed);
    }
}

/// The first lines after a reset; `controller` leads the spring.
pub fn boot(reset: &'static str, last_fault: u8, controller: Controller) {
    let (version, git) = (env!("CARGO_PKG_VERSION"), env!("GIT_REVISION"));
    info!(
        "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32} controller={=str}",
        version,
        git,
        reset,
        last_fault,
        crate::RATE_HZ,
        controller.name()
    );
    // The report's goes without saying.
    if cfg!(feature = "kilovolt") {
        info!("amplifier limit_v={=u16}", const { AMPLIFIER.max_v as u16 });
    }
}

/// A fault, from the control task's queue or from the one who found it.
pub fn fault(fault: Fault, tick: u32) {
    error!("fault code={=u8} name={=str} tick={=u32}", fault.code(), fault.name(), tick);
}

/// Where the program stopped itself.
pub fn panicked(file: &str, line: u32) {
    error!("panic at {=str}:{=u32}", file, line);
}

/// Settings that were refused.
pub fn refused(field: &'static str) {
    error!("config refused field={=str}", field);
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
        Event::Limits(bits, tick) => warn!("limit bits={=u8} tick={=u32}", bits, tick),
        Event::Sensor(sensor, tick) => warn!("sensor {=str} tick={=u32}", sensor.name(), tick),
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
        Event::Done(d) => info!(
            "done ticks={=u32} missed={=u32} digest={=u64:x} min={=u32} mean={=u32} max={=u32}",
            d.ticks, d.missed, d.digest, d.instructions.min, d.instructions.mean, d.instructions.max
        ),
    }
}

/// Root mean square of a second's ticks, to 6 % and in steps of 0.1 us.
fn rms_us(sum_us2: u32) -> f32 {
    let mean = sum_us2 as f32 / crate::RATE_HZ as f32;
    (mean.sqrt() * 10.0).round() / 10.0
}

/// Rounded down.
fn millivolts(volts: Volts) -> i32 {
    ((i64::from(volts.0.to_bits()) * 1000) >> 20) as i32
}
