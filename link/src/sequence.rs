//! Order of sequence numbers, which count modulo 65 536.
//!
//! `b` is newer than `a` if `0 < (b - a) mod 65 536 < 32 768`, and if the numbers of the session have not come to its first
//! one again: after 65 536 of them the session is used up. No frame that was a part of it is therefore newer than the last.

use core::cmp::Ordering;

/// Sequence number of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence(pub u16);

impl Sequence {
    /// The next sequence number.
    #[must_use]
    pub const fn next(self) -> Self {
        Self(self.0.wrapping_add(1))
    }

    /// `Greater` if `self` is newer than `other` in the session whose first number is `first`, `Less` if it is older.
    pub const fn compare(self, other: Self, first: Self) -> Ordering {
        match self.0.wrapping_sub(other.0) {
            0 => Ordering::Equal,
            1..0x8000 if self.since(first) > other.since(first) => Ordering::Greater,
            // A distance of exactly 32 768 is ambiguous; taking it as older leads to a rejection, which is safe.
            _ => Ordering::Less,
        }
    }

    const fn since(self, first: Self) -> u16 {
        self.0.wrapping_sub(first.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_newer_if_it_is_less_than_32_768_ahead_and_not_past_the_first_one() {
        for (first, a, b, expected) in [
            (0, 5, 4, Ordering::Greater),
            (65_000, 0, 65_535, Ordering::Greater),
            (0, 0, 65_535, Ordering::Less),
            (0, 4, 4, Ordering::Equal),
            (0, 4, 5, Ordering::Less),
            (10, 9, 10, Ordering::Less),
            (0, 32_767, 0, Ordering::Greater),
            (0, 32_768, 0, Ordering::Less),
            (7, 6, 5, Ordering::Greater),
            (7, 7, 6, Ordering::Less),
            (7, 8, 6, Ordering::Less),
        ] {
            assert_eq!(Sequence(a).compare(Sequence(b), Sequence(first)), expected, "{first}: {a} {b}");
        }
        assert_eq!(Sequence(65_535).next(), Sequence(0));
    }
}
