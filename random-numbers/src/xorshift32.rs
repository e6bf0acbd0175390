//! The xorshift generator of Marsaglia.

/// Xorshift generator of Marsaglia with shifts of 13, 17 and 5: each number from 1 to 2^32 - 1 once in its period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Xorshift32(u32);

impl Xorshift32 {
    /// Returns a generator with a seed; 0, from which no other number follows, counts as 1.
    pub const fn new(seed: u32) -> Self {
        Self(if seed == 0 { 1 } else { seed })
    }

    /// Draws a number, 1 to 2^32 - 1.
    pub const fn draw(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marsaglia's paper has the second number for its seed, 2463534242.
    #[test]
    fn sequence_is_the_published_one() {
        assert_eq!(Xorshift32::new(2_463_534_242).draw(), 723_471_715);
        let mut numbers = Xorshift32::new(1);
        assert_eq!([(); 3].map(|()| numbers.draw()), [270_369, 67_634_689, 2_647_435_461]);
    }

    #[test]
    fn seed_of_0_counts_as_1() {
        assert_eq!(Xorshift32::new(0), Xorshift32::new(1));
    }
}
