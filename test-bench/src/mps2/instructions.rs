//! SysTick as a counter of instructions.
//!
//! With the emulator's option `-icount shift=N` every instruction takes 2^N ns, and SysTick counts periods of 40 ns. From N = 6
//! on an instruction is longer than a count, so that the number of instructions is exact; below, it is rounded to
//! 40 ns / 2^N instructions. The scale is measured at the start with a thousand `nop` instructions.

use cortex_m::peripheral::Peripherals;
use firmware::control::Stopwatch;
use firmware::hang_guard;

use super::registers::{CLOCK_HZ, SYSTICK_RELOAD, SYSTICK_VALUE};

/// Number of `nop` instructions that determine the scale.
const KNOWN: u32 = 1000;

/// Number of instructions of the model's tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Instructions {
    /// Smallest number.
    pub min: u32,
    /// Mean, rounded.
    pub mean: u32,
    /// Largest number.
    pub max: u32,
}

/// Minimum, maximum and sum over all ticks, in counts.
#[derive(Debug)]
pub struct Counter {
    counts_of_known: u32,
    counts_of_nothing: u32,
    reload: u32,
    started: u32,
    min: u32,
    max: u32,
    sum: u64,
    ticks: u32,
}

/// Starts SysTick in a program without control task. Without ticks the hang guard, which runs on it, is inactive.
pub fn start_clock() {
    if let Some(mut core) = Peripherals::take() {
        hang_guard::start(&mut core.SYST, CLOCK_HZ);
    }
}

impl Counter {
    /// Measures the scale of SysTick, which must be running. A tick must not take longer than SysTick's period of 1 ms.
    pub fn begin() -> Self {
        let mut counter = Self {
            counts_of_known: 1,
            counts_of_nothing: 0,
            reload: SYSTICK_RELOAD.read(),
            started: 0,
            min: u32::MAX,
            max: 0,
            sum: 0,
            ticks: 0,
        };
        counter.start();
        counter.counts_of_nothing = counter.passed();
        counter.start();
        // SAFETY: changes no register.
        unsafe { core::arch::asm!(".rept 1000", "nop", ".endr", options(nostack)) }
        counter.counts_of_known = counter.passed() - counter.counts_of_nothing;
        counter
    }

    /// Statistics of all ticks so far.
    pub fn instructions(&self) -> Instructions {
        if self.ticks == 0 {
            return Instructions::default();
        }
        let scale = |counts: u64| {
            let known = u64::from(self.counts_of_known);
            ((counts * u64::from(KNOWN) + known / 2) / known) as u32
        };
        let ticks = u64::from(self.ticks);
        let mean = (scale(self.sum * 10 / ticks) + 5) / 10;
        Instructions { min: scale(u64::from(self.min)), mean, max: scale(u64::from(self.max)) }
    }

    /// Counts since the start. Enables interrupts.
    #[inline(always)]
    fn passed(&self) -> u32 {
        let now = SYSTICK_VALUE.read();
        // SAFETY: `start` has disabled them; they were enabled before.
        unsafe { cortex_m::interrupt::enable() };
        // SysTick counts down from `reload` and restarts there after zero.
        if now <= self.started { self.started - now } else { self.started + self.reload + 1 - now }
    }
}

impl Stopwatch for Counter {
    /// Disables interrupts, whose instructions must not be counted.
    #[inline(always)]
    fn start(&mut self) {
        cortex_m::interrupt::disable();
        self.started = SYSTICK_VALUE.read();
    }

    #[inline(always)]
    fn stop(&mut self) {
        let counts = self.passed().saturating_sub(self.counts_of_nothing);
        self.min = self.min.min(counts);
        self.max = self.max.max(counts);
        self.sum = self.sum.wrapping_add(u64::from(counts));
        self.ticks = self.ticks.wrapping_add(1);
    }
}
