//! Thresholds of the decision, and how each was measured.

/// Statistic of the sequential tests below which the sums are restarted, in nats: a third of the alarm threshold.
pub const RESTART_NATS: f64 = 7.0;
/// Most nats that one block adds to a sequential test, so that a single outlier raises no alarm.
pub const MOST_NATS: f64 = 5.0;
/// Excess of the leftover over the number of blocks, in standard deviations of white noise, that a named cause may leave.
pub const NOISE_SIGMAS: i64 = 5;
/// Part of the explained energy that a named cause may leave because its signature is linear: 2^-7.
pub const MODEL_ERROR_BITS: u32 = 7;
/// Part of the explained energy that a rival must leave to be excluded: 2^-10.
pub const RIVAL_ERROR_BITS: u32 = 10;
/// Ratio of a rival's excess to that of the best above which the rival is excluded.
pub const RIVAL_RATIO: i64 = 4;
/// Part of a vector's energy below which what is left of it counts as dependent on the vectors before: 2^-20.
pub const DEPENDENT_BITS: u32 = 20;
/// Number of decisions in a row that have to agree.
pub const AGREED: u8 = 3;
