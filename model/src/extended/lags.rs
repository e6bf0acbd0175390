//! Relaxation with several time constants: what comes at once, and what later.
//!
//! ```text
//! y = share q + sum_k weight_k w_k,    dw_k/dt = (q - w_k) / tau_k,    w_k = 0 at rest
//! ```
//!
//! A sum of first-order lags with spread time constants is the usual model of creep in piezo actuators, a generalised
//! Kelvin-Voigt chain. For a `q` that is held between ticks each lag is exact, as in [`crate::estimator`]. A lag moves by
//! less than half of its distance in a tick, so it stays between inputs that were there.
//!
//! The first time constant may depend on the voltage: [`super::varying_rate`].

use super::varying_rate::{TimeConstant, VaryingRate};
use crate::coefficient::{Rate, Weight, saturated, upper};
use crate::error::OutOfRange;
use crate::estimator::Promptness;
use crate::units::{Accumulator, SampleTime, Signal};

/// The most lags of a relaxation.
pub const MOST_LAGS: usize = 4;

/// Share and lags. The magnitudes of `share` and `weights` add up to at most 10; for a static gain of 1 their sum is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation<'a> {
    /// What comes at once, 0 to 10.
    pub share: f64,
    /// One to four time constants, in s, each two sample times (four where it varies) to 10 000 s.
    pub time_constants_s: &'a [f64],
    /// What each of them brings; none for one time constant that brings all the rest, `1 - share`.
    pub weights: &'a [f64],
    /// The first time constant at 500 V, in s, a tenth to ten times of that at 0 V; `None`: the same at all voltages.
    pub time_constant_high_s: Option<f64>,
}

impl Relaxation<'_> {
    /// # Errors
    /// [`OutOfRange`] names `relaxation.share`, `.tau_s`, `.weights` or `.tau_high_s`.
    pub(super) fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        let Self { share, time_constants_s, weights, time_constant_high_s } = *self;
        let (count, seconds) = (time_constants_s.len(), sample_time.seconds());
        OutOfRange::check_count("relaxation.tau_s", count, 1..=MOST_LAGS, "time constants")?;
        let fewest = if count == 1 { 0 } else { count };
        OutOfRange::check_count("relaxation.weights", weights.len(), fewest..=count, "weights, one a time constant")?;
        OutOfRange::check("relaxation.share", share, 0.0..=Weight::MOST, "of a step")?;
        let mut left = Weight::MOST - share;
        let mut ticks = if time_constant_high_s.is_some() { 4.0 } else { 2.0 };
        for (tau, weight) in self.lags() {
            OutOfRange::check("relaxation.tau_s", tau, ticks * seconds..=1e4, "s")?;
            left = Weight::budget("relaxation.weights", weight, left)?;
            ticks = 2.0;
        }
        self.varying().map_or(Ok(()), |TimeConstant { low_s, high_s }| {
            let lowest = (4.0 * seconds).max(0.1 * low_s);
            OutOfRange::check("relaxation.tau_high_s", high_s, lowest..=(10.0 * low_s).min(1e4), "s")
        })
    }

    /// Time constant and weight of each lag.
    pub fn lags(&self) -> impl Iterator<Item = (f64, f64)> {
        let weight = |lag| self.weights.get(lag).copied().unwrap_or(1.0 - self.share);
        self.time_constants_s.iter().enumerate().map(move |(lag, &tau)| (tau, weight(lag)))
    }

    /// The first time constant, if it depends on the voltage.
    pub(super) fn varying(&self) -> Option<TimeConstant> {
        let (&low_s, high_s) = (self.time_constants_s.first()?, self.time_constant_high_s?);
        Some(TimeConstant { low_s, high_s })
    }

    /// Time constant and weight of each lag at `volts`.
    pub(super) fn lags_at(&self, volts: f64) -> impl Iterator<Item = (f64, f64)> {
        let first = self.varying().map(|tau| tau.at(volts));
        let at = move |(lag, (tau, weight))| (first.filter(|_| lag == 0).unwrap_or(tau), weight);
        self.lags().enumerate().map(at)
    }

    pub(super) fn least_promptness(&self, sample_time: SampleTime) -> Promptness {
        let slowest = if self.varying().is_some_and(|tau| tau.at(1000.0) > tau.at(0.0)) { 1000.0 } else { 0.0 };
        let mut promptness = Promptness { at_once: self.share, in_a_tick: 0.0, relaxed: 1.0 };
        for (tau, weight) in self.lags_at(slowest) {
            let part = sample_time.part_of_way(tau);
            promptness.in_a_tick += part * weight;
            promptness.relaxed = promptness.relaxed.min(part);
        }
        promptness
    }

    pub(crate) fn promptness(&self, sample_time: SampleTime) -> Promptness {
        let mut promptness = Promptness { at_once: self.share.max(0.0), in_a_tick: 0.0, relaxed: 0.0 };
        // At an end it is shortest.
        let shortest = if self.varying().is_some_and(|tau| tau.at(1000.0) < tau.at(0.0)) { 1000.0 } else { 0.0 };
        for (tau, weight) in self.lags_at(shortest) {
            let part = sample_time.part_of_way(tau);
            promptness.in_a_tick += part * weight.max(0.0);
            promptness.relaxed = promptness.relaxed.max(part);
        }
        promptness
    }
}

/// The relaxation for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    share: Weight,
    weights: [Weight; MOST_LAGS],
    rates: [Rate; MOST_LAGS],
    count: u8,
    /// In place of the first rate.
    varying: Option<VaryingRate>,
}

/// How far each lag has come.
pub(crate) type State = [Accumulator; MOST_LAGS];

impl Config {
    /// Of a relaxation that [`Relaxation::check`] accepts.
    pub(crate) fn new(relaxation: &Relaxation<'_>, sample_time: SampleTime) -> Self {
        let mut config = Self {
            share: Weight::new(relaxation.share),
            weights: [Weight::default(); MOST_LAGS],
            rates: [Rate::default(); MOST_LAGS],
            count: relaxation.time_constants_s.len() as u8,
            varying: relaxation.varying().map(|tau| VaryingRate::new(&tau, sample_time)),
        };
        let places = config.weights.iter_mut().zip(&mut config.rates);
        for ((weight, rate), (tau, of_lag)) in places.zip(relaxation.lags()) {
            *weight = Weight::new(of_lag);
            *rate = Rate::new(sample_time.part_of_way(tau));
        }
        config
    }

    /// Stiffness with `input` just there.
    #[inline(always)]
    pub(crate) fn stiffness(&self, state: &State, input: Signal) -> Signal {
        let mut sum = self.share.of(input);
        for (weight, relaxed) in self.weights.iter().zip(state).take(usize::from(self.count)) {
            sum += weight.of(upper(*relaxed));
        }
        saturated(sum)
    }

    /// One sample time passes with `input` held, at this voltage.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut State, input: Signal, voltage: Signal) {
        let before = state[0];
        for (rate, relaxed) in self.rates.iter().zip(&mut *state).take(usize::from(self.count)) {
            *relaxed += rate.step(input.saturating_sub(upper(*relaxed)));
        }
        if let Some(varying) = &self.varying {
            state[0] = before + varying.step(voltage, input.saturating_sub(upper(before)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact for a held input at any rate, and the slowest lag moves at 10 kHz.
    #[test]
    fn a_step_follows_its_exponentials() {
        let relaxation = Relaxation {
            share: 0.1,
            time_constants_s: &[0.3, 2.0, 40.0, 3000.0],
            weights: &[0.5, 0.2, 0.15, 0.05],
            time_constant_high_s: None,
        };
        for rate_hz in [100.0, 10_000.0] {
            let config = Config::new(&relaxation, SampleTime::from_rate(rate_hz).unwrap());
            let (mut state, input) = (State::default(), Signal::from_num(600));
            for tick in 0..(10.0 * rate_hz) as u32 {
                let time = f64::from(tick) / rate_hz;
                let lags = relaxation.lags().map(|(tau, weight)| weight * (1.0 - (-time / tau).exp()));
                let exact = 600.0 * (0.1 + lags.sum::<f64>());
                let got = config.stiffness(&state, input).to_num::<f64>();
                assert!((got - exact).abs() < 1e-4, "{rate_hz} Hz, {time} s: {got} {exact}");
                config.advance(&mut state, input, Signal::ZERO);
            }
        }
    }

    #[test]
    fn a_wrong_relaxation_is_named() {
        let named = |share, time_constants_s: &[f64], weights: &[f64], time_constant_high_s| {
            let relaxation = Relaxation { share, time_constants_s, weights, time_constant_high_s };
            relaxation.check(SampleTime::from_rate(1000.0).unwrap()).unwrap_err().field
        };
        assert_eq!(named(-0.1, &[5.0], &[], None), "relaxation.share");
        assert_eq!(named(0.1, &[], &[], None), "relaxation.tau_s");
        assert_eq!(named(0.1, &[5.0; 5], &[0.1; 5], None), "relaxation.tau_s");
        assert_eq!(named(0.1, &[5.0, 0.001], &[0.4, 0.4], None), "relaxation.tau_s");
        assert_eq!(named(0.1, &[5.0, 9.0], &[], None), "relaxation.weights");
        assert_eq!(named(0.1, &[5.0, 9.0], &[0.4, 10.0], None), "relaxation.weights");
        assert_eq!(named(0.1, &[5.0], &[], Some(51.0)), "relaxation.tau_high_s");
        assert_eq!(named(0.1, &[0.003], &[], Some(0.005)), "relaxation.tau_s");
        assert_eq!(named(0.1, &[5.0], &[], Some(f64::NAN)), "relaxation.tau_high_s");
    }
}
