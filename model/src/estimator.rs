//! The stiffness estimator: the spring's relaxation, run on the voltage that was really applied.
//!
//! The plant of the source report's section 4.2.2 is a unity feedback loop around a proportional-integral block,
//! `u = Kp e + Ki integral(e)` with `Kp = 0.1` and `Ki = 0.2 1/s`. Closed, it is
//!
//! ```text
//! y/u = (Kp s + Ki) / ((1 + Kp) s + Ki)
//!     = share + (1 - share) / (1 + tau s),   share = Kp / (1 + Kp),   tau = (1 + Kp) / Ki
//! ```
//!
//! an instantaneous share of 1/11 and a relaxation of 5.5 s. With `w` the relaxed part:
//!
//! ```text
//! y = w + share (u - w),   dw/dt = (u - w) / tau
//! ```
//!
//! The amplifier holds its voltage between ticks, and for a held `u` the tick is exact, not an approximation:
//! `w' = w + (1 - exp(-T / tau)) (u - w)`. `w` is always between voltages that were
//! applied, so no sum here can overflow.

use core::fmt::Debug;

use crate::coefficient::{Gain, Rate, Steep, upper};
use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, ScaledStiffness, Signal, Volts};

/// A spring in SI units, to be scaled for one sample time.
pub trait Model: Copy {
    /// What it becomes.
    type Config: Estimator;

    /// Whether it can be scaled.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field.
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange>;

    /// Of a spring that [`Model::check`] accepts; of another one, anything.
    fn scaled(&self, sample_time: SampleTime) -> Self::Config;

    /// How much of a change of voltage shows how soon, at the most.
    fn promptness(&self, sample_time: SampleTime) -> Promptness;

    /// The same at the least, in the direction that the voltage turns to.
    fn least_promptness(&self, sample_time: SampleTime) -> Promptness {
        self.promptness(sample_time)
    }

    /// Whether there is a way back, from a stiffness to a voltage.
    ///
    /// # Errors
    /// [`OutOfRange`] names what keeps more voltage from always giving more stiffness.
    fn check_inverse(&self) -> Result<(), OutOfRange> {
        Ok(())
    }

    /// The way back of this spring, which has become `config`, if there is one; `resolution_v` is that of the amplifier's
    /// converter.
    fn inverse(
        &self,
        config: &Self::Config,
        sample_time: SampleTime,
        resolution_v: f64,
    ) -> <Self::Config as Estimator>::Inverse;
}

/// A spring that runs in a tick, on the voltage that was really applied.
pub trait Estimator: Copy {
    /// What it remembers; the default is a spring at rest without voltage.
    type State: Copy + Default;
    /// What it takes to go back from a stiffness to a voltage.
    type Inverse: Copy + Debug + Eq;

    /// One tick: the stiffness with `applied` just put across the spring, which then holds for one sample time.
    fn run(&self, state: &mut Self::State, applied: Volts) -> ScaledStiffness;

    /// A point of what the spring would answer at once to a voltage now.
    fn pivot(&self, state: &Self::State) -> Pivot;

    /// Where the spring is and where it goes, while the `applied` voltage of the last tick stays.
    fn outlook(&self, state: &Self::State, applied: Volts) -> Outlook;

    /// The voltage that makes the stiffness at the end of the coming tick `change` V more than `applied` would.
    fn voltage_for(&self, state: &Self::State, inverse: &Self::Inverse, applied: Volts, change: Signal) -> Volts;
}

/// Stiffness before the coming tick and at its end, both under the last voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outlook {
    pub(crate) now: Signal,
    pub(crate) then: Signal,
}

/// The most volts that a law asks for to make up for one volt of stiffness within a tick: more only amplifies rounding.
const MOST_DEMANDED: f64 = 8192.0;

/// The volts that make up for one volt of stiffness, where one volt makes up for `within_a_tick`.
pub(crate) fn demanded(within_a_tick: f64) -> f64 {
    (1.0 / within_a_tick).min(MOST_DEMANDED)
}

/// Bounds of what one volt more does, in V/V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promptness {
    /// At once.
    pub at_once: f64,
    /// Later, by one more tick.
    pub in_a_tick: f64,
    /// What part of its distance the relaxation makes in a tick.
    pub relaxed: f64,
}

/// A voltage, and the stiffness that it would give at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pivot {
    pub(crate) voltage: Signal,
    pub(crate) stiffness: Signal,
}

/// The spring's response to a change of voltage, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    /// Part of a change that comes at once, 0 to 0.9.
    pub share: f64,
    /// Time constant of the rest, in seconds, two sample times to 10 000 s.
    pub time_constant_s: f64,
}

impl Plant {
    /// The report's plant: `Kp = 0.1`, `Ki = 0.2 1/s`.
    pub const PAPER: Self = Self::proportional_integral(0.1, 0.2);

    /// A unity feedback loop around `proportional` (no unit) and `integral_per_s` (1/s).
    pub const fn proportional_integral(proportional: f64, integral_per_s: f64) -> Self {
        Self { share: proportional / (1.0 + proportional), time_constant_s: (1.0 + proportional) / integral_per_s }
    }
}

/// The plant for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    share: Gain,
    relaxation: Rate,
}

/// The relaxed part of the stiffness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    relaxed: Accumulator,
}

impl Config {
    /// Stiffness at this tick, with `applied` just put across the spring.
    #[inline(always)]
    pub fn estimate(&self, state: &State, applied: Volts) -> ScaledStiffness {
        let relaxed = state.relaxed();
        ScaledStiffness(relaxed + self.share.times(applied.0 - relaxed))
    }

    /// One sample time passes with `applied` held.
    #[inline(always)]
    pub fn advance(&self, state: &mut State, applied: Volts) {
        state.relaxed += self.relaxation.step(applied.0 - state.relaxed());
    }
}

impl Model for Plant {
    type Config = Config;

    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        OutOfRange::check("share", self.share, 0.0..=0.9, "of a step")?;
        OutOfRange::check("time_constant_s", self.time_constant_s, 2.0 * sample_time.seconds()..=1e4, "s")
    }

    fn scaled(&self, sample_time: SampleTime) -> Config {
        let relaxation = Rate::new(sample_time.part_of_way(self.time_constant_s));
        Config { share: Gain::new(self.share), relaxation }
    }

    fn promptness(&self, sample_time: SampleTime) -> Promptness {
        let relaxed = sample_time.part_of_way(self.time_constant_s);
        Promptness { at_once: self.share, in_a_tick: (1.0 - self.share) * relaxed, relaxed }
    }

    fn inverse(&self, _: &Config, sample_time: SampleTime, _: f64) -> Steep {
        let Promptness { at_once, in_a_tick, .. } = self.promptness(sample_time);
        Steep::new(demanded(at_once + in_a_tick))
    }
}

impl Estimator for Config {
    type State = State;
    type Inverse = Steep;

    #[inline(always)]
    fn run(&self, state: &mut State, applied: Volts) -> ScaledStiffness {
        let stiffness = self.estimate(state, applied);
        self.advance(state, applied);
        stiffness
    }

    /// Where nothing moves: the voltage that equals the relaxed part.
    #[inline(always)]
    fn pivot(&self, state: &State) -> Pivot {
        Pivot { voltage: state.relaxed(), stiffness: state.relaxed() }
    }

    #[inline(always)]
    fn outlook(&self, state: &State, applied: Volts) -> Outlook {
        let mut next = *state;
        self.advance(&mut next, applied);
        Outlook { now: self.estimate(state, applied).0, then: self.estimate(&next, applied).0 }
    }

    #[inline(always)]
    fn voltage_for(&self, _: &State, inverse: &Steep, applied: Volts, change: Signal) -> Volts {
        Volts(applied.0.saturating_add(inverse.times(change)))
    }
}

impl State {
    /// The stiffness that would be left if the voltage's instantaneous share were taken away.
    #[inline(always)]
    fn relaxed(&self) -> Signal {
        upper(self.relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(rate_hz: f64) -> Config {
        Plant::PAPER.scaled(SampleTime::from_rate(rate_hz).unwrap())
    }

    #[test]
    fn the_report_gives_a_share_of_one_eleventh_and_five_and_a_half_seconds() {
        assert!((Plant::PAPER.share - 1.0 / 11.0).abs() < 1e-15);
        assert!((Plant::PAPER.time_constant_s - 5.5).abs() < 1e-12);
    }

    /// Exact for a held voltage at any rate: forward Euler would be off by 0.03 V at 100 Hz.
    #[test]
    fn a_step_follows_the_exponential_at_every_rate() {
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
    fn one_millivolt_still_integrates_at_10_khz() {
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
    fn a_wrong_plant_is_named() {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let named = |share, time_constant_s| Plant { share, time_constant_s }.check(time).unwrap_err().field;
        assert_eq!(named(-0.1, 5.5), "share");
        assert_eq!(named(f64::NAN, 5.5), "share");
        assert_eq!(named(0.1, 0.001), "time_constant_s");
        assert_eq!(named(0.1, f64::INFINITY), "time_constant_s");
    }
}
