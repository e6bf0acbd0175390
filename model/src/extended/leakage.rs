//! Leakage of charge: the stiffness falls back while the voltage stays.
//!
//! ```text
//! q = f - share l,    dl/dt = (f - l) / tau,    l = 0 at rest
//! ```
//!
//! `f` is held between ticks, and `l` is exact. But `q` moves while it is held, and the [lags](super::lags) behind it take
//! one number a tick: they get its mean over the sample time,
//! `q - share m (f - l)` with `m = 1 - (1 - exp(-T / tau)) T^-1 tau`, which leaves an error of less than
//! `share |f - l| T^2 / (12 tau tau_lag)` where `q` itself would leave `share |f - l| T / (2 tau)`.

use crate::coefficient::{Rate, Sum, Weight, saturated, upper};
use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, Signal};

/// Loss of charge through the spring's own resistance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leakage {
    /// Part that is lost in the end, 0 to 1.
    pub share: f64,
    /// Its time constant, in s, 100 sample times to 100 000 s.
    pub time_constant_s: f64,
}

impl Leakage {
    /// # Errors
    /// [`OutOfRange`] names `leakage.share` or `leakage.tau_s`.
    pub(super) fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        OutOfRange::check("leakage.share", self.share, 0.0..=1.0, "of the stiffness")?;
        OutOfRange::check("leakage.tau_s", self.time_constant_s, 100.0 * sample_time.seconds()..=1e5, "s")
    }

    /// What part of a new input is lost at the end of a tick, and of its mean in the tick.
    pub(super) fn lost_in_a_tick(&self, sample_time: SampleTime) -> (f64, f64) {
        let ticks = self.time_constant_s / sample_time.seconds();
        let rate = sample_time.part_of_way(self.time_constant_s);
        (self.share * rate, self.share * (1.0 - rate * ticks))
    }
}

/// The leakage for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Config {
    share: Weight,
    /// share m
    until_mean: Weight,
    rate: Rate,
}

/// What has followed of the input, `l`.
pub(crate) type State = Accumulator;

impl Config {
    /// Of a leakage that [`Leakage::check`] accepts.
    pub(crate) fn new(leakage: &Leakage, sample_time: SampleTime) -> Self {
        let (_, until_mean) = leakage.lost_in_a_tick(sample_time);
        Self {
            share: Weight::new(leakage.share),
            until_mean: Weight::new(until_mean),
            rate: Rate::new(sample_time.part_of_way(leakage.time_constant_s)),
        }
    }

    /// What is left of `input` now.
    #[inline(always)]
    pub(crate) fn charge(&self, state: &State, input: Signal) -> Signal {
        let whole = Sum::from_bits(i64::from(input.to_bits()) << Weight::FRACTION_BITS);
        saturated(whole - self.share.of(upper(*state)))
    }

    /// One sample time passes with `input` held; the mean of what is left of it, which was `charge` at first.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut State, input: Signal, charge: Signal) -> Signal {
        let lag = input.saturating_sub(upper(*state));
        *state += self.rate.step(lag);
        charge.saturating_sub(saturated(self.until_mean.of(lag)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left at a tick, and its mean until the next, are those of the exponential.
    #[test]
    fn it_falls_back_exponentially() {
        for rate_hz in [100.0, 1000.0, 10_000.0] {
            let sample_time = SampleTime::from_rate(rate_hz).unwrap();
            let leakage = Leakage { share: 0.4, time_constant_s: 2.0 };
            let (config, mut state) = (Config::new(&leakage, sample_time), State::default());
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
    fn a_wrong_leakage_is_named() {
        let sample_time = SampleTime::from_rate(1000.0).unwrap();
        let named = |share, time_constant_s| Leakage { share, time_constant_s }.check(sample_time).unwrap_err().field;
        assert_eq!(named(1.1, 5.0), "leakage.share");
        assert_eq!(named(f64::NAN, 5.0), "leakage.share");
        assert_eq!(named(0.1, 0.05), "leakage.tau_s");
    }
}
