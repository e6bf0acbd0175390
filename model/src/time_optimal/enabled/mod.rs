//! The law with its settings and state, built with the feature `time-optimal`.

mod braking;

use self::braking::Braking;
use crate::coefficient::{Rate, Weight, saturated, upper, widened};
use crate::error::OutOfRange;
use crate::estimator::{Estimator, Invertible, Prediction};
use crate::units::{Accumulator, SampleTime, Volts};
use crate::validated::{Validate, Validated};

/// Time constant, in s, with which the offset of a bumpless transfer decays.
const OFFSET_DECAY_S: f64 = 0.1;

/// How the time-optimal pre-compensator approaches its target, in SI units.
///
/// ```
/// use model::{Approach, Compensation, Input, OutOfRange, Settings, State, Volts};
///
/// fn main() -> Result<(), OutOfRange> {
///     let compensation = Compensation::TimeOptimal(Approach::DEAD_BEAT);
///     let config = Settings { compensation, ..Settings::PAPER }.validate()?.quantize();
///     let mut state = State::default();
///     let input = Input { target: Volts::new(50.0)?, ..Input::default() };
///     // 550 V give 50 V instantaneously, through the feedthrough of 1/11; afterwards less voltage holds them.
///     assert!((config.tick(&mut state, input).applied.to_f64() - 550.0).abs() < 2.0);
///     let settled = (0..5000).map(|_| config.tick(&mut state, input)).last().unwrap();
///     assert!((settled.stiffness.to_f64() - 50.0).abs() < 0.1);
///     assert!((settled.applied.to_f64() - 50.0).abs() < 1.0);
///     Ok(())
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Time constant of the last part of the way, 0 to 1 s; 0 is dead-beat. A longer one is slower, smoother where the
    /// target jumps, and needs less voltage.
    pub time_constant_s: f64,
}

impl Approach {
    /// The fastest approach: the target is reached within one tick where the amplifier's range allows it.
    pub const DEAD_BEAT: Self = Self { time_constant_s: 0.0 };

    /// Returns an approach with a time constant in s, to be validated. `None` where the crate is built without the feature
    /// `time-optimal`.
    pub const fn new(time_constant_s: f64) -> Option<Self> {
        Some(Self { time_constant_s })
    }

    /// Returns the time constant of the last part of the way, in s.
    pub const fn time_constant_s(&self) -> f64 {
        self.time_constant_s
    }
}

impl Validate for Approach {
    fn check(&self, _: SampleTime) -> Result<(), OutOfRange> {
        OutOfRange::check("approach_s", self.time_constant_s, 0.0..=1.0, "s")
    }
}

/// The pre-compensator for one spring and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeOptimal<I> {
    inverse: I,
    /// Fraction of the distance to the target that is covered in a tick.
    approach: Weight,
    /// Fraction of the last voltage's rounding error that is asked for again: a long approach asks for less than a code
    /// in a tick, and would otherwise stay where it is.
    rounding: Weight,
    offset_decay: Rate,
    braking: Option<Braking>,
}

/// The offset that a bumpless transfer adds to the target, in V; the default is 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    offset: Accumulator,
}

impl Validated<'_, Approach> {
    /// Quantizes the law for a spring. `step_v` is the amplifier's largest change in a tick, in V, if the slew is limited.
    pub(crate) fn quantize<E: Estimator>(self, spring: &Invertible<E>, step_v: Option<f64>) -> TimeOptimal<E::Inverse> {
        let (time_constant, sample_time) = (self.settings().time_constant_s, self.sample_time());
        let Invertible { inverse, largest, smallest, .. } = *spring;
        let approach = if time_constant > 0.0 { sample_time.lag_fraction(time_constant) } else { 1.0 };
        let braking = step_v.map(|step_v| Braking::new(&smallest, step_v));
        let feedthrough = largest.feedthrough / (largest.feedthrough + largest.in_one_tick).max(1e-9);
        let rounding = Weight::new((1.0 - approach) * feedthrough);
        let offset_decay = Rate::new(sample_time.lag_fraction(OFFSET_DECAY_S));
        TimeOptimal { inverse, approach: Weight::new(approach), rounding, offset_decay, braking }
    }
}

impl<I: Copy> TimeOptimal<I> {
    /// Returns the voltage that this law asks for, before the amplifier's limits. `driven` is the last voltage after
    /// them, and `applied` the same rounded to a code.
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
        let target = target.0.saturating_add(upper(state.offset));
        state.offset -= self.offset_decay.step(upper(state.offset));
        let prediction = spring.predict(spring_state, applied);
        let Prediction { now, end } = prediction;
        let step = saturated(self.approach.times(target.saturating_sub(now)));
        let mut change = step.saturating_sub(end.saturating_sub(now));
        if let Some(braking) = &self.braking {
            change = braking.limit(change, target, prediction);
        }
        let wanted = spring.voltage_for(spring_state, &self.inverse, applied, change);
        Volts(wanted.0.saturating_add(saturated(self.rounding.times(driven.0.saturating_sub(applied.0)))))
    }

    /// Sets the offset so that the law asks for the last voltage, `applied`, again.
    pub(crate) fn preset_offset<E: Estimator>(
        &self,
        state: &mut State,
        target: Volts,
        spring: &E,
        spring_state: &E::State,
        applied: Volts,
    ) {
        let Prediction { now, end } = spring.predict(spring_state, applied);
        let distance = self.approach.divide(end.saturating_sub(now));
        state.offset = widened(now.saturating_add(distance).saturating_sub(target.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coefficient::WideGain;
    use crate::estimator::{Model, Plant, StepGain};

    fn time() -> SampleTime {
        SampleTime::from_rate(1000.0).unwrap()
    }

    #[test]
    fn an_approach_takes_up_to_a_second() {
        let checked = |seconds| {
            let approach = Approach::new(seconds).unwrap();
            assert!(approach.time_constant_s().to_bits() == seconds.to_bits());
            approach.validate(time()).map(drop).map_err(|error| error.field)
        };
        assert_eq!([0.0, 0.25, 1.0].map(checked), [Ok(()); 3]);
        assert_eq!([-0.1, 1.1, f64::NAN].map(checked), [Err("approach_s"); 3]);
    }

    fn law(time_constant_s: f64) -> TimeOptimal<WideGain> {
        let spring = Invertible::new(Plant::PAPER.validate(time()).unwrap(), 0.17);
        Approach { time_constant_s }.validate(time()).unwrap().quantize(&spring, None)
    }

    #[test]
    fn an_offset_decays_with_a_tenth_of_a_second() {
        let (law, spring) = (law(0.0), Plant::PAPER.validate(time()).unwrap().quantize());
        let mut state = State { offset: Accumulator::from_num(100) };
        for _ in 0..100 {
            law.voltage(&mut state, Volts::ZERO, &spring, &Default::default(), Volts::ZERO, Volts::ZERO);
        }
        let expected = 100.0 * (-1f64).exp();
        assert!((state.offset.to_num::<f64>() - expected).abs() < 1e-3, "{}", state.offset);
    }

    /// A dead-beat approach covers the whole distance in a tick, and asks for no rounding error again.
    #[test]
    fn an_approach_covers_its_part_of_the_distance_in_a_tick() {
        let StepGain { feedthrough, in_one_tick, .. } = Plant::PAPER.largest_step_gain(time());
        for (seconds, covered) in
            [(0.0, 1.0), (-0.0, 1.0), (0.1, 1.0 - (-0.01f64).exp()), (1.0, 1.0 - (-1e-3f64).exp())]
        {
            let law = law(seconds);
            let asked = (1.0 - covered) * feedthrough / (feedthrough + in_one_tick);
            assert!((law.approach.to_f64() - covered).abs() < 1e-8, "{seconds} s: {:?}", law.approach);
            assert!((law.rounding.to_f64() - asked).abs() < 1e-8, "{seconds} s: {:?}", law.rounding);
        }
    }
}
