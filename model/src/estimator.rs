//! The stiffness estimator: the spring's relaxation, run on the voltage that was really applied.
//!
//! Important terms:
//!
//! - *plant*: the spring's response to its voltage, in SI units ([`Plant`], [`crate::ExtendedPlant`]).
//! - *feedthrough* or *share*: the part of a change of voltage that the stiffness follows instantaneously, in V/V.
//! - *relaxed part*, `w`: the state of the plant, in V, which follows the voltage `u` with the time constant `tau`.
//! - *operating point*: a voltage and the stiffness that it would give instantaneously ([`OperatingPoint`]).
//! - *prediction*: the stiffness before the coming tick and at its end while the voltage stays ([`Prediction`]).
//! - *step gain*: bounds of what one volt more does now and in one tick ([`StepGain`]).
//!
//! The plant of the source report's section 4.2.2 is a unity feedback loop around a proportional-integral block,
//! `u = Kp e + Ki integral(e)` with `Kp = 0.1` and `Ki = 0.2 1/s`. The closed loop is
//!
//! ```text
//! y/u = (Kp s + Ki) / ((1 + Kp) s + Ki)
//!     = share + (1 - share) / (1 + tau s),   share = Kp / (1 + Kp),   tau = (1 + Kp) / Ki
//! ```
//!
//! a feedthrough of 1/11 and a relaxation of 5.5 s. In state space:
//!
//! ```text
//! y = w + share (u - w),   dw/dt = (u - w) / tau
//! ```
//!
//! The amplifier holds its voltage between ticks, and for a held `u` the tick is exact, not an approximation:
//! `w' = w + (1 - exp(-T / tau)) (u - w)`. `w` is always between voltages that were applied, so no sum here can
//! overflow.

use core::fmt::Debug;

use crate::coefficient::{Gain, Rate, WideGain, upper};
use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, ScaledStiffness, Signal, Volts};
use crate::validated::{Validate, Validated};

/// A spring in SI units that can be quantized for one sample time.
pub trait Model: Validate + Copy {
    /// The quantized spring.
    type Config: Estimator;

    /// Rounds the validated spring to fixed-point numbers; also available as `Validated::quantize`.
    fn quantize(plant: Validated<'_, Self>) -> Self::Config;

    /// Returns the largest step gain that the spring has at any voltage and in any direction.
    fn largest_step_gain(&self, sample_time: SampleTime) -> StepGain;

    /// Returns the smallest step gain that the spring has at any voltage, in the direction in which the voltage turns.
    fn smallest_step_gain(&self, sample_time: SampleTime) -> StepGain {
        self.largest_step_gain(sample_time)
    }

    /// Checks that more voltage always gives more stiffness, so that the spring can be inverted.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field that prevents it.
    fn check_inverse(&self) -> Result<(), OutOfRange> {
        Ok(())
    }

    /// Checks this spring with its time constants and its share multiplied by `factors`, at a constant settled value.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field that would be outside its allowed range.
    fn check_differing(&self, factors: (f64, f64), sample_time: SampleTime) -> Result<(), OutOfRange>;

    /// Quantizes this spring with its time constants and its share multiplied by `factors`, with its inverse.
    fn differing(plant: Validated<'_, Self>, factors: (f64, f64), resolution_v: f64) -> Invertible<Self::Config>;

    /// Quantizes the inverse of this spring, which has become `config`; `resolution_v` is the voltage of one DAC code.
    /// The inverse of a spring that [`Model::check_inverse`] rejects saturates: it is safe to run, and of no use.
    fn inverse(
        plant: Validated<'_, Self>,
        config: &Self::Config,
        resolution_v: f64,
    ) -> <Self::Config as Estimator>::Inverse;
}

/// A quantized spring with what a pre-compensator needs to invert it.
#[cfg_attr(not(feature = "robust"), allow(dead_code, reason = "only the robust pre-compensator needs all of it"))]
#[derive(Clone, Copy, Debug)]
pub struct Invertible<E: Estimator> {
    pub(crate) estimator: E,
    pub(crate) inverse: E::Inverse,
    pub(crate) largest: StepGain,
    pub(crate) smallest: StepGain,
}

impl<E: Estimator> Invertible<E> {
    /// Quantizes a spring with its inverse; `resolution_v` is the voltage of one DAC code.
    pub(crate) fn new<P: Model<Config = E>>(plant: Validated<'_, P>, resolution_v: f64) -> Self {
        let (settings, sample_time, estimator) = (plant.settings(), plant.sample_time(), P::quantize(plant));
        Self {
            estimator,
            inverse: P::inverse(plant, &estimator, resolution_v),
            largest: settings.largest_step_gain(sample_time),
            smallest: settings.smallest_step_gain(sample_time),
        }
    }
}

impl<P: Model> Validated<'_, P> {
    /// Rounds the validated spring to the fixed-point numbers that a tick sees.
    ///
    /// ```
    /// use model::estimator::Estimator;
    /// use model::{OutOfRange, Plant, SampleTime, Validate, Volts, estimator};
    ///
    /// fn main() -> Result<(), OutOfRange> {
    ///     let plant = Plant { share: 0.1, time_constant_s: 2.0 };
    ///     let config = plant.validate(SampleTime::from_rate(1000.0)?)?.quantize();
    ///     let mut state = estimator::State::default();
    ///     let applied = Volts::new(500.0)?;
    ///     // 10 % of the step is there instantaneously, the rest relaxes with 2 s.
    ///     assert_eq!(config.run(&mut state, applied).to_f64().round(), 50.0);
    ///     for _ in 1..2000 {
    ///         config.run(&mut state, applied);
    ///     }
    ///     let exact = 500.0 * (1.0 - 0.9 * f64::exp(-1.0));
    ///     assert!((config.run(&mut state, applied).to_f64() - exact).abs() < 1e-4);
    ///     Ok(())
    /// }
    /// ```
    pub fn quantize(self) -> P::Config {
        P::quantize(self)
    }
}

/// A quantized spring that runs once per tick, on the voltage that was really applied.
pub trait Estimator: Copy {
    /// State of the spring; the default is a spring at rest at 0 V.
    type State: Copy + Default;
    /// Quantized inverse of the spring, from a change of stiffness to a voltage.
    type Inverse: Copy + Debug + Eq;

    /// Returns the stiffness just after `applied` was put across the spring, and holds that voltage for one sample
    /// time.
    fn run(&self, state: &mut Self::State, applied: Volts) -> ScaledStiffness;

    /// Returns a point on the curve of the stiffness over the voltage applied now.
    fn operating_point(&self, state: &Self::State) -> OperatingPoint;

    /// Returns the stiffness now and at the end of the coming tick if the `applied` voltage of the last tick stays.
    fn predict(&self, state: &Self::State, applied: Volts) -> Prediction;

    /// Returns the voltage with which the stiffness at the end of the coming tick is `change` V above the one with
    /// `applied`.
    fn voltage_for(&self, state: &Self::State, inverse: &Self::Inverse, applied: Volts, change: Signal) -> Volts;
}

/// Stiffness before the coming tick and at its end, both under the last voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prediction {
    pub(crate) now: Signal,
    pub(crate) end: Signal,
}

/// Largest gain of an inverse, in V of voltage per V of stiffness. A higher one would only amplify rounding errors.
const MAX_INVERSE_GAIN: f64 = 8192.0;

/// Returns the gain of the inverse, in V of voltage per V of stiffness, for a step gain of `within_a_tick` V/V, bounded
/// by `MAX_INVERSE_GAIN`.
pub(crate) fn inverse_gain(within_a_tick: f64) -> f64 {
    (1.0 / within_a_tick).min(MAX_INVERSE_GAIN)
}

/// Response of the stiffness to one volt more, in V/V: what it does now, and what one more tick adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepGain {
    /// Change of the stiffness at the moment of the step, in V/V.
    pub feedthrough: f64,
    /// Further change of the stiffness by the end of one tick, in V/V.
    pub in_one_tick: f64,
    /// Fraction of its distance that the relaxation covers in one tick, 0 to 1.
    pub relaxation: f64,
}

/// A voltage and the stiffness that it would give instantaneously, both in V.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OperatingPoint {
    pub(crate) voltage: Signal,
    pub(crate) stiffness: Signal,
}

/// The plain spring: a feedthrough and one relaxation, static gain 1, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    /// Part of a step that the stiffness follows instantaneously, 0 to 0.9.
    pub share: f64,
    /// Time constant of the remaining part, two sample times to 10 000 s.
    pub time_constant_s: f64,
}

impl Plant {
    /// The source report's plant: `Kp = 0.1`, `Ki = 0.2 1/s`, hence a share of 1/11 and a time constant of 5.5 s.
    pub const PAPER: Self = Self::proportional_integral(0.1, 0.2);

    /// Returns the plant of a unity feedback loop around a block with the gains `proportional` (no unit) and
    /// `integral_per_s` (1/s).
    pub const fn proportional_integral(proportional: f64, integral_per_s: f64) -> Self {
        Self { share: proportional / (1.0 + proportional), time_constant_s: (1.0 + proportional) / integral_per_s }
    }

    /// Returns the plant with its time constant and its share multiplied by these factors.
    fn times(&self, (time_constant, share): (f64, f64)) -> Self {
        Self { share: share * self.share, time_constant_s: time_constant * self.time_constant_s }
    }
}

/// The plain spring for one sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    share: Gain,
    relaxation: Rate,
}

/// The relaxed part of the stiffness; the default is a spring at rest at 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    relaxed: Accumulator,
}

impl Config {
    /// Returns the stiffness just after `applied` was put across the spring.
    #[inline(always)]
    pub fn estimate(&self, state: &State, applied: Volts) -> ScaledStiffness {
        let relaxed = state.relaxed();
        ScaledStiffness(relaxed + self.share.times(applied.0 - relaxed))
    }

    /// Advances the state by one sample time with `applied` held.
    #[inline(always)]
    pub fn advance(&self, state: &mut State, applied: Volts) {
        state.relaxed += self.relaxation.step(applied.0 - state.relaxed());
    }
}

impl Validate for Plant {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        OutOfRange::check("share", self.share, 0.0..=0.9, "of a step")?;
        OutOfRange::check("time_constant_s", self.time_constant_s, 2.0 * sample_time.seconds()..=1e4, "s")
    }
}

impl Model for Plant {
    type Config = Config;

    fn quantize(plant: Validated<'_, Self>) -> Config {
        let Self { share, time_constant_s } = *plant.settings();
        Config { share: Gain::new(share), relaxation: Rate::new(plant.sample_time().lag_fraction(time_constant_s)) }
    }

    fn largest_step_gain(&self, sample_time: SampleTime) -> StepGain {
        let relaxation = sample_time.lag_fraction(self.time_constant_s);
        StepGain { feedthrough: self.share, in_one_tick: (1.0 - self.share) * relaxation, relaxation }
    }

    fn check_differing(&self, factors: (f64, f64), sample_time: SampleTime) -> Result<(), OutOfRange> {
        self.times(factors).check(sample_time)
    }

    fn differing(plant: Validated<'_, Self>, factors: (f64, f64), resolution_v: f64) -> Invertible<Config> {
        Invertible::new(Validated::new(&plant.settings().times(factors), plant.sample_time()), resolution_v)
    }

    fn inverse(plant: Validated<'_, Self>, _: &Config, _: f64) -> WideGain {
        let StepGain { feedthrough, in_one_tick, .. } = plant.settings().largest_step_gain(plant.sample_time());
        WideGain::new(inverse_gain(feedthrough + in_one_tick))
    }
}

impl Estimator for Config {
    type State = State;
    type Inverse = WideGain;

    #[inline(always)]
    fn run(&self, state: &mut State, applied: Volts) -> ScaledStiffness {
        let stiffness = self.estimate(state, applied);
        self.advance(state, applied);
        stiffness
    }

    /// Returns the point where the spring is in equilibrium: voltage and stiffness both equal the relaxed part.
    #[inline(always)]
    fn operating_point(&self, state: &State) -> OperatingPoint {
        OperatingPoint { voltage: state.relaxed(), stiffness: state.relaxed() }
    }

    #[inline(always)]
    fn predict(&self, state: &State, applied: Volts) -> Prediction {
        let mut next = *state;
        self.advance(&mut next, applied);
        Prediction { now: self.estimate(state, applied).0, end: self.estimate(&next, applied).0 }
    }

    #[inline(always)]
    fn voltage_for(&self, _: &State, inverse: &WideGain, applied: Volts, change: Signal) -> Volts {
        Volts(applied.0.saturating_add(inverse.times(change)))
    }
}

impl State {
    /// Returns the relaxed part, in V: the stiffness that would be left without the feedthrough of the voltage.
    #[inline(always)]
    fn relaxed(&self) -> Signal {
        upper(self.relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(rate_hz: f64) -> Config {
        Plant::PAPER.validate(SampleTime::from_rate(rate_hz).unwrap()).unwrap().quantize()
    }

    #[test]
    fn the_paper_plant_has_a_share_of_1_11_and_a_time_constant_of_5_5_s() {
        assert!((Plant::PAPER.share - 1.0 / 11.0).abs() < 1e-15);
        assert!((Plant::PAPER.time_constant_s - 5.5).abs() < 1e-12);
    }

    /// Exact for a held voltage at any rate: forward Euler would be off by 0.03 V at 100 Hz.
    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_step_response_is_the_exact_exponential_at_every_rate() {
        for rate in [100.0, 333.0, 1000.0, 10_000.0] {
            let (config, mut state) = (paper(rate), State::default());
            let applied = Volts::new(700.0).unwrap();
            for tick in 0..(20.0 * rate) as u32 {
                let time = f64::from(tick) / rate;
                let exact = 700.0 * (1.0 - 10.0 / 11.0 * (-time / 5.5).exp());
                let got = config.estimate(&state, applied).to_f64();
                assert!((got - exact).abs() < 1e-4, "{rate} Hz, {time} s: {got} {exact}");
                config.advance(&mut state, applied);
            }
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_lag_of_one_millivolt_is_integrated_at_10_khz() {
        let (config, mut state) = (paper(10_000.0), State::default());
        let applied = Volts::new(0.001).unwrap();
        config.advance(&mut state, applied);
        assert!(state.relaxed > Accumulator::ZERO, "the first tick is lost");
        for _ in 0..55_000 {
            config.advance(&mut state, applied);
        }
        let (got, exact) = (state.relaxed.to_num::<f64>(), applied.to_f64() * (1.0 - (-1f64).exp()));
        assert!((got / exact - 1.0).abs() < 0.03, "{got} {exact}");
    }

    #[test]
    fn one_tick_returns_the_stiffness_at_its_start_and_ends_at_the_predicted_one() {
        let (config, applied) = (paper(100.0), Volts::new(300.0).unwrap());
        let mut state = State::default();
        for tick in 0..3 {
            let predicted = config.predict(&state, applied);
            assert_eq!(config.run(&mut state, applied).0, predicted.now, "tick {tick}");
            assert_eq!(config.estimate(&state, applied).0, predicted.end, "tick {tick}");
            assert!(predicted.now < predicted.end, "tick {tick}");
        }
    }

    #[test]
    fn a_differing_spring_has_the_multiplied_time_constant_and_share() {
        let (plant, time) = (Plant { share: 0.25, time_constant_s: 4.0 }, SampleTime::from_rate(1000.0).unwrap());
        let (quick, expected) = ((0.75, 1.5), Plant { share: 0.375, time_constant_s: 3.0 });
        let differing = Plant::differing(plant.validate(time).unwrap(), quick, 0.17);
        assert_eq!(differing.estimator, expected.validate(time).unwrap().quantize());
        assert_eq!(differing.largest, expected.largest_step_gain(time));
        assert_eq!(plant.check_differing(quick, time), Ok(()));
        let rejected = |factors| plant.check_differing(factors, time).unwrap_err().field;
        assert_eq!((rejected((1.0, 4.0)), rejected((4e-4, 1.0))), ("share", "time_constant_s"));
    }

    /// After the voltage that the inverse asks for, held for one tick, the stiffness has changed by as much as was wanted, to within
    /// the rounding of a signal.
    #[test]
    fn the_inverse_asks_for_the_voltage_that_gives_the_wanted_change_at_the_end_of_a_tick() {
        let time = SampleTime::from_rate(100.0).unwrap();
        for (share, time_constant_s) in [(1.0 / 11.0, 5.5), (0.0, 0.05), (0.5, 0.02)] {
            let plant = Plant { share, time_constant_s };
            let valid = plant.validate(time).unwrap();
            let config = valid.quantize();
            let inverse = Plant::inverse(valid, &config, 0.17);
            let (mut state, last) = (State::default(), Volts::new(100.0).unwrap());
            config.run(&mut state, last);
            for change_v in [20.0, -7.0] {
                let change = Signal::from_num(change_v);
                let voltage = config.voltage_for(&state, &inverse, last, change);
                let got = config.predict(&state, voltage).end - config.predict(&state, last).end;
                assert!((got - change).abs() < Signal::from_num(1e-5), "{plant:?}: {got} V, {change_v} V wanted");
            }
        }
    }

    #[test]
    fn a_setting_out_of_range_is_rejected_by_name() {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let named = |share, time_constant_s| Plant { share, time_constant_s }.validate(time).unwrap_err().field;
        assert_eq!(named(-0.1, 5.5), "share");
        assert_eq!(named(f64::NAN, 5.5), "share");
        assert_eq!(named(0.1, 0.001), "time_constant_s");
        assert_eq!(named(0.1, f64::INFINITY), "time_constant_s");
    }
}
