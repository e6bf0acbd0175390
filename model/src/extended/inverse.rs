//! The extended spring's way back, against the order of its blocks: from a stiffness to the voltage that gives it.
//!
//! ```text
//! change of the stiffness at the end of a tick -> relaxation -> law -> memory -> voltage
//!                                                 more f        p      v
//! ```
//!
//! Through relaxation and leakage one volt more of `f`, held for a tick of length `T`, brings at its end
//!
//! ```text
//! H = share (1 - loss exp1(T / tau_l)) + (1 - loss m) sum_k weight_k exp1(T / tau_k),    exp1(x) = 1 - exp(-x)
//! ```
//!
//! with `loss` and `m` of the [leakage](super::leakage), whose effect on what was there before is not needed: the spring
//! is run ahead for it. Where the first time constant depends on the voltage, `1 / H` is that of the present voltage, taken for
//! straight between both ends. It bends the other way, so too little is asked for there; a voltage that is itself on its way
//! to quicker time constants brings more than was asked. What is left shrinks with every tick. [`law`] and [`memory`] are
//! inverted exactly.
//!
//! What it needs of a spring: no negative weight in the relaxation, a rising law, a memory that rises once all plays move.

use super::{Config, ExtendedPlant, Law, Memory, law, memory};
use crate::coefficient::{Steep, Weight};
use crate::error::OutOfRange;
use crate::estimator::demanded;
use crate::units::{SampleTime, Signal, signal};

/// The largest loss of charge that leaves something to hold a stiffness by.
const MOST_LOSS: f64 = 0.95;
/// The least gain of a relaxation.
const LEAST_GAIN: f64 = 0.01;

/// The way back for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inverse {
    demanded: Demanded,
    pub(super) law: law::Inverse,
    pub(super) memory: memory::Inverse,
}

/// `1 / H`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Demanded {
    at_zero: Steep,
    varying: Option<Varying>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Varying {
    at_end: Steep,
    end: Signal,
    /// 1 / end
    per_volt: Steep,
}

/// Whether a spring has a way back.
///
/// # Errors
/// [`OutOfRange`] names the field as [`ExtendedPlant`]'s blocks do.
pub(super) fn check(plant: &ExtendedPlant<'_>) -> Result<(), OutOfRange> {
    let ExtendedPlant { memory, law, leakage, relaxation } = plant;
    let mut gain = relaxation.share;
    for (_, weight) in relaxation.lags() {
        OutOfRange::check("relaxation.weights", weight, 0.0..=Weight::MOST, "to be led by its inverse")?;
        gain += weight;
    }
    OutOfRange::check("relaxation.weights", gain, LEAST_GAIN..=Weight::MOST, "with the share, in all")?;
    let loss = leakage.map_or(0.0, |leakage| leakage.share);
    OutOfRange::check("leakage.share", loss, 0.0..=MOST_LOSS, "of the stiffness, to be led by its inverse")?;
    law.as_ref().map_or(Ok(()), Law::check_inverse)?;
    memory.as_ref().map_or(Ok(()), Memory::check_inverse)
}

impl Inverse {
    /// Of a spring that [`check`] accepts, and that has become `config`.
    pub(super) fn new(plant: &ExtendedPlant<'_>, config: &Config, sample_time: SampleTime, resolution_v: f64) -> Self {
        let ExtendedPlant { law, leakage, relaxation, .. } = plant;
        let (lost, lost_in_mean) = leakage.map_or((0.0, 0.0), |leakage| leakage.lost_in_a_tick(sample_time));
        let demanded_at = |volts: f64| {
            let later: f64 = relaxation.lags_at(volts).map(|(tau, weight)| weight * sample_time.part_of_way(tau)).sum();
            Steep::new(demanded(relaxation.share * (1.0 - lost) + (1.0 - lost_in_mean) * later))
        };
        let varying = relaxation.varying().map(|tau| {
            let end_v = tau.end_v();
            Varying { at_end: demanded_at(end_v), end: signal(end_v), per_volt: Steep::new(1.0 / end_v) }
        });
        let memory = config.memory.as_ref().map(|bank| memory::Inverse::new(bank, resolution_v));
        Self {
            demanded: Demanded { at_zero: demanded_at(0.0), varying },
            law: law.as_ref().map(law::Inverse::new).unwrap_or_default(),
            memory: memory.unwrap_or_default(),
        }
    }

    /// How much more the law must answer, at this voltage, for a `change` of the stiffness.
    #[inline(always)]
    pub(super) fn more(&self, voltage: Signal, change: Signal) -> Signal {
        let Demanded { at_zero, varying } = &self.demanded;
        let at_zero = at_zero.times(change);
        match varying {
            None => at_zero,
            Some(Varying { at_end, end, per_volt }) => {
                let part = per_volt.times(voltage.max(Signal::ZERO).min(*end));
                let apart = at_end.times(change).saturating_sub(at_zero);
                // At most all of it.
                let more = (i64::from(apart.to_bits()) * i64::from(part.to_bits())) >> Signal::FRAC_NBITS;
                at_zero.saturating_add(Signal::from_bits(more as i32))
            }
        }
    }
}
