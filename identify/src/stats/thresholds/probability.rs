//! Limits that follow from the probability of a false alarm: quantiles of a standard normal statistic, and odds in nats.

/// Half the width of a 95 % interval, in standard deviations: the 97.5 % quantile of the standard normal distribution.
pub const Z: f64 = 1.96;
/// Natural logarithm of the likelihood ratio, in nats, that a parameter may lose within its 95 % interval.
pub const NATS_WITHIN_INTERVAL: f64 = 2.0;
/// Standard normal quantile that the statistic of a check of the residual exceeds in one of 10 000 records of noise; beyond it,
/// the check finds unmodelled dynamics.
pub const Z_RARE: f64 = 3.72;
/// Standard normal quantile that the regression of the residual exceeds in one of 15 records of noise; beyond it, the search
/// goes on.
pub const Z_DOUBTFUL: f64 = 1.5;
/// Standard normal quantile that serial correlation exceeds in one of 100 records of noise, in a record that is too short for a
/// regression.
pub const Z_SHORT_RECORD: f64 = 2.33;
/// Standard normal quantile that the variance of the means of stretches exceeds in one of 1000 records of independent noise;
/// beyond it, prices are higher.
pub const Z_LONG_MEMORY: f64 = 3.09;
/// Standard normal quantile of 95 %: the power with which an error as large as a margin is found.
pub const Z_POWER: f64 = 1.64;
/// Number of standard errors beyond which the sensor's zero is wrong.
pub const Z_ZERO: f64 = 3.0;
/// Quantile of the correlation of Savage scores, multiplied by the square root of its degrees of freedom, that noise exceeds in one
/// of 10 000 records; the scores have a skewed sum, so that it is above the normal distribution's 3.72.
pub const Z_IN_STEP: f64 = 4.6;
/// Odds against a rival set of causes, in nats, below which the record cannot reject it.
pub const RIVAL_ODDS: f64 = 3.0;
/// Difference of two scores, in nats, from which the less usual explanation is kept: readings that were cut off instead of
/// rounded, a spring that lacks a part of the plant file.
pub const CLEARLY_LIKELIER: f64 = 3.0;
/// Gain in log-likelihood of a spectral line, less the logarithm of the number of lines that are searched, in nats, above which
/// the line is structure.
pub const LINE_NATS: f64 = 12.0;
/// Negative logarithm, in nats, of the probability of differences that agree with a common step by chance, above which the step
/// is that of a quantisation grid.
pub const CHANCE_NATS: f64 = 12.0;
