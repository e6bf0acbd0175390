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
use model::adaptation::{Observation, Variant};

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
/// What the last block has shown, and its last tick.
static SEEN: Mutex<CriticalSectionRawMutex, Cell<Option<(Observation, u64)>>> = Mutex::new(Cell::new(None));
/// What is exchanged at the end of the present block. Without the inner cell, which hides the unused codes of a variant, `None` would be
/// one of them, not zero, and the flash would contain the whole variant for the start.
static NEXT: Mutex<CriticalSectionRawMutex, RefCell<Option<Cell<Variant>>>> = Mutex::new(RefCell::new(None));

/// Sets the constant properties, once, at the start.
pub fn set_terms(terms: Terms) {
    let _ = TERMS.init(terms);
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
    let seen = NEXT.lock(|next| {
        // Nobody else holds it while interrupts are off.
        let mut next = next.try_borrow_mut().ok();
        let variant = next.as_mut().and_then(|next| next.as_mut()).map(|next| &*next.get_mut());
        let seen = isolation.end_block(control, tick, variant);
        if let Some(next) = &mut next {
            **next = None;
        }
        seen
    });
    SEEN.lock(|cell| cell.set(Some((seen, number))));
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
    let Some((seen, tick)) = SEEN.lock(Cell::take) else { return };
    let change = planner.plan(&seen, tick);
    NEXT.lock(|next| {
        if let Ok(mut next) = next.try_borrow_mut() {
            *next = planner.next().copied().map(Cell::new);
        }
    });
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
