//! Measurement for the [test of the processor's clock](crate::clock_test): TIM16 captures the low-speed oscillator (LSI).

use embassy_stm32::pac::timer::vals::CcmrInputCcs;
use embassy_stm32::pac::{RCC, TIM16};

use super::clocks::CORE_HZ;
use crate::clock_test::{PLAUSIBLE_HZ, seen_hz};

/// Source of the timer's first input: the LSI (TIM16_TISEL).
const LSI: u8 = 6;
/// Prescaler of the captures: every fourth edge.
const EVERY_FOURTH: u8 = 2;
/// Reads of the status after which an edge counts as missing: more than 0.5 ms. The LSI needs 0.13 ms to start, and a capture
/// comes every 0.125 ms.
const MOST_READS: u32 = 20_000;

/// The LSI's frequency as the processor sees it, in Hz, if that is not plausible; 0 if the LSI is not there. Needs 0.5 ms.
pub fn failed() -> Option<u32> {
    RCC.csr().modify(|w| w.set_lsion(true));
    RCC.apb2enr().modify(|w| w.set_tim16en(true));
    TIM16.arr().write(|w| w.set_arr(u16::MAX));
    TIM16.tisel().write(|w| w.set_tisel(0, LSI));
    TIM16.ccmr_input(0).write(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4);
        w.set_icpsc(0, EVERY_FOURTH);
    });
    TIM16.ccer().write(|w| w.set_cce(0, true));
    TIM16.cr1().write(|w| w.set_cen(true));
    // The first edge comes at any time.
    let seen = capture().and_then(|_| Some(seen_hz(capture()?, capture()?, CORE_HZ)));
    TIM16.cr1().write(|w| w.set_cen(false));
    RCC.apb2enr().modify(|w| w.set_tim16en(false));
    let seen = seen.unwrap_or(0);
    (!PLAUSIBLE_HZ.contains(&seen)).then_some(seen)
}

/// The count at the next edge; `None` if none comes.
fn capture() -> Option<u16> {
    let captured = (0..MOST_READS).any(|_| TIM16.sr().read().ccif(0));
    // Reading the count clears the flag.
    captured.then(|| TIM16.ccr(0).read().ccr())
}
