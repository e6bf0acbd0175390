//! Test of the processor's clock at the start, against the chip's low-speed oscillator (LSI), which also drives the watchdog.
//!
//! A timer on the processor's clock captures every [`PERIODS`]th edge of the LSI. Two captures give the LSI's frequency as the
//! processor sees it: 32 kHz if both clocks are right. A processor at half its speed sees 64 kHz.

use core::ops::RangeInclusive;

/// Periods of the LSI from one capture to the next.
pub const PERIODS: u32 = 4;

/// Frequencies of the LSI with which the clock passes, in Hz. Over all temperatures and supplies the LSI has 29.5 to 34 kHz
/// (manufacturer's data sheet), and the processor's oscillator is within 2 %. A clock that passes is wrong by at most 20 %.
pub const PLAUSIBLE_HZ: RangeInclusive<u32> = 28_900..=34_700;

/// The LSI's frequency as the processor sees it, in Hz, from the counts of a 16-bit timer at two captures in a row; `core_hz` is
/// the timer's nominal clock, in Hz. At 170 MHz two captures are 21 250 counts apart. The counter may wrap once between them:
/// only an LSI below a quarter of its frequency would be taken for a faster one.
pub fn seen_hz(first: u16, second: u16, core_hz: u32) -> u32 {
    let counts = u32::from(second.wrapping_sub(first)).max(1);
    (u64::from(core_hz) * u64::from(PERIODS) / u64::from(counts)).min(u64::from(u32::MAX)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORE_HZ: u32 = 170_000_000;

    #[test]
    fn a_clock_that_is_wrong_by_more_than_a_fifth_is_detected() {
        // Captures of an LSI of 32 kHz, by a processor that has this fraction of its speed, the counter's wrap included.
        let seen = |speed: f64, first: u16| {
            let counts = (f64::from(CORE_HZ) * speed * f64::from(PERIODS) / 32e3).round() as u32;
            seen_hz(first, first.wrapping_add(counts as u16), CORE_HZ)
        };
        for first in [0, 1, 44_286, 60_000, u16::MAX] {
            assert_eq!(seen(1.0, first), 32_000);
            for right in [0.95, 1.0, 1.05] {
                assert!(PLAUSIBLE_HZ.contains(&seen(right, first)), "{right}: {}", seen(right, first));
            }
            // 16 MHz: the multiplier of the clock has not started.
            for wrong in [16.0 / 170.0, 0.25, 0.5, 0.8, 1.25, 1.5, 2.0] {
                assert!(!PLAUSIBLE_HZ.contains(&seen(wrong, first)), "{wrong}: {}", seen(wrong, first));
            }
        }
    }

    #[test]
    fn captures_without_a_distance_are_not_plausible() {
        assert_eq!(seen_hz(7, 7, CORE_HZ), 680_000_000);
        assert!(!PLAUSIBLE_HZ.contains(&seen_hz(7, 7, CORE_HZ)));
        assert_eq!(seen_hz(7, 7, u32::MAX), u32::MAX, "it saturates");
    }
}
