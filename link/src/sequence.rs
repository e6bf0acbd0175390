//! Order of sequence numbers, which count modulo 65 536.
//!
//! `b` is newer than `a` if
//! `0 < (b - a) mod 65 536 < 32 768`.

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

    /// `Greater` if `self` is newer than `other`, `Less` if it is older.
    pub const fn compare(self, other: Self) -> Ordering {
        match self.0.wrapping_sub(other.0) {
            0 => Ordering::Equal,
            1..0x8000 => Ordering::Greater,
            // A distance of exactly 32 768 is ambiguous; taking it as older leads to a rejection, which is safe.
            _ => Ordering::Less,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_newer_if_it_is_less_than_32_768_ahead() {
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
