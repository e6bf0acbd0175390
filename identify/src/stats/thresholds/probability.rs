//! Limits that follow from the probability of a false alarm. Each stands beside its probability; a test derives it.

/// Declares limits beside the rule and the probability that they follow from, and lists them for the test.
macro_rules! limits {
    ($($(#[$doc:meta])+ $name:ident = $limit:literal, $rule:ident($probability:expr);)+) => {
        $($(#[$doc])+ pub const $name: f64 = $limit;)+

        #[cfg(test)]
        const ALL: &[(&str, f64, tests::Rule)] = &[$((stringify!($name), $limit, tests::Rule::$rule($probability))),+];
    };
}

limits! {
    /// Half the width of a 95 % interval, in standard deviations: the two-sided 5 % quantile of the standard normal distribution.
    Z = 1.959_963_984_540_054, TwoSided(0.05);
    /// Natural logarithm of the likelihood ratio, in nats, that a parameter may lose within its 95 % interval: half the square of
    /// [`Z`].
    NATS_WITHIN_INTERVAL = 1.920_729_410_347_063, LikelihoodRatio(0.05);
    /// Standard normal quantile that the statistic of a check of the residual exceeds in one of 10 000 records of noise; beyond it,
    /// the check finds unmodelled dynamics.
    Z_RARE = 3.719_016_485_455_68, OneSided(1e-4);
    /// Standard normal quantile that the regression of the residual exceeds in one of 15 records of noise; beyond it, the search
    /// goes on.
    Z_DOUBTFUL = 1.501_085_946_044_025, OneSided(1.0 / 15.0);
    /// Standard normal quantile that serial correlation exceeds in one of 100 records of noise, in a record that is too short for
    /// a regression.
    Z_SHORT_RECORD = 2.326_347_874_040_841, OneSided(0.01);
    /// Standard normal quantile that the variance of the means of stretches exceeds in one of 1000 records of independent noise;
    /// beyond it, prices are higher.
    Z_LONG_MEMORY = 3.090_232_306_167_813, OneSided(1e-3);
    /// Standard normal quantile of 95 %: the power with which an error as large as a margin is found.
    Z_POWER = 1.644_853_626_951_473, OneSided(0.05);
    /// Standard normal quantile of the difference of two errors over segments, which equally good models exceed in one of 100
    /// records; beyond it, one predicts worse.
    Z_WORSE = 2.326_347_874_040_841, OneSided(0.01);
    /// Number of standard errors beyond which the sensor's zero is wrong: one of 370 correct sensors exceeds it.
    Z_ZERO = 2.999_976_992_703_393, TwoSided(0.0027);
    /// Quantile of the correlation of Savage scores, multiplied by the square root of its degrees of freedom, that independent
    /// changes of 99 parts exceed with a probability of 2e-5, found by 2e7 random permutations. The scores have a skewed sum, so
    /// that it is above the normal distribution's 4.1.
    Z_IN_STEP = 4.6, Permutations(2e-5);
    /// Natural logarithm of the odds against a rival set of causes, in nats, below which the record cannot reject it: 20 to 1.
    RIVAL_ODDS = 2.995_732_273_553_991, Odds(1.0 / 20.0);
    /// Difference of two scores, in nats, beyond which a form of the same causes is left out of their intervals: a weight of 1 to 100.
    NATS_OF_A_FORM = 4.605_170_185_988_091, Odds(0.01);
    /// Difference of two scores, in nats, from which the less usual explanation is kept: readings that were cut off instead of
    /// rounded, a spring that lacks a part of the plant file. The odds are 20 to 1.
    CLEARLY_LIKELIER = 2.995_732_273_553_991, Odds(1.0 / 20.0);
    /// Gain in log-likelihood of a spectral line, less the logarithm of the number of lines that are searched, in nats, above
    /// which the line is structure: noise exceeds it with a probability of 6.14e-6.
    LINE_NATS = 12.0, Odds(6.144_212_353_328_21e-6);
    /// Negative logarithm, in nats, of the probability of differences that agree with a common step by chance, above which the
    /// step is that of a quantisation grid: the probability is 6.14e-6.
    CHANCE_NATS = 12.0, Odds(6.144_212_353_328_21e-6);
}

#[cfg(test)]
mod tests {
    use std::f64::consts::SQRT_2;

    use super::*;
    use random_numbers::Lcg64;

    /// How a limit follows from a probability.
    pub(super) enum Rule {
        OneSided(f64),
        TwoSided(f64),
        /// Half the square of the two-sided quantile.
        LikelihoodRatio(f64),
        /// Negative logarithm.
        Odds(f64),
        /// Over this number of permutations of the Savage scores.
        Permutations(f64),
    }

    /// Quantile of the standard normal distribution that is exceeded with a probability, by bisection.
    fn normal_quantile(probability: f64) -> f64 {
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let exceeded = 0.5 * libm::erfc(middle / SQRT_2);
            (low, high) = if exceeded > probability { (middle, high) } else { (low, middle) };
        }
        low
    }

    /// Fraction of 400 000 random permutations of 99 Savage scores whose correlation with the scores in order, multiplied by
    /// sqrt(98), exceeds `limit`.
    fn exceeded_by_permutations(limit: f64) -> f64 {
        let count = 99usize;
        let mut scores: Vec<f64> = (0..count).map(|rank| -(1.0 - (rank as f64 + 0.5) / count as f64).ln()).collect();
        let mean = scores.iter().sum::<f64>() / count as f64;
        scores.iter_mut().for_each(|score| *score -= mean);
        let power: f64 = scores.iter().map(|score| score * score).sum();
        let (mut permuted, mut numbers) = (scores.clone(), Lcg64::new(1));
        let mut exceeds = || {
            for last in (1..count).rev() {
                permuted.swap(last, (((numbers.draw() >> 32) * (last as u64 + 1)) >> 32) as usize);
            }
            let product: f64 = scores.iter().zip(&permuted).map(|(a, b)| a * b).sum();
            product / power * ((count - 1) as f64).sqrt() > limit
        };
        (0..400_000).filter(|_| exceeds()).count() as f64 / 400_000.0
    }

    #[test]
    fn every_limit_follows_from_its_probability() {
        for (name, limit, rule) in ALL {
            let exact = match *rule {
                Rule::OneSided(probability) => normal_quantile(probability),
                Rule::TwoSided(probability) => normal_quantile(probability / 2.0),
                Rule::LikelihoodRatio(probability) => 0.5 * normal_quantile(probability / 2.0).powi(2),
                Rule::Odds(probability) => -probability.ln(),
                Rule::Permutations(probability) => {
                    let counted = exceeded_by_permutations(*limit);
                    assert!((0.25..4.0).contains(&(counted / probability)), "{name}: {counted}");
                    continue;
                }
            };
            assert!((limit - exact).abs() < 1e-12, "{name}: {limit}, exactly {exact}");
        }
    }
}
