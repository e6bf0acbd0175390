//! The linear congruential generator of *Numerical Recipes*.

/// Linear congruential generator modulo 2^32 with the factors of *Numerical Recipes*. The low bits have short periods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lcg32(u32);

impl Lcg32 {
    /// Returns a generator with a seed, any number.
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }

    /// Draws 32 bits, the whole state.
    pub const fn draw(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0
    }

    /// Draws a number from 0 to less than 1, a multiple of 2^-24.
    pub fn uniform(&mut self) -> f64 {
        f64::from(self.draw() >> 8) / f64::from(1 << 24)
    }

    /// Draws a nearly normal number of mean 0 and variance 1: the sum of twelve uniform numbers, less 6.
    pub fn normal(&mut self) -> f64 {
        crate::normal(|| self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers in *Numerical Recipes in C*, section 7.1.
    #[test]
    fn sequence_is_the_published_one() {
        let mut numbers = Lcg32::new(0);
        let published = [0x3c6e_f35f, 0x4750_2932, 0xd1cc_f6e9, 0xaaf9_5334, 0x6252_e503];
        assert_eq!(published.map(|_| numbers.draw()), published);
    }

    #[test]
    fn uniform_numbers_are_the_upper_24_bits() {
        assert_eq!(Lcg32::new(0).uniform(), f64::from(0x3c_6ef3) / 16_777_216.0);
    }

    #[test]
    fn normal_numbers_have_mean_0_and_variance_1() {
        let mut numbers = Lcg32::new(1);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..100_000 {
            let number = numbers.normal();
            sum += number;
            squares += number * number;
        }
        assert!((sum / 1e5).abs() < 0.01 && (squares / 1e5 - 1.0).abs() < 0.02, "{sum} {squares}");
    }
}
