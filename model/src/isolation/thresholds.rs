//! Thresholds of the decision, and how each was measured: in runs as of `docs/isolation.md` with noise of 0.2 %, on seeds from
//! 700 000, which no table has.

/// Statistic of the sequential tests below which the sums are restarted, in nats.
pub const RESTART_NATS: f64 = 7.0;
/// Most nats that one block adds to a sequential test, so that a single outlier raises no alarm.
pub const MOST_NATS: f64 = 5.0;
/// Excess of the leftover over the number of blocks, in standard deviations of white noise, that a named cause may leave.
pub const NOISE_SIGMAS: i64 = 5;
/// Part of the explained energy that a named cause may leave because its signature is linear: 2^-7.
///
/// When it was chosen, before the other thresholds were, 83, 80 and 75 % of the runs ended with the right name at 2^-6, 2^-7 and 2^-8,
/// 1.1, 0.3 and 0.3 % with a wrong one.
pub const MODEL_ERROR_BITS: u32 = 7;
/// Part of the explained energy that a rival must leave to be excluded: 2^-10.
///
/// When it was chosen, 77 and 83 % of the runs ended with the right name at 2^-8 and 2^-10; in 3.9 and 4.9 % the first name was wrong.
pub const RIVAL_ERROR_BITS: u32 = 10;
/// Ratio of a rival's excess to that of the best above which the rival is excluded.
pub const RIVAL_RATIO: i64 = 4;
/// Part of a vector's energy below which what is left of it counts as dependent on the vectors before: 2^-20.
pub const DEPENDENT_BITS: u32 = 20;
/// Number of decisions in a row that have to agree. With 2 and 3 the first name was wrong in 3.3 and 2.2 % of the
/// runs when it was chosen. As many against a name withdraw it.
pub const AGREED: u8 = 3;
