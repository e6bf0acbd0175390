//! The time-optimal pre-compensator: as far as the amplifier goes, until the target can be held; then held exactly.
//!
//! A spring whose answer to a step of voltage never falls is fastest at the end of the amplifier's range. The voltage
//! may leave it as soon as another one inside the range holds the target from there on, and no earlier. So in every tick
//! the law asks for the voltage that leads to the target by the end of the tick, and the amplifier's limits do the rest:
//!
//! ```text
//! now     stiffness just before the new voltage
//! then    stiffness at the end of the tick, were the last voltage held
//! next    = now + reach (target - now),   reach = 1 - exp(-T / tau)      (tau: the approach; 0: reach = 1, dead-beat)
//! u       : the stiffness at the end of the tick is `next`, which is next - then more than at the last voltage
//! ```
//!
//! - **No overshoot, no windup.** The estimator runs on the voltage that was really applied, so `now` and `then` know of
//!   every limit and of the DAC's rounding; there is no integrator.
//! - **Smooth.** `u` is a continuous function of state and target. At the target it falls back with the time constant
//!   `share * tau` of the spring's inverse, 0.5 s for the report's.
//! - **Without a bump.** `align` moves the target to where the last voltage leads; the difference fades.
//!
//! - **Slew.** Where the amplifier cannot bring its voltage back as fast as that, it begins earlier: `braking`.
//!
//! The same for every [`Estimator`]; what differs is how it inverts itself, [`Estimator::voltage_for`].

mod braking;

use self::braking::Braking;
use crate::coefficient::{Rate, Weight, saturated, upper};
use crate::error::OutOfRange;
use crate::estimator::{Estimator, Outlook, Promptness};
use crate::units::{Accumulator, SampleTime, Volts};

/// How fast the difference fades that a change of settings leaves, in s.
const HANDOVER_S: f64 = 0.1;

/// How the target is approached, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Time constant of the last part of the way, 0 (at once) to 1 s. More of it is slower, smoother where the target
    /// jumps, and asks for less voltage.
    pub time_constant_s: f64,
}

impl Approach {
    /// The fastest.
    pub const DEAD_BEAT: Self = Self { time_constant_s: 0.0 };

    /// # Errors
    /// [`OutOfRange`] names `approach_s`.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::check("approach_s", self.time_constant_s, 0.0..=1.0, "s")
    }
}

/// The pre-compensator for one spring and sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOptimal<I> {
    inverse: I,
    /// Part of the way to the target that is made in a tick.
    reach: Weight,
    /// Part of what rounding to a code took from the last voltage that is asked for again: a long approach asks for less
    /// than a code in a tick, and would otherwise stay where it is.
    kept: Weight,
    fading: Rate,
    braking: Option<Braking>,
}

/// Where the target is pursued from after a change of settings, less the target, in V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    handover: Accumulator,
}

impl<I: Copy> TimeOptimal<I> {
    /// `spring` is as prompt as this; `slew` has the spring's least promptness, and the volts that the amplifier makes in
    /// a tick, where that is a limit.
    pub(crate) fn new(
        approach: &Approach,
        inverse: I,
        spring: &Promptness,
        slew: Option<(Promptness, f64)>,
        sample_time: SampleTime,
    ) -> Self {
        let time_constant = approach.time_constant_s;
        let reach = if time_constant > 0.0 { sample_time.part_of_way(time_constant) } else { 1.0 };
        let braking = slew.map(|(least, step_v)| Braking::new(&least, step_v));
        let at_once = spring.at_once / (spring.at_once + spring.in_a_tick).max(1e-9);
        let kept = Weight::new((1.0 - reach) * at_once);
        let fading = Rate::new(sample_time.part_of_way(HANDOVER_S));
        Self { inverse, reach: Weight::new(reach), kept, fading, braking }
    }

    /// The voltage that this law asks for, before the amplifier's limits; `driven` is the last one after
    /// them, and `applied` what rounding made of it.
    #[inline(always)]
    pub(crate) fn voltage<E: Estimator<Inverse = I>>(
        &self,
        state: &mut State,
        target: Volts,
        spring: &E,
        spring_state: &E::State,
        driven: Volts,
        applied: Volts,
    ) -> Volts {
        let target = target.0.saturating_add(upper(state.handover));
        state.handover -= self.fading.step(upper(state.handover));
        let outlook = spring.outlook(spring_state, applied);
        let Outlook { now, then } = outlook;
        let way = saturated(self.reach.of(target.saturating_sub(now)));
        let mut change = way.saturating_sub(then.saturating_sub(now));
        if let Some(braking) = &self.braking {
            change = braking.limit(change, target, outlook);
        }
        let wanted = spring.voltage_for(spring_state, &self.inverse, applied, change);
        Volts(wanted.0.saturating_add(saturated(self.kept.of(driven.0.saturating_sub(applied.0)))))
    }

    /// Has the law ask for the `applied` voltage again.
    pub(crate) fn align<E: Estimator>(
        &self,
        state: &mut State,
        target: Volts,
        spring: &E,
        spring_state: &E::State,
        applied: Volts,
    ) {
        let Outlook { now, then } = spring.outlook(spring_state, applied);
        let way = self.reach.into(then.saturating_sub(now));
        let from = now.saturating_add(way).saturating_sub(target.0);
        state.handover = Accumulator::from_bits(i64::from(from.to_bits()) << 32);
    }
}
