//! Leakage of charge: the stiffness falls while the voltage stays.
//!
//! Important terms:
//!
//! - *input*, `f`: the law's output, in V, held between ticks.
//! - *charge*, `q`: what leakage leaves of the input, in V.
//! - *follower*, `l`: a first-order low-pass of the input, in V, the state.
//!
//! ```text
//! q = f - share l,    dl/dt = (f - l) / tau,    l = 0 at rest
//! ```
//!
//! `l` is exact. But `q` moves within a tick, and the [lags](super::lags) behind it take one number per tick: they get
//! its mean over the sample time, `q - share m (f - l)` with `m = 1 - (1 - exp(-T / tau)) tau / T`. The error is less
//! than `share |f - l| T^2 / (12 tau tau_lag)`; with `q` itself it would be `share |f - l| T / (2 tau)`.

use crate::coefficient::{Rate, Weight, saturated, sum, upper};
use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, Signal};
use crate::validated::{Validate, Validated};

/// Loss of charge through the spring's own resistance, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leakage {
    /// Part of the stiffness that is lost in the end, 0 to 1.
    pub share: f64,
    /// Time constant of the loss, 100 sample times to 100 000 s.
    pub time_constant_s: f64,
}

impl Validate for Leakage {
    fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        OutOfRange::check("leakage.share", self.share, 0.0..=1.0, "of the stiffness")?;
        OutOfRange::check("leakage.tau_s", self.time_constant_s, 100.0 * sample_time.seconds()..=1e5, "s")
    }
}

impl Leakage {
    /// Returns which fraction of a new input is lost at the end of a tick, and which fraction of its mean over the
    /// tick.
    pub(super) fn loss_in_one_tick(&self, sample_time: SampleTime) -> (f64, f64) {
        let ticks = self.time_constant_s / sample_time.seconds();
        let rate = sample_time.lag_fraction(self.time_constant_s);
        (self.share * rate, self.share * (1.0 - rate * ticks))
    }
}

/// The leakage for one sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    share: Weight,
    /// share m
    share_of_mean: Weight,
    rate: Rate,
}

/// The follower `l`, in V.
pub(crate) type State = Accumulator;

impl Validated<'_, Leakage> {
    /// Quantizes the leakage for the tick.
    pub(crate) fn quantize(self) -> Config {
        let (leakage, sample_time) = (self.settings(), self.sample_time());
        let (_, share_of_mean) = leakage.loss_in_one_tick(sample_time);
        Config {
            share: Weight::new(leakage.share),
            share_of_mean: Weight::new(share_of_mean),
            rate: Rate::new(sample_time.lag_fraction(leakage.time_constant_s)),
        }
    }
}

impl Config {
    /// Returns the charge `q` just after the input became `input`.
    #[inline(always)]
    pub(crate) fn charge(&self, state: &State, input: Signal) -> Signal {
        saturated(sum(input) - self.share.times(upper(*state)))
    }

    /// Advances the follower by one sample time with `input` held. Returns the mean charge over it; `charge` is the one
    /// at its start.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut State, input: Signal, charge: Signal) -> Signal {
        let lag = input.saturating_sub(upper(*state));
        *state += self.rate.step(lag);
        charge.saturating_sub(saturated(self.share_of_mean.times(lag)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn the_charge_and_its_mean_over_a_tick_are_the_exact_exponentials() {
        for rate_hz in [100.0, 1000.0, 10_000.0] {
            let sample_time = SampleTime::from_rate(rate_hz).unwrap();
            let leakage = Leakage { share: 0.4, time_constant_s: 2.0 };
            let (config, mut state) = (leakage.validate(sample_time).unwrap().quantize(), State::default());
            let input = Signal::from_num(500);
            for tick in 0..(4.0 * rate_hz) as u32 {
                let (from, to) = (f64::from(tick) / rate_hz, f64::from(tick + 1) / rate_hz);
                let charge = config.charge(&state, input);
                let mean = config.advance(&mut state, input, charge).to_num::<f64>();
                let lost = |time: f64| (-time / 2.0).exp();
                let exact = 300.0 + 200.0 * lost(from);
                let exact_mean = 300.0 + 200.0 * 2.0 * (lost(from) - lost(to)) * rate_hz;
                assert!((charge.to_num::<f64>() - exact).abs() < 1e-5, "{rate_hz} Hz, {from} s: {charge} {exact}");
                assert!((mean - exact_mean).abs() < 1e-5, "{rate_hz} Hz, {from} s: {mean} {exact_mean}");
            }
        }
    }

    #[test]
    fn a_setting_out_of_range_is_rejected_by_name() {
        let sample_time = SampleTime::from_rate(1000.0).unwrap();
        let named =
            |share, time_constant_s| Leakage { share, time_constant_s }.validate(sample_time).unwrap_err().field;
        assert_eq!(named(1.1, 5.0), "leakage.share");
        assert_eq!(named(f64::NAN, 5.0), "leakage.share");
        assert_eq!(named(0.1, 0.05), "leakage.tau_s");
    }
}
