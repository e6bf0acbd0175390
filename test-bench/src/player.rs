//! Execution of a script on the emulated board: passes its commands to the control task, drives the interlock, injects the
//! faults and computes the digest.

// Some faults are undefined behaviour on purpose.
#![allow(unsafe_code)]

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_time::Instant;
use firmware::control::{Control, Source, Tick};
use link::Command;

use crate::digest::Digest;
use crate::mps2::INTERLOCK_CLOSED;
use crate::script::{FaultInjection, Script};

/// True if the housekeeping task is to stop.
pub static STALL: AtomicBool = AtomicBool::new(false);

/// A script being executed.
#[derive(Debug)]
pub struct Player {
    script: Script,
    digest: Digest,
}

impl Player {
    /// A player at the start of `script`.
    pub fn new(script: Script) -> Self {
        Self { script, digest: Digest::default() }
    }

    /// Digest of the ticks so far.
    pub fn digest(&self) -> u64 {
        self.digest.value()
    }
}

impl Source for Player {
    fn command(&mut self, tick: u64) -> Option<Command> {
        let step = self.script.step((tick - self.script.first_tick()) as u32)?;
        INTERLOCK_CLOSED.store(step.interlock_closed, Ordering::Relaxed);
        if let Some(fault) = step.fault {
            inject(fault);
        }
        Some(step.command)
    }

    fn done(&mut self, tick: &Tick, _control: &Control, _overruns: u32) {
        self.digest.add(tick);
    }
}

/// Causes `fault` in the calling task.
fn inject(fault: FaultInjection) {
    match fault {
        FaultInjection::Panic => panic!("drill"),
        FaultInjection::HardFault => {
            // SAFETY: none, on purpose: there is no memory at this address.
            unsafe { (0xf000_0000 as *const u32).read_volatile() };
        }
        FaultInjection::StackOverflow => {
            core::hint::black_box(deeper(1));
        }
        FaultInjection::FloatOverflow => {
            // SAFETY: changes no register; from here on the task's float registers are in use.
            unsafe { core::arch::asm!("vmov s0, s0") };
            core::hint::black_box(deeper(1));
        }
        FaultInjection::Stall => STALL.store(true, Ordering::Relaxed),
        FaultInjection::Hang => hang(),
        FaultInjection::Deaf => {
            cortex_m::interrupt::disable();
            hang()
        }
        FaultInjection::Overrun | FaultInjection::TwoFaults => {
            let until = Instant::now().as_micros() + 8_000;
            while Instant::now().as_micros() < until {}
        }
        // Expressed by the script's interlock and commands, or at the start.
        FaultInjection::Interlock | FaultInjection::Silence | FaultInjection::Unguarded => {}
    }
}

/// Never returns.
pub fn hang() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}

#[allow(unconditional_recursion)]
#[inline(never)]
fn deeper(depth: u32) -> u32 {
    let room = core::hint::black_box([depth; 16]);
    deeper(depth + 1) + room[3]
}
