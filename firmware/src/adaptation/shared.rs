//! What the control task, the housekeeping task and the host's task share.

use core::cell::{Cell, RefCell};
use core::sync::atomic::Ordering;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::once_lock::OnceLock;
use embassy_time::{Duration, Timer};
use link::adaptation::Adaptation as Request;
use link::isolation::Off;
use link::{AdaptationReport, Reply};

use super::handover::Handover;
use super::{Planner, Terms};
use crate::control::{Control, Tick};
use crate::isolation::Isolation;
use crate::{log, stop};

/// Longest wait for the housekeeping task to take a request, in ms: it looks for one every 10 ms, and after each line of the log.
const PATIENCE_MS: u32 = 30;

static TERMS: OnceLock<Terms> = OnceLock::new();
/// What the host wants to be switched.
static SWITCH: Mutex<CriticalSectionRawMutex, Cell<Option<bool>>> = Mutex::new(Cell::new(None));
/// What the adaptation does; `None` before the housekeeping task has begun.
static LATEST: Mutex<CriticalSectionRawMutex, Cell<Option<AdaptationReport>>> = Mutex::new(Cell::new(None));
static HANDOVER: Mutex<CriticalSectionRawMutex, RefCell<Handover>> = Mutex::new(RefCell::new(Handover::EMPTY));

/// Sets the constant properties, once, at the start.
pub fn set_terms(terms: Terms) {
    let _ = TERMS.init(terms);
}

/// Runs `work` on the handover, with interrupts off. Nobody else holds it then, so that there is always a result; a panic is not possible.
fn with_handover<T>(work: impl FnOnce(&mut Handover) -> T) -> Option<T> {
    HANDOVER.lock(|handover| handover.try_borrow_mut().ok().map(|mut handover| work(&mut handover)))
}

impl Planner {
    /// A planner for the properties of the start.
    pub fn begin() -> Self {
        let planner = Self::new(*TERMS.try_get().unwrap_or(&Terms::NONE));
        planner.publish();
        planner
    }

    fn publish(&self) {
        LATEST.lock(|cell| cell.set(Some(self.report())));
    }
}

/// After the bank's tick number `number`: at the end of a block, exchanges what was planned and shows what the block has shown. No float,
/// no panic: not inlined, so that the audit of the image verifies it.
#[inline(never)]
pub fn after_tick(control: &mut Control, isolation: &mut Isolation, tick: &Tick, number: u64) {
    if !isolation.ends_block(tick) {
        return;
    }
    with_handover(|handover| handover.end_block(control, isolation, tick, number));
}

/// Switches what the host wants, plans if a block has ended, and logs what has changed.
pub fn serve(planner: &mut Planner) {
    if let Some(on) = SWITCH.lock(Cell::get) {
        if let Some(change) = planner.switch(on) {
            log::adaptation(&change, stop::TICK.load(Ordering::Relaxed).into());
        }
        planner.publish();
        SWITCH.lock(|cell| cell.set(None));
    }
    let Some((seen, tick)) = with_handover(Handover::take).flatten() else { return };
    let change = planner.plan(&seen, tick);
    with_handover(|handover| handover.put(planner.next()));
    planner.publish();
    if let Some(change) = change {
        log::adaptation(&change, tick);
    }
}

/// Executes a request of the host at `tick`.
pub async fn execute(request: Request, tick: u64) -> Reply {
    if request.switch().is_some() {
        SWITCH.lock(|cell| cell.set(request.switch()));
        for _ in 0..PATIENCE_MS {
            if SWITCH.lock(Cell::get).is_none() {
                break;
            }
            Timer::after(Duration::from_millis(1)).await;
        }
    }
    let latest = LATEST.lock(Cell::get).unwrap_or_else(|| AdaptationReport::off(Off::NoSensor, tick));
    Reply::Adaptation(AdaptationReport { tick, ..latest })
}
