//! What the bank says: in the numbers of the tick, and in SI units.

use super::bank::{HYPOTHESES, SIGNATURE_ERRORS};
use super::decision::Size;
use super::{Cause, Settings, Verdict};

/// What the bank says, in the numbers of the tick: the same bits on every machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// The verdict.
    pub verdict: Verdict,
    /// Number of blocks since the fault began: since the last restart of the sums; 0 without an alarm.
    pub since_blocks: u32,
    /// Size of the verdict's cause at the last decision.
    pub(super) size: Size,
    /// Energy of the innovations without a cause at the last decision, and what the best cause leaves of it, in variances with 20
    /// fraction bits.
    pub(super) energies: (i64, i64),
    /// Number of blocks of the last decision.
    pub(super) blocks: u32,
}

/// The cause that explains most, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The cause.
    pub cause: Cause,
    /// The other cause if the verdict is ambiguous.
    pub other: Option<Cause>,
    /// Size of the cause, in the unit of [`Cause::unit`].
    pub size: f64,
    /// Half of the width of the 95 % interval of the size, in the same unit: that of the noise and of the signature's error
    /// ([`bank::SIGNATURE_ERRORS`](super::bank::SIGNATURE_ERRORS)). If the readings do not determine the size, the interval holds every
    /// possible one.
    pub half_width: f64,
    /// Part of the residual's energy, its noise included, that the cause explains, 0 to 1.
    pub explained: f64,
}

/// Returns `2^exponent`, for exponents of normal numbers.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

impl Report {
    /// Returns the energy of the innovations that no cause explains and what the best cause leaves, in variances, at the last
    /// decision. Floating point: not for the tick, nor are the next two.
    pub fn energies(&self) -> (f64, f64) {
        let (none, left) = self.energies;
        (none as f64 / 1_048_576.0, left as f64 / 1_048_576.0)
    }

    /// Returns the size of the verdict's cause in units of [`Settings::unit`] and its standard deviation, at the last decision.
    pub fn size(&self) -> (f64, f64) {
        let Size { numerator, denominator, exponent, scale } = self.size;
        if denominator <= 0 {
            return (0.0, 0.0);
        }
        let denominator = f64::from(denominator);
        let size = f64::from(numerator) / denominator * power_of_two(exponent.into());
        let information = denominator * power_of_two(2 * i32::from(scale) - 20);
        (size, 1.0 / libm::sqrt(information))
    }

    /// Returns the cause that explains most in SI units, for a bank with these settings and ticks of `rate_hz`; `None` unless one is
    /// named or two are ambiguous.
    pub fn finding(&self, settings: &Settings, rate_hz: f64) -> Option<Finding> {
        let (cause, other) = self.verdict.causes();
        let cause = cause?;
        let factor = settings.unit(cause, rate_hz);
        let (size, half_width) = self.interval(cause);
        let (none, left) = self.energies();
        let explained = 1.0 - left / none.max(left);
        Some(Finding { cause, other, size: factor * size, half_width: factor * half_width, explained })
    }

    /// Returns the size in units of [`Settings::unit`] and half of the width of its 95 % interval.
    fn interval(&self, cause: Cause) -> (f64, f64) {
        let hypothesis = HYPOTHESES.iter().find(|hypothesis| hypothesis.cause == cause);
        let (size, deviation) = self.size();
        if deviation <= 0.0 {
            return hypothesis.map_or((0.0, 0.0), |possible| {
                (0.5 * (possible.lowest + possible.highest), 0.5 * (possible.highest - possible.lowest))
            });
        }
        let (none, left) = self.energies();
        let (of_excess, of_explained) = SIGNATURE_ERRORS.get(cause as usize).copied().unwrap_or_default();
        let excess = (left - f64::from(self.blocks)).max(0.0);
        let explained = (none - left).max(0.0);
        let variances = 1.96 * 1.96 + of_excess * of_excess * excess + of_explained * of_explained * explained;
        (size, deviation * libm::sqrt(variances))
    }
}

#[cfg(test)]
impl Report {
    /// A report of tests: the size is a multiple of 2^-20 below 128, its deviation about 2^-10; `energy` is that of a block without
    /// that of the noise, in variances.
    pub(crate) fn of(verdict: Verdict, since_blocks: u32, size: f64, energy: u32) -> Self {
        let size = Size { numerator: (size * f64::from(1 << 20)) as i32, denominator: 1 << 20, exponent: 0, scale: 10 };
        let none = i64::from(since_blocks) * (1 + i64::from(energy));
        Self { verdict, since_blocks, size, energies: (none << 20, 0), blocks: since_blocks }
    }

    /// This report of a cause whose size the readings do not determine.
    pub(crate) fn without_size(self) -> Self {
        Self { size: Size::default(), ..self }
    }
}
