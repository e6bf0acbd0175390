//! The bank's definition: signature vectors, hypotheses, and the constants of the tests.
//!
//! Important terms:
//!
//! - *block*: the ticks over which voltage, model and residual are averaged ([`block_ticks`]).
//! - *signature*: the sensitivity of the reading to a cause, in V per unit of the cause's size; one number a block.
//! - *hypothesis*: a cause and the vectors that span its possible residuals ([`Hypothesis`]). A cause whose residual is not
//!   linear in its size has several vectors or several hypotheses.
//! - *nuisance*: a vector that stands for what the states of the faulty spring were when the fault began.

use super::Cause;

/// Number of vectors.
pub const VECTORS: usize = 48;
/// Largest number of vectors of a hypothesis.
pub const MOST: usize = 5;

/// Nuisance: `exp(-t / tau)` since the sums were restarted, 256 V at the restart.
pub const INITIAL: usize = 0;
/// Nuisance: `exp(-t / (3 tau))`.
pub const SLOW: usize = 1;
/// Nuisance: `exp(-t / (10 tau))`.
pub const SLOWER: usize = 2;
/// The model's stiffness `y`.
pub const GAIN: usize = 3;
/// `u - w`.
pub const SHARE: usize = 4;
/// `(1 - share) z`, `z` the low-pass of `w - u` with `tau`: the derivative by the logarithm of `tau`.
pub const TAU: usize = 5;
/// `(1 - share)` times twice the low-pass of `z` minus `z`: the second derivative, for large changes of `tau`.
pub const TAU_CURVED: usize = 6;
/// `(1 - share)` times the low-pass of `p (w - u)`, for a `tau` that changes with the voltage.
pub const TAU_VOLTAGE: usize = 7;
/// Low-pass of `u` with `3 tau`, minus `w`.
pub const CREEP: usize = 8;
/// Low-pass of `u` with `10 tau`, minus the one with `3 tau`.
pub const CREEP_SLOWER: usize = 9;
/// Minus the low-pass of `y` with `3 tau`.
pub const LEAKAGE: usize = 10;
/// Low-pass of `y` with `3 tau`, minus the one with `10 tau`.
pub const LEAKAGE_SLOWER: usize = 11;
/// Response to the distance of the narrowest play operator of [`PLAYS`] from `u`, for a width of the whole range.
pub const PLAY: usize = 12;
/// Response to the distance of the second play operator of [`PLAYS`] from `u`, for a width of the whole range.
pub const PLAY_SECOND: usize = 13;
/// The vector of the second play minus that of the first.
pub const PLAY_WIDER: usize = 14;
/// The vector of the third play minus that of the second.
pub const PLAY_WIDEST: usize = 15;
/// Response to `4 p (1 - p)` ranges.
pub const LAW: usize = 16;
/// Response to `8 p (1 - p) (p - 1/2)` ranges.
pub const LAW_CUBIC: usize = 17;
/// Response to the lack of a voltage that is held back above the first of [`LIMITS`], one range at the top.
pub const LIMIT: usize = 18;
/// Response to the lack of a voltage that is held back above the second of [`LIMITS`], minus [`LIMIT`].
pub const LIMIT_MIDDLE: usize = 19;
/// Response to the lack of a voltage that is held back above the third of [`LIMITS`], minus [`LIMIT`].
pub const LIMIT_TOP: usize = 20;
/// Response to the lag of a very fast slew, which is a pulse at each jump: `-sum(du |du|) / 2` per range.
pub const SLEW: usize = 21;
/// Response to the lag of a voltage with the first of [`SLEW_RATES`], times the rate in ranges per block.
pub const SLEW_FIRST: usize = 22;
/// Response to the lag of a voltage with the second of [`SLEW_RATES`], times the rate in ranges per block.
pub const SLEW_SECOND: usize = 23;
/// [`SLEW_FIRST`] minus [`SLEW`].
pub const SLEW_FASTER: usize = 24;
/// [`SLEW_SECOND`] minus [`SLEW_FIRST`].
pub const SLEW_MIDDLE: usize = 25;
/// The vector of the third rate minus [`SLEW_SECOND`].
pub const SLEW_SLOWER: usize = 26;
/// Minus the change of `y` from the end of the last block to the end of this: a very short delay.
pub const DELAY: usize = 27;
/// Minus the change of the mean `y` from a quarter of a block ago, times four; half, one, two and four blocks ago the next.
pub const DELAY_QUARTER: usize = 28;
/// See [`DELAY_QUARTER`].
pub const DELAY_HALF: usize = 29;
/// See [`DELAY_QUARTER`].
pub const DELAY_ONE: usize = 30;
/// See [`DELAY_QUARTER`].
pub const DELAY_TWO: usize = 31;
/// See [`DELAY_QUARTER`].
pub const DELAY_FOUR: usize = 32;
/// The vector of a quarter of a block minus [`DELAY`]; in the same way the next, up to eight blocks.
pub const DELAY_TO_QUARTER: usize = 33;
/// See [`DELAY_TO_QUARTER`].
pub const DELAY_TO_HALF: usize = 34;
/// See [`DELAY_TO_QUARTER`].
pub const DELAY_TO_ONE: usize = 35;
/// See [`DELAY_TO_QUARTER`].
pub const DELAY_TO_TWO: usize = 36;
/// See [`DELAY_TO_QUARTER`].
pub const DELAY_TO_FOUR: usize = 37;
/// See [`DELAY_TO_QUARTER`].
pub const DELAY_TO_EIGHT: usize = 38;
/// Low-pass of `y` with the first of [`LAG_TAUS`], minus `y`, times blocks per time constant.
pub const LAG: usize = 39;
/// Low-pass of `y` with the second of [`LAG_TAUS`], minus `y`, times blocks per time constant.
pub const LAG_SECOND: usize = 40;
/// [`LAG`] minus [`DELAY`].
pub const LAG_SHORTER: usize = 41;
/// [`LAG_SECOND`] minus [`LAG`].
pub const LAG_MIDDLE: usize = 42;
/// The vector of the third time constant minus [`LAG_SECOND`].
pub const LAG_LONGER: usize = 43;
/// 1 V.
pub const OFFSET: usize = 44;
/// `y k / 2048`, `k` the number of blocks since the sums were restarted, at most 2048.
pub const DRIFT: usize = 45;
/// The residual where the readings are identical and below the model; otherwise 0.
pub const PINNED_BELOW: usize = 46;
/// The residual where the readings are identical; otherwise 0.
pub const PINNED: usize = 47;

/// Widths of the play operators, as fractions of the range.
pub const PLAYS: [f64; 3] = [0.007, 0.03, 0.1];
/// Voltages above which the amplifier holds back, as fractions of the range.
pub const LIMITS: [f64; 3] = [0.45, 0.65, 0.85];
/// Slew rates, in ranges per time constant of the spring.
pub const SLEW_RATES: [f64; 3] = [16.0, 5.0, 1.6];
/// Time constants of the lags in series, as fractions of the spring's.
pub const LAG_TAUS: [f64; 3] = [0.04, 0.12, 0.35];
/// Time constants of the slow vectors, as multiples of the spring's.
pub const SLOW_TAUS: [f64; 2] = [3.0, 10.0];

/// A cause and the vectors that span the residuals it can leave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis {
    /// The cause.
    pub cause: Cause,
    /// The vectors that span its residuals, the principal one last: its coefficient is the size in units of [`super::Settings::unit`].
    pub vectors: &'static [usize],
    /// Smallest possible size.
    pub lowest: f64,
    /// Largest possible size.
    pub highest: f64,
}

const fn of(cause: Cause, vectors: &'static [usize], lowest: f64, highest: f64) -> Hypothesis {
    Hypothesis { cause, vectors, lowest, highest }
}

/// The hypotheses. The first vector is the nuisance [`INITIAL`], except of pinned readings. A drift has changed the gain by the time of the
/// restart: it has [`GAIN`] as a further nuisance.
pub const HYPOTHESES: [Hypothesis; 26] = [
    of(Cause::GainError, &[INITIAL, GAIN], -0.7, 4.0),
    of(Cause::InstantaneousShare, &[INITIAL, SHARE], -0.1, 0.8),
    of(Cause::TimeConstant, &[INITIAL, TAU_CURVED, TAU], -1.5, 1.5),
    of(Cause::VoltageDependentTimeConstant, &[INITIAL, TAU_CURVED, TAU, TAU_VOLTAGE], -3.0, 3.0),
    of(Cause::SecondRelaxation, &[INITIAL, SLOW, SLOWER, CREEP_SLOWER, CREEP], 0.0, 0.9),
    of(Cause::ChargeLeakage, &[INITIAL, SLOW, SLOWER, LEAKAGE_SLOWER, LEAKAGE], 0.0, 0.9),
    of(Cause::Hysteresis, &[INITIAL, PLAY_WIDER, PLAY], 0.0, 0.4),
    of(Cause::Hysteresis, &[INITIAL, PLAY_WIDEST, PLAY_SECOND], 0.0, 0.4),
    of(Cause::StaticNonlinearity, &[INITIAL, GAIN, LAW_CUBIC, LAW], -0.15, 0.15),
    of(Cause::AmplifierLimit, &[INITIAL, LIMIT_TOP, LIMIT_MIDDLE, LIMIT], 0.0, 1.0),
    of(Cause::AmplifierSlew, &[INITIAL, SLEW_FASTER, SLEW], 0.0, 200.0),
    of(Cause::AmplifierSlew, &[INITIAL, SLEW_MIDDLE, SLEW_FIRST], 0.0, 200.0),
    of(Cause::AmplifierSlew, &[INITIAL, SLEW_SLOWER, SLEW_SECOND], 0.0, 200.0),
    of(Cause::Delay, &[INITIAL, DELAY_TO_QUARTER, DELAY], 0.0, 200.0),
    of(Cause::Delay, &[INITIAL, DELAY_TO_HALF, DELAY_QUARTER], 0.0, 200.0),
    of(Cause::Delay, &[INITIAL, DELAY_TO_ONE, DELAY_HALF], 0.0, 200.0),
    of(Cause::Delay, &[INITIAL, DELAY_TO_TWO, DELAY_ONE], 0.0, 200.0),
    of(Cause::Delay, &[INITIAL, DELAY_TO_FOUR, DELAY_TWO], 0.0, 200.0),
    of(Cause::Delay, &[INITIAL, DELAY_TO_EIGHT, DELAY_FOUR], 0.0, 200.0),
    of(Cause::SeriesLag, &[INITIAL, LAG_SHORTER, DELAY], 0.0, 200.0),
    of(Cause::SeriesLag, &[INITIAL, LAG_MIDDLE, LAG], 0.0, 200.0),
    of(Cause::SeriesLag, &[INITIAL, LAG_LONGER, LAG_SECOND], 0.0, 200.0),
    of(Cause::ReadingOffset, &[INITIAL, OFFSET], -1000.0, 1000.0),
    of(Cause::Drift, &[INITIAL, GAIN, DRIFT], -1000.0, 1000.0),
    of(Cause::SensorSaturation, &[PINNED_BELOW], 0.9, 1.1),
    of(Cause::StuckSensor, &[PINNED], 0.9, 1.1),
];

/// Pairs of causes of which the second contains the first: it always leaves less, and is named only if the first is excluded, and not by
/// the bounds of its size alone.
pub const NESTED: [(Cause, Cause); 4] = [
    (Cause::GainError, Cause::StaticNonlinearity),
    (Cause::GainError, Cause::Drift),
    (Cause::TimeConstant, Cause::VoltageDependentTimeConstant),
    (Cause::SensorSaturation, Cause::StuckSensor),
];

/// Errors `a` and `b` of the signatures of each cause, in the order of [`Cause::ALL`]. Half of the width of the 95 % interval of a size is
/// the standard deviation that the noise leaves it, times the root of `1.96^2 + a^2 E + b^2 F`: `E` is the energy that the fit leaves above
/// that of the noise, `F` the energy that it explains, in variances.
///
/// `E` is the visible part of what the signatures do not describe. `F` stands for the part that is not visible: in the noise, or in a short
/// time. A gain, a share, an offset and a drift are linear in their size and have no error. Each pair gives the narrowest intervals on
/// seeds from 700 000 that contain 95 % of the sizes at the end of the runs, at 0.2 and at 1 % of noise, and 90 % of those at the first
/// name.
pub const SIGNATURE_ERRORS: [(f64, f64); Cause::ALL.len()] = [
    (0.0, 0.0),
    (0.0, 0.0),
    (2.0, 0.0075),
    (4.0, 0.06),
    (2.0, 0.015),
    (5.0, 0.01),
    (1.0, 0.02),
    (0.3, 0.005),
    (0.7, 0.0),
    (1.0, 0.03),
    (0.3, 0.02),
    (1.5, 0.0075),
    (0.0, 0.0),
    (0.0, 0.0),
    (0.0, 0.0),
    (0.0, 0.0),
];

/// Vectors with a sequential test, and the smallest size of interest in units of [`super::Settings::unit`].
pub const SMALLEST: [(usize, f64); 11] = [
    (GAIN, 0.005),
    (SHARE, 0.005),
    (TAU, 0.02),
    (CREEP, 0.02),
    (LEAKAGE, 0.01),
    (PLAY_SECOND, 0.006),
    (LAW, 0.004),
    (LIMIT, 0.015),
    (SLEW, 1.0),
    (DELAY, 0.025),
    (OFFSET, 1.0),
];

/// Vectors of the errors that the model may have: of time constant, share and gain, as [`super::Tolerance`].
pub const DOUBTFUL: [usize; 3] = [TAU, SHARE, GAIN];

/// Number of blocks from one decision to the next.
pub const ROUND: u32 = 20;
/// Smallest number of readings of a block, as a fraction of the expected number in 256ths; a block with fewer is left out.
pub const FEWEST: u32 = 192;
/// Largest fraction of a distance that a low-pass covers in one block: shorter time constants count as this one.
pub const FASTEST: f64 = 0.499;
/// Largest number of blocks in the sums; they are halved when it is reached.
pub const MOST_BLOCKS: u32 = 2048;

/// Changes of the voltage in one tick that are no jump, in V.
pub const SMOOTH_V: f64 = 1.0;
/// Number of ticks from one step of a slewed voltage to the next.
pub const SLEW_TICKS: u32 = 4;

/// Returns the number of ticks of a block: 128 or a larger power of two, at least 100 ms.
pub const fn block_ticks(rate_hz: f64) -> u32 {
    let mut ticks = 128;
    while (ticks as f64) < 0.1 * rate_hz {
        ticks *= 2;
    }
    ticks
}

/// Returns the length of a block, in s.
pub const fn block_s(rate_hz: f64) -> f64 {
    block_ticks(rate_hz) as f64 / rate_hz
}
