//! What the control task and the housekeeping task share.

use core::cell::{Cell, RefCell};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use model::adaptation::{Observation, Variant};

use super::{Planner, Terms};
use crate::control::{Control, Tick};
use crate::isolation::Isolation;
use crate::log;

static TERMS: Mutex<CriticalSectionRawMutex, Cell<Option<Terms>>> = Mutex::new(Cell::new(None));
/// What the last block has shown, and its last tick.
static SEEN: Mutex<CriticalSectionRawMutex, Cell<Option<(Observation, u32)>>> = Mutex::new(Cell::new(None));
/// What is exchanged at the end of the present block.
static NEXT: Mutex<CriticalSectionRawMutex, RefCell<Option<Variant>>> = Mutex::new(RefCell::new(None));

/// Sets the constant properties, at the start.
pub fn set_terms(terms: Terms) {
    TERMS.lock(|cell| cell.set(Some(terms)));
}

impl Planner {
    /// A planner for the properties of the start.
    pub fn begin() -> Self {
        Self::new(TERMS.lock(Cell::get).unwrap_or_default())
    }
}

/// After the bank's tick number `number`: at the end of a block, exchanges what was planned and shows what the block has shown. No float,
/// no panic: not inlined, so that the audit of the image verifies it.
#[inline(never)]
pub fn after_tick(control: &mut Control, isolation: &mut Isolation, tick: &Tick, number: u32) {
    if !isolation.ends_block(tick) {
        return;
    }
    let seen = NEXT.lock(|next| {
        // Nobody else holds it while interrupts are off.
        let mut next = next.try_borrow_mut().ok();
        let seen = isolation.end_block(control, tick, next.as_ref().and_then(|next| next.as_ref()));
        if let Some(next) = &mut next {
            **next = None;
        }
        seen
    });
    SEEN.lock(|cell| cell.set(Some((seen, number))));
}

/// Plans if a block has ended, and logs what has changed.
pub fn serve(planner: &mut Planner) {
    let Some((seen, tick)) = SEEN.lock(Cell::take) else { return };
    let change = planner.plan(&seen);
    NEXT.lock(|next| {
        if let Ok(mut next) = next.try_borrow_mut() {
            *next = planner.next().copied();
        }
    });
    if let Some(change) = change {
        log::adaptation(&change, tick);
    }
}
