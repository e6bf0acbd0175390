//! The crash record: a record in RAM that the start-up code does not initialise, so that it survives a reset.
//!
//! After power-on this RAM contains random bits, so the record is valid only with its check word. A reset without a recorded
//! fault was caused by the watchdog, the reset pin or a dip of the supply. What a record says is in
//! [`reset_cause`](crate::reset_cause).

#![allow(unsafe_code)]

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use model::supervisor::{Fault, Faults, State};

use crate::reset_cause::{self, Cause, Record, Reset};

/// The record's place, of four words.
pub(crate) struct Memory(UnsafeCell<MaybeUninit<Record>>);

// SAFETY: read and written with interrupts off only, by volatile accesses.
unsafe impl Sync for Memory {}

/// Kept in registers by the [test of the RAM](crate::ram_test).
#[unsafe(link_section = ".uninit.crash_record")]
pub(crate) static MEMORY: Memory = Memory(UnsafeCell::new(MaybeUninit::uninit()));

// The test of the RAM keeps four words.
const _: () = assert!(size_of::<Record>() == 16);

/// The cause of the last reset. Call it once at boot; `flags` is the source that the chip reports, if it does. The standing
/// faults stay recorded until [`set`].
pub fn reset_cause(flags: Option<Reset>) -> Cause {
    let mut cause = None;
    change(|record| {
        let found = cause.insert(reset_cause::reset_cause(flags, record.read()));
        found.fault.map_or(Record::RUNNING, |fault| Record::faulted(fault, found.standing))
    });
    // The closure has run.
    cause.unwrap_or(Cause { name: "other", fault: None, standing: Faults::NONE })
}

/// Records the state, and all faults that stand, for the next run.
pub fn set(state: State, standing: Faults) {
    change(|_| Record::of(state, standing));
}

/// Adds the fault that stops the program.
pub fn add(fault: Fault) {
    change(|record| record.with(fault));
}

/// Records that the following reset was requested, unless a fault has occurred since.
pub fn record_restart() {
    change(Record::with_restart);
}

fn change(to: impl FnOnce(Record) -> Record) {
    cortex_m::interrupt::free(|_| {
        let memory = MEMORY.0.get().cast::<Record>();
        // SAFETY: every bit pattern is a Record; see `Memory`.
        let record = unsafe { memory.read_volatile() };
        // SAFETY: see `Memory`.
        unsafe { memory.write_volatile(to(record)) }
    });
}
