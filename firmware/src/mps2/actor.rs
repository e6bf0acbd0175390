//! Plays a script: gives its orders, opens its interlock, acts its mishaps out, and keeps the digest.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_time::Instant;

use super::INTERLOCK_CLOSED;
use crate::control::{Control, Orders, Tick};
use crate::digest::Digest;
use crate::script::{Mishap, Script};
use crate::tasks::Source;

/// Housekeeping is to stop for ever.
pub static STALL: AtomicBool = AtomicBool::new(false);

/// An actor.
#[derive(Debug)]
pub struct Actor {
    script: Script,
    digest: Digest,
}

impl Actor {
    /// At the start of `script`.
    pub fn new(script: Script) -> Self {
        Self { script, digest: Digest::default() }
    }

    /// Of everything so far.
    pub fn digest(&self) -> u64 {
        self.digest.value()
    }
}

impl Source for Actor {
    fn orders(&mut self, tick: u32) -> Option<Orders> {
        let step = self.script.step(tick)?;
        INTERLOCK_CLOSED.store(step.interlock_closed, Ordering::Relaxed);
        if let Some(mishap) = step.mishap {
            act(mishap);
        }
        Some(step.orders)
    }

    fn done(&mut self, tick: &Tick, _control: &Control, _overruns: u32) {
        self.digest.add(tick);
    }
}

fn act(mishap: Mishap) {
    match mishap {
        Mishap::Panic => panic!("drill"),
        Mishap::HardFault => {
            // SAFETY: not safe, and that is the drill: there is nothing at this address.
            unsafe { (0xf000_0000 as *const u32).read_volatile() };
        }
        Mishap::StackOverflow => {
            core::hint::black_box(deeper(1));
        }
        Mishap::FloatOverflow => {
            // SAFETY: does nothing, but from here on the task's float registers are in use.
            unsafe { core::arch::asm!("vmov s0, s0") };
            core::hint::black_box(deeper(1));
        }
        Mishap::Stall => STALL.store(true, Ordering::Relaxed),
        Mishap::Hang => hang(),
        Mishap::Deaf => {
            cortex_m::interrupt::disable();
            hang()
        }
        Mishap::Overrun => {
            let until = Instant::now().as_micros() + 8_000;
            while Instant::now().as_micros() < until {}
        }
        // The script itself opens the interlock and silences the host.
        Mishap::Interlock | Mishap::Silence => {}
    }
}

/// Does nothing, for ever.
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
