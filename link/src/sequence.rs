//! Which of two sequence numbers is newer.
//!
//! Numbers run 0 to 65 535 and on from 0. `b` is newer than `a` if it lies less than half of the circle ahead:
//! `0 < (b - a) mod 65 536 < 32 768`.

use core::cmp::Ordering;

/// The number of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence(pub u16);

impl Sequence {
    /// The number after this one.
    #[must_use]
    pub const fn next(self) -> Self {
        Self(self.0.wrapping_add(1))
    }

    /// `Greater` if this one is newer than `other`.
    pub const fn compare(self, other: Self) -> Ordering {
        match self.0.wrapping_sub(other.0) {
            0 => Ordering::Equal,
            1..0x8000 => Ordering::Greater,
            // Exactly half way round could be either; the careful answer is that it came late.
            _ => Ordering::Less,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newer_is_ahead_by_less_than_half_of_the_circle() {
        for (a, b, expected) in [
            (5, 4, Ordering::Greater),
            (0, 65_535, Ordering::Greater),
            (4, 4, Ordering::Equal),
            (4, 5, Ordering::Less),
            (32_767, 0, Ordering::Greater),
            (32_768, 0, Ordering::Less),
            (0, 32_768, Ordering::Less),
        ] {
            assert_eq!(Sequence(a).compare(Sequence(b)), expected, "{a} {b}");
        }
        assert_eq!(Sequence(65_535).next(), Sequence(0));
    }
}
