//! The extended spring's inverse, against the order of its blocks: from a change of the stiffness to the voltage that
//! gives it.
//!
//! Important terms:
//!
//! - *step gain*, `H`: the change of the stiffness at the end of a tick for one volt more of the law's output, held for
//!   that tick, in V/V.
//! - *inverse gain*: `1 / H`, bounded, in V/V.
//!
//! ```text
//! change of the stiffness at the end of a tick -> relaxation -> law -> memory -> voltage
//!                                               change of f      p      v
//! ```
//!
//! Through relaxation and leakage, for a tick of length `T`,
//!
//! ```text
//! H = share (1 - loss r(T / tau_l)) + (1 - loss m) sum_k weight_k r(T / tau_k),    r(x) = 1 - exp(-x)
//! ```
//!
//! with `loss` and `m` of the [leakage](super::leakage). The effect of earlier voltages is not part of `H`: it is in
//! the prediction. Where the first time constant depends on the voltage, `1 / H` is interpolated linearly at the
//! present voltage. Its curve bends the other way, so too little is asked for there; a voltage that is itself moving to
//! shorter time constants has more effect than was asked for. The remaining distance shrinks with every tick. [`law`]
//! and [`memory`] are inverted exactly.
//!
//! An invertible spring has no negative weight in the relaxation, a rising law, and a memory that rises once all plays
//! move.

use super::leakage::Leakage;
use super::plant::ExtendedPlant;
use super::{law, memory};
use crate::coefficient::{Weight, WideGain};
use crate::error::OutOfRange;
use crate::estimator::inverse_gain;
use crate::units::{SampleTime, Signal, signal};

/// Largest share of a leakage with which a stiffness can still be held.
const MAX_LOSS: f64 = 0.95;
/// Smallest static gain of a relaxation that can be inverted.
const MIN_GAIN: f64 = 0.01;

/// The inverse for one sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inverse {
    at_zero: WideGain,
    varying: Option<Varying>,
    pub(super) law: law::Inverse,
    pub(super) memory: memory::Inverse,
}

/// The inverse gain where the first time constant depends on the voltage: linear from 0 V to `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Varying {
    at_end: WideGain,
    end: Signal,
    /// 1 / end
    per_volt: WideGain,
}

/// Checks that a spring can be inverted.
///
/// # Errors
/// [`OutOfRange`] names the field as the blocks of [`ExtendedPlant`] do.
pub(super) fn check(plant: &ExtendedPlant<'_>) -> Result<(), OutOfRange> {
    let ExtendedPlant { memory, law, leakage, relaxation } = plant;
    let mut gain = relaxation.share;
    for (_, weight) in relaxation.lags() {
        OutOfRange::check("relaxation.weights", weight, 0.0..=Weight::MAX, "for the spring to be invertible")?;
        gain += weight;
    }
    OutOfRange::check("relaxation.weights", gain, MIN_GAIN..=Weight::MAX, "in total, share included")?;
    let loss = leakage.map_or(0.0, |leakage| leakage.share);
    OutOfRange::check("leakage.share", loss, 0.0..=MAX_LOSS, "of the stiffness, for the spring to be invertible")?;
    law.as_ref().map_or(Ok(()), law::Law::check_inverse)?;
    memory.as_ref().map_or(Ok(()), memory::Memory::check_inverse)
}

impl Inverse {
    /// Quantizes the inverse of a spring that [`check`] accepts and whose memory has become `bank`; `resolution_v` is
    /// the voltage of one DAC code.
    pub(super) fn new(
        plant: &ExtendedPlant<'_>,
        bank: Option<&memory::Config>,
        sample_time: SampleTime,
        resolution_v: f64,
    ) -> Self {
        let ExtendedPlant { law, leakage, relaxation, .. } = plant;
        let loss = |leakage: Leakage| leakage.loss_in_one_tick(sample_time);
        let (lost, lost_in_mean) = leakage.map_or((0.0, 0.0), loss);
        let gain_at = |volts: f64| {
            let lags: f64 = relaxation.lags_at(volts).map(|(tau, weight)| weight * sample_time.lag_fraction(tau)).sum();
            WideGain::new(inverse_gain(relaxation.share * (1.0 - lost) + (1.0 - lost_in_mean) * lags))
        };
        let varying = relaxation.varying().map(|tau| {
            let end_v = tau.end_v();
            Varying { at_end: gain_at(end_v), end: signal(end_v), per_volt: WideGain::new(1.0 / end_v) }
        });
        Self {
            at_zero: gain_at(0.0),
            varying,
            law: law.as_ref().map(law::Inverse::new).unwrap_or_default(),
            memory: bank.map(|bank| memory::Inverse::new(bank, resolution_v)).unwrap_or_default(),
        }
    }

    /// Returns the change of the law's output that gives a `change` of the stiffness at this voltage, in V.
    #[inline(always)]
    pub(super) fn change_of_law(&self, voltage: Signal, change: Signal) -> Signal {
        let at_zero = self.at_zero.times(change);
        match &self.varying {
            None => at_zero,
            Some(Varying { at_end, end, per_volt }) => {
                // 0 to 1.
                let part = per_volt.times(voltage.max(Signal::ZERO).min(*end));
                let difference = at_end.times(change).saturating_sub(at_zero);
                let more = (i64::from(difference.to_bits()) * i64::from(part.to_bits())) >> Signal::FRAC_NBITS;
                at_zero.saturating_add(Signal::from_bits(more as i32))
            }
        }
    }
}
