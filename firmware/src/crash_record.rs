//! The crash record: a record in RAM that the start-up code does not initialise, so that it survives a reset.
//!
//! After power-on this RAM contains random bits, so the record is valid only with its check word. A reset without a recorded
//! fault was caused by the watchdog, the reset pin or a dip of the supply.

#![allow(unsafe_code)]

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use model::supervisor::Fault;

use crate::reset_cause::{self, CrashRecord, Reset};

/// "vsj1"
const MARK: u32 = 0x7673_6a31;
/// Code of [`CrashRecord::Running`].
const RUNNING: u32 = 0;
/// Code of [`CrashRecord::Restart`].
const RESTART: u32 = u32::MAX;

#[repr(C)]
#[derive(Clone, Copy)]
struct Record {
    mark: u32,
    code: u32,
    tick: u32,
    check: u32,
}

struct Memory(UnsafeCell<MaybeUninit<Record>>);

// SAFETY: written with interrupts off only, and read before they are on, by volatile accesses.
unsafe impl Sync for Memory {}

#[unsafe(link_section = ".uninit.crash_record")]
static MEMORY: Memory = Memory(UnsafeCell::new(MaybeUninit::uninit()));

/// Name of the cause of the last reset, and the fault behind it. Call it once at boot; `flags` is the source that the chip
/// reports, if it does. The fault stays recorded until [`clear`].
pub fn reset_cause(flags: Option<Reset>) -> (&'static str, Option<Fault>) {
    let (name, fault) = reset_cause::reset_cause(flags, take());
    if let Some(fault) = fault {
        record(fault, 0);
    }
    (name, fault)
}

/// Reads the record of the previous run and replaces it by that of a running program.
fn take() -> CrashRecord {
    // SAFETY: every bit pattern is a Record; see `Memory`.
    let record = unsafe { MEMORY.0.get().cast::<Record>().read_volatile() };
    write(RUNNING, 0);
    if record.mark != MARK || record.check != check(record.code, record.tick) {
        return CrashRecord::None;
    }
    match u8::try_from(record.code).ok().and_then(Fault::from_code) {
        Some(fault) => CrashRecord::Faulted(fault, record.tick),
        None if record.code == RESTART => CrashRecord::Restart,
        None => CrashRecord::Running,
    }
}

/// Records `fault`, which occurred in `tick`, for the next run.
pub fn record(fault: Fault, tick: u32) {
    write(u32::from(fault.code()), tick);
}

/// Clears the record once its fault is acknowledged.
pub fn clear() {
    write(RUNNING, 0);
}

/// Records that the following reset was requested.
pub fn record_restart() {
    write(RESTART, 0);
}

fn write(code: u32, tick: u32) {
    let record = Record { mark: MARK, code, tick, check: check(code, tick) };
    // SAFETY: see `Memory`.
    cortex_m::interrupt::free(|_| unsafe { MEMORY.0.get().cast::<Record>().write_volatile(record) });
}

fn check(code: u32, tick: u32) -> u32 {
    !(MARK ^ code.rotate_left(8) ^ tick)
}
