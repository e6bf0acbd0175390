//! SysTick as a counter of instructions.
//!
//! Under `-icount shift=N` every instruction takes 2^N ns of the emulator's time, and SysTick counts 40 ns. From N = 6 on
//! an instruction is longer than a count, so that the count tells the number of instructions exactly; below, it is rounded
//! to 40 ns / 2^N instructions. The scale is not told but measured at the start, on a thousand instructions that do nothing.

use model::Output;

use super::registers::{SYSTICK_CONTROL, SYSTICK_RELOAD, SYSTICK_VALUE};
use crate::control::Stopwatch;
use crate::log::Instructions;

const TOP: u32 = 0xff_ffff;
const KNOWN: u32 = 1000;

/// Fewest, most and sum over all ticks.
#[derive(Debug)]
pub struct Counter {
    counts_of_known: u32,
    counts_of_nothing: u32,
    min: u32,
    max: u32,
    sum: u64,
    ticks: u32,
}

impl Counter {
    /// Starts SysTick and measures its scale.
    pub fn start() -> Self {
        SYSTICK_RELOAD.write(TOP);
        SYSTICK_VALUE.write(0);
        SYSTICK_CONTROL.write(0b101);
        let counts_of_nothing = counts(|| ());
        let counts_of_known = counts(|| {
            // SAFETY: does nothing.
            unsafe { core::arch::asm!(".rept 1000", "nop", ".endr", options(nomem, nostack)) }
        }) - counts_of_nothing;
        Self { counts_of_known, counts_of_nothing, min: u32::MAX, max: 0, sum: 0, ticks: 0 }
    }

    /// Of all ticks so far.
    pub fn instructions(&self) -> Instructions {
        if self.ticks == 0 {
            return Instructions::default();
        }
        let ticks = u64::from(self.ticks);
        Instructions { min: self.min, mean: ((self.sum + ticks / 2) / ticks) as u32, max: self.max }
    }
}

impl Stopwatch for Counter {
    fn time(&mut self, tick: impl FnOnce() -> Output) -> Output {
        let mut output = None;
        let counts = counts(|| output = Some(tick())).saturating_sub(self.counts_of_nothing);
        let instructions = (counts * KNOWN + self.counts_of_known / 2) / self.counts_of_known;
        self.min = self.min.min(instructions);
        self.max = self.max.max(instructions);
        self.sum += u64::from(instructions);
        self.ticks += 1;
        match output {
            Some(output) => output,
            // `counts` has called it.
            None => unreachable!(),
        }
    }
}

/// What SysTick counts while `work` is done, interrupts kept out.
#[inline(always)]
fn counts(work: impl FnOnce()) -> u32 {
    critical_section::with(|_| {
        let before = SYSTICK_VALUE.read();
        work();
        before.wrapping_sub(SYSTICK_VALUE.read()) & TOP
    })
}
