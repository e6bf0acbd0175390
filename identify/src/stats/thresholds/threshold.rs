//! A limit with its unit and its decision, which the feature `sensitivity` lets a process change.

/// An empirical limit of one decision.
#[derive(Clone, Copy, Debug)]
pub struct Threshold {
    /// Index in [`ALL`](super::empirical::ALL).
    pub index: usize,
    /// Name of the constant.
    pub name: &'static str,
    /// Value, in the unit.
    pub value: f64,
    /// Unit of the value; what a fraction is a fraction of.
    pub unit: &'static str,
    /// Sentence on the decision.
    pub decision: &'static str,
    /// Command whose counts set the value; empty if the history names none.
    pub set_by: &'static str,
}

impl Threshold {
    /// Returns the value, in the unit; a constant without the feature `sensitivity`.
    #[cfg(not(feature = "sensitivity"))]
    #[inline(always)]
    pub const fn get(self) -> f64 {
        self.value
    }

    /// Returns the value, in the unit, multiplied by the factor of [`vary`] if that names this threshold.
    #[cfg(feature = "sensitivity")]
    #[inline]
    pub fn get(self) -> f64 {
        variation::factor(self.index) * self.value
    }

    /// Returns the value as a number of rows, readings or periods.
    #[inline(always)]
    pub fn count(self) -> usize {
        self.get().round() as usize
    }
}

#[cfg(feature = "sensitivity")]
pub use variation::vary;

#[cfg(feature = "sensitivity")]
mod variation {
    use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

    use super::Threshold;

    /// Index of the threshold that varies; none at first.
    static VARIED: AtomicUsize = AtomicUsize::new(usize::MAX);
    /// Bits of the factor on its value.
    static FACTOR: AtomicU64 = AtomicU64::new(0);

    /// Multiplies one threshold by `factor` in the whole process and restores all others; `None` restores all. No diagnosis may
    /// run meanwhile.
    pub fn vary(varied: Option<(Threshold, f64)>) {
        let (index, factor) = varied.map_or((usize::MAX, 1.0), |(threshold, factor)| (threshold.index, factor));
        FACTOR.store(factor.to_bits(), Ordering::Relaxed);
        VARIED.store(index, Ordering::Relaxed);
    }

    #[inline]
    pub(super) fn factor(index: usize) -> f64 {
        if VARIED.load(Ordering::Relaxed) == index { f64::from_bits(FACTOR.load(Ordering::Relaxed)) } else { 1.0 }
    }
}
