//! What the control task, the host's task and the log share of the bank.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::once_lock::OnceLock;
use embassy_time::{Duration, Timer};
use link::isolation::{Isolation as Request, Off};
use link::{IsolationReport, Notice, Reply};
use model::isolation::{Causes, Report};

use super::{News, Terms};

/// Longest wait for the control task to take an acknowledgement, in ms: it takes it in its next tick.
const PATIENCE_MS: u32 = 20;

/// The latest report, and the tick after which its fault has been there.
static LATEST: Mutex<CriticalSectionRawMutex, Cell<Option<(Report, u64)>>> = Mutex::new(Cell::new(None));
static TERMS: OnceLock<Terms> = OnceLock::new();
static ACKNOWLEDGED: AtomicBool = AtomicBool::new(false);

/// Sets the constant properties, once, at the start.
pub fn set_terms(terms: Terms) {
    let _ = TERMS.init(terms);
}

/// Publishes what has changed in a tick, counted from the start.
pub fn publish(news: &News, tick: u64) {
    let since_tick = if news.since_ticks == 0 { 0 } else { news.since_tick(tick) };
    LATEST.lock(|cell| cell.set(Some((news.report, since_tick))));
}

/// True once after the host's acknowledgement.
pub fn take_acknowledged() -> bool {
    ACKNOWLEDGED.swap(false, Ordering::Relaxed)
}

/// Executes a request of the host at `tick`.
pub async fn execute(request: Request, tick: u64) -> Reply {
    if request == Request::Acknowledge {
        ACKNOWLEDGED.store(true, Ordering::Relaxed);
        for _ in 0..PATIENCE_MS {
            if !ACKNOWLEDGED.load(Ordering::Relaxed) {
                break;
            }
            Timer::after(Duration::from_millis(1)).await;
        }
    }
    let (report, since_tick) = LATEST.lock(Cell::get).unwrap_or_default();
    Reply::Isolation(describe(&report, tick, since_tick))
}

/// Returns what to send with the telemetry at `tick` and the code of its verdict, if it `is_due` with this code.
pub fn notice(tick: u64, is_due: impl FnOnce(u16) -> bool) -> Option<(u16, Notice)> {
    let (report, since_tick) = LATEST.lock(Cell::get).unwrap_or_default();
    let verdict = report.verdict.code();
    is_due(verdict).then(|| (verdict, Notice::Isolation(describe(&report, tick, since_tick))))
}

/// Returns a report in SI units.
pub fn describe(report: &Report, tick: u64, since_tick: u64) -> IsolationReport {
    match TERMS.try_get() {
        Some(terms) => terms.describe(report, tick, since_tick),
        // Before the start of the control task.
        None => IsolationReport::off(Off::NoSensor, tick, Causes::NONE),
    }
}
