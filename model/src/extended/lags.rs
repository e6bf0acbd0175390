//! Relaxation with a feedthrough and up to four time constants.
//!
//! Important terms:
//!
//! - *share*: the feedthrough, the part of its input `q` that the stiffness follows instantaneously.
//! - *lag*, `w_k`: a first-order low-pass of the input with the time constant `tau_k`, in V.
//! - *weight*: the contribution of a lag to the stiffness.
//!
//! ```text
//! y = share q + sum_k weight_k w_k,    dw_k/dt = (q - w_k) / tau_k,    w_k = 0 at rest
//! ```
//!
//! A sum of first-order lags with widely spread time constants is the usual model of creep in piezo actuators, a
//! generalised Kelvin-Voigt chain. For a `q` that is held between ticks each lag is exact, as in [`crate::estimator`].
//! A lag covers less than half of its distance in a tick, so it stays between inputs that occurred.
//!
//! The first time constant may depend on the voltage: [`super::varying_rate`].

use super::varying_rate::{TimeConstant, VaryingRate};
use crate::coefficient::{Rate, Weight, saturated, upper};
use crate::error::OutOfRange;
use crate::estimator::StepGain;
use crate::units::{Accumulator, SampleTime, Signal};
use crate::validated::{Validate, Validated};

/// Largest number of lags in a relaxation.
pub const MAX_LAGS: usize = 4;

/// Feedthrough and lags of a relaxation, in SI units. The magnitudes of `share` and `weights` add up to at most 10; for
/// a static gain of 1 their sum is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation<'a> {
    /// Feedthrough, 0 to 10.
    pub share: f64,
    /// One to four time constants, in s, each two sample times (the first one four, if it varies) to 10 000 s.
    pub time_constants_s: &'a [f64],
    /// Weight of each lag; empty for a single time constant whose weight is `1 - share`.
    pub weights: &'a [f64],
    /// First time constant at 500 V, in s, a tenth to ten times the one at 0 V; `None` if it does not depend on the
    /// voltage.
    pub time_constant_high_s: Option<f64>,
}

impl Validate for Relaxation<'_> {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        let Self { share, time_constants_s, weights, time_constant_high_s } = *self;
        let (count, seconds) = (time_constants_s.len(), sample_time.seconds());
        OutOfRange::check_count("relaxation.tau_s", count, 1..=MAX_LAGS, "time constants")?;
        let fewest = if count == 1 { 0 } else { count };
        OutOfRange::check_count("relaxation.weights", weights.len(), fewest..=count, "weights, one per time constant")?;
        OutOfRange::check("relaxation.share", share, 0.0..=Weight::MAX, "of a step")?;
        let mut budget = Weight::MAX - share;
        let mut ticks = if time_constant_high_s.is_some() { 4.0 } else { 2.0 };
        for (tau, weight) in self.lags() {
            OutOfRange::check("relaxation.tau_s", tau, ticks * seconds..=1e4, "s")?;
            budget = Weight::spend("relaxation.weights", weight, budget)?;
            ticks = 2.0;
        }
        self.varying().map_or(Ok(()), |TimeConstant { low_s, high_s }| {
            let lowest = (4.0 * seconds).max(0.1 * low_s);
            OutOfRange::check("relaxation.tau_high_s", high_s, lowest..=(10.0 * low_s).min(1e4), "s")
        })
    }
}

impl Relaxation<'_> {
    /// Returns the time constant, in s, and the weight of each lag, at 0 V.
    pub fn lags(&self) -> impl Iterator<Item = (f64, f64)> {
        let weight = |lag| self.weights.get(lag).copied().unwrap_or(1.0 - self.share);
        self.time_constants_s.iter().enumerate().map(move |(lag, &tau)| (tau, weight(lag)))
    }

    /// Calls `then` with the relaxation whose time constants and share are multiplied by these factors. The weights of the lags change
    /// so that the settled value does not.
    pub(super) fn times<T>(&self, (time_constant, share): (f64, f64), then: impl FnOnce(&Relaxation) -> T) -> T {
        let later: f64 = self.lags().map(|(_, weight)| weight).sum();
        let differs = share * self.share;
        let left = if later == 0.0 { 1.0 } else { (later + self.share - differs) / later };
        let (mut time_constants_s, mut weights) = ([0.0; MAX_LAGS], [0.0; MAX_LAGS]);
        let places = time_constants_s.iter_mut().zip(&mut weights);
        for ((tau, weight), (of_tau, of_weight)) in places.zip(self.lags()) {
            (*tau, *weight) = (time_constant * of_tau, left * of_weight);
        }
        let count = self.time_constants_s.len().min(MAX_LAGS);
        then(&Relaxation {
            share: differs,
            time_constants_s: time_constants_s.get(..count).unwrap_or_default(),
            weights: weights.get(..count).unwrap_or_default(),
            time_constant_high_s: self.time_constant_high_s.map(|tau| time_constant * tau),
        })
    }

    /// Returns the first time constant if it depends on the voltage.
    pub(super) fn varying(&self) -> Option<TimeConstant> {
        let (&low_s, high_s) = (self.time_constants_s.first()?, self.time_constant_high_s?);
        Some(TimeConstant { low_s, high_s })
    }

    /// Returns the time constant, in s, and the weight of each lag, at `volts`.
    pub(super) fn lags_at(&self, volts: f64) -> impl Iterator<Item = (f64, f64)> {
        let first = self.varying().map(|tau| tau.at(volts));
        let at = move |(lag, (tau, weight))| (first.filter(|_| lag == 0).unwrap_or(tau), weight);
        self.lags().enumerate().map(at)
    }

    /// Returns the step gain at the voltage where the first time constant is longest.
    pub(super) fn smallest_step_gain(&self, sample_time: SampleTime) -> StepGain {
        let slowest = if self.varying().is_some_and(|tau| tau.at(1000.0) > tau.at(0.0)) { 1000.0 } else { 0.0 };
        let mut gain = StepGain { feedthrough: self.share, in_one_tick: 0.0, relaxation: 1.0 };
        for (tau, weight) in self.lags_at(slowest) {
            let part = sample_time.lag_fraction(tau);
            gain.in_one_tick += part * weight;
            gain.relaxation = gain.relaxation.min(part);
        }
        gain
    }

    /// Returns the step gain at the voltage where the first time constant is shortest; negative weights count as 0.
    pub(super) fn largest_step_gain(&self, sample_time: SampleTime) -> StepGain {
        let mut gain = StepGain { feedthrough: self.share.max(0.0), in_one_tick: 0.0, relaxation: 0.0 };
        // The shortest one is at an end of the range of voltages.
        let fastest = if self.varying().is_some_and(|tau| tau.at(1000.0) < tau.at(0.0)) { 1000.0 } else { 0.0 };
        for (tau, weight) in self.lags_at(fastest) {
            let part = sample_time.lag_fraction(tau);
            gain.in_one_tick += part * weight.max(0.0);
            gain.relaxation = gain.relaxation.max(part);
        }
        gain
    }
}

/// The relaxation for one sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    share: Weight,
    weights: [Weight; MAX_LAGS],
    rates: [Rate; MAX_LAGS],
    count: u8,
    /// Replaces the first rate.
    varying: Option<VaryingRate>,
}

/// The lags `w_k`, in V.
pub(crate) type State = [Accumulator; MAX_LAGS];

impl Validated<'_, Relaxation<'_>> {
    /// Quantizes the relaxation for the tick.
    pub(crate) fn quantize(self) -> Config {
        let (relaxation, sample_time) = (self.settings(), self.sample_time());
        let mut config = Config {
            share: Weight::new(relaxation.share),
            weights: [Weight::default(); MAX_LAGS],
            rates: [Rate::default(); MAX_LAGS],
            count: relaxation.time_constants_s.len() as u8,
            varying: relaxation.varying().map(|tau| VaryingRate::new(&tau, sample_time)),
        };
        let places = config.weights.iter_mut().zip(&mut config.rates);
        for ((weight, rate), (tau, of_lag)) in places.zip(relaxation.lags()) {
            *weight = Weight::new(of_lag);
            *rate = Rate::new(sample_time.lag_fraction(tau));
        }
        config
    }
}

impl Config {
    /// Returns the stiffness just after the input became `input`.
    #[inline(always)]
    pub(crate) fn stiffness(&self, state: &State, input: Signal) -> Signal {
        let mut sum = self.share.times(input);
        for (weight, lag) in self.weights.iter().zip(state).take(usize::from(self.count)) {
            sum += weight.times(upper(*lag));
        }
        saturated(sum)
    }

    /// Advances the lags by one sample time with `input` held, at this voltage.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut State, input: Signal, voltage: Signal) {
        let before = state[0];
        for (rate, lag) in self.rates.iter().zip(&mut *state).take(usize::from(self.count)) {
            *lag += rate.step(input.saturating_sub(upper(*lag)));
        }
        if let Some(varying) = &self.varying {
            state[0] = before + varying.step(voltage, input.saturating_sub(upper(before)));
        }
    }
}

#[cfg(test)]
mod tests;
