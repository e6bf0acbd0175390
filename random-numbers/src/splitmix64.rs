//! The generator SplitMix64.

/// SplitMix64 of Steele, Lea and Flood: a counter whose bits are mixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// Returns a generator with a seed, any number.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Draws 64 bits.
    pub const fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Draws a number from 0 to less than 1, a multiple of 2^-53.
    pub const fn uniform(&mut self) -> f64 {
        crate::uniform(self.draw())
    }

    /// Draws a nearly normal number of mean 0 and variance 1: the sum of twelve uniform numbers, less 6.
    pub fn normal(&mut self) -> f64 {
        crate::normal(|| self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers of the authors' program with the seed 1234567.
    #[test]
    fn sequence_is_the_published_one() {
        let mut numbers = SplitMix64::new(1_234_567);
        let published = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(published.map(|_| numbers.draw()), published);
    }
}
