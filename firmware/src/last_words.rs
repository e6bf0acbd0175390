//! What survives a reset: a record in memory that start-up leaves alone.
//!
//! After power-on this memory holds noise, so the record counts only with its check word. A reset without last words
//! means that nobody could say anything any more: the watchdog, the reset pin, or a dip of the supply.

#![allow(unsafe_code)]

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use model::supervisor::Fault;

use crate::cause::{Legacy, Reset, cause};

/// "vsj1"
const MARK: u32 = 0x7673_6a31;
/// Code for "running".
const ALIVE: u32 = 0;
/// Code for "restarts as it was told".
const TOLD: u32 = u32::MAX;

#[repr(C)]
#[derive(Clone, Copy)]
struct Record {
    mark: u32,
    code: u32,
    tick: u32,
    check: u32,
}

struct Kept(UnsafeCell<MaybeUninit<Record>>);

// SAFETY: written with interrupts off only, and read before they are on, by volatile accesses.
unsafe impl Sync for Kept {}

#[unsafe(link_section = ".uninit.last_words")]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// The cause of a reset and the fault behind it, which stays for whatever resets the chip before it is acknowledged. Once, at
/// boot; `said` is what the chip says of it, if anything.
pub fn reset_cause(said: Option<Reset>) -> (&'static str, Option<Fault>) {
    let (name, fault) = cause(said, take());
    if let Some(fault) = fault {
        leave(fault, 0);
    }
    (name, fault)
}

/// Reads what was left and marks this run as running.
fn take() -> Legacy {
    // SAFETY: every bit pattern is a Record; see `Kept`.
    let record = unsafe { KEPT.0.get().cast::<Record>().read_volatile() };
    write(ALIVE, 0);
    if record.mark != MARK || record.check != check(record.code, record.tick) {
        return Legacy::None;
    }
    match u8::try_from(record.code).ok().and_then(Fault::from_code) {
        Some(fault) => Legacy::Faulted(fault, record.tick),
        None if record.code == TOLD => Legacy::Told,
        None => Legacy::Silent,
    }
}

/// Leaves `fault` for the next run.
pub fn leave(fault: Fault, tick: u32) {
    write(u32::from(fault.code()), tick);
}

/// The fault was acknowledged: this run is as any other.
pub fn acknowledge() {
    write(ALIVE, 0);
}

/// Leaves word that the reset which follows was ordered.
pub fn leave_in_order() {
    write(TOLD, 0);
}

fn write(code: u32, tick: u32) {
    let record = Record { mark: MARK, code, tick, check: check(code, tick) };
    // SAFETY: see `Kept`.
    cortex_m::interrupt::free(|_| unsafe { KEPT.0.get().cast::<Record>().write_volatile(record) });
}

fn check(code: u32, tick: u32) -> u32 {
    !(MARK ^ code.rotate_left(8) ^ tick)
}
