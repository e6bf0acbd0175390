//! The xorshift generator of Marsaglia with 64 bits.

/// Xorshift generator of Marsaglia with shifts of 13, 7 and 17: each number from 1 to 2^64 - 1 once in its period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Xorshift64(u64);

impl Xorshift64 {
    /// Returns a generator with a seed; 0, from which no other number follows, counts as 1.
    pub const fn new(seed: u64) -> Self {
        Self(if seed == 0 { 1 } else { seed })
    }

    /// Draws a number, 1 to 2^64 - 1.
    pub const fn draw(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Draws a number from 0 to less than 1, a multiple of 2^-53.
    pub const fn uniform(&mut self) -> f64 {
        crate::uniform(self.draw())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marsaglia's paper has the first number for its seed, 88172645463325252.
    #[test]
    fn sequence_is_the_published_one() {
        assert_eq!(Xorshift64::new(88_172_645_463_325_252).draw(), 8_748_534_153_485_358_512);
        let mut numbers = Xorshift64::new(1);
        assert_eq!([(); 2].map(|()| numbers.draw()), [1_082_269_761, 1_152_992_998_833_853_505]);
    }

    #[test]
    fn seed_of_0_counts_as_1() {
        assert_eq!(Xorshift64::new(0), Xorshift64::new(1));
    }
}
