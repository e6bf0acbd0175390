//! The linear congruential generator of Knuth's MMIX.

/// Linear congruential generator modulo 2^64 with the factors of Knuth's MMIX. The low bits have short periods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lcg64(u64);

impl Lcg64 {
    /// Returns a generator with a seed, any number.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Draws 64 bits, the whole state.
    pub const fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
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

    /// From 0 the first number is the addend; the others were computed with whole numbers of any length.
    #[test]
    fn sequence_is_that_of_the_factors() {
        let mut numbers = Lcg64::new(0);
        let expected = [1_442_695_040_888_963_407, 1_876_011_003_808_476_466, 11_166_244_414_315_200_793];
        assert_eq!(expected.map(|_| numbers.draw()), expected);
    }

    #[test]
    fn uniform_numbers_are_the_upper_53_bits() {
        assert_eq!(Lcg64::new(0).uniform(), (1_442_695_040_888_963_407u64 >> 11) as f64 / 9_007_199_254_740_992.0);
    }
}
