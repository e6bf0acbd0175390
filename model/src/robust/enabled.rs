//! The law with its state, built with the feature `robust`.

use super::Aim;
use super::fall_back::{FallBack, Phase, Thresholds};
use super::margin::{MISSING, Margin};
use crate::amplifier::Amplifier;
use crate::coefficient::{Weight, saturated, sum, upper, widened};
use crate::estimator::{Estimator, Invertible};
use crate::feedback::{self, Observed};
use crate::time_optimal::{self, Approach, TimeOptimal};
use crate::units::{Accumulator, Signal, Volts, signal};
use crate::validated::Validated;

/// Largest change of the voltage in the direction of a step while the sensor is trusted, in V/s.
const RISE_V_PER_S: f64 = 20e3;

/// The pre-compensator for one spring and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Robust<E: Estimator> {
    quick: E,
    law: TimeOptimal<E::Inverse>,
    /// Error of the gain, and the reciprocal of 1 more.
    gain: Weight,
    of_gain: Weight,
    /// Part of the unseen lead by which the target is moved, but from a fall back on.
    part: Weight,
    /// Overshoot that the quick spring may have where the sensor removes an error of the gain, and where it cannot.
    overshoot: Weight,
    overshoot_blind: Weight,
    /// Largest change of the voltage in a tick in the direction of a step while the sensor is trusted, in V.
    rise: Signal,
    fall_back: Option<Thresholds>,
}

/// The quick spring and what the sensor has shown; the default is a spring at rest at 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State<S> {
    quick: S,
    law: time_optimal::State,
    target: Signal,
    /// Change of stiffness that the present target asked for when it came.
    step: Signal,
    base: Signal,
    seen: Accumulator,
    /// Whether the sensor was trusted in the last tick.
    trusted: bool,
    phase: Phase,
    /// Half of the lead that was unseen when the target changed; the lead of the present step counts from there.
    lead_before: Signal,
}

impl Validated<'_, Margin> {
    /// Quantizes the law for the quick spring behind an amplifier.
    pub(crate) fn quantize<E: Estimator>(self, quick: Invertible<E>, amplifier: &Amplifier) -> Robust<E> {
        let step_v = amplifier.slew_per_tick_v(self.sample_time());
        let Margin { gain, overshoot, .. } = *self.settings();
        let fall_back = FallBack::design(self.settings(), quick.largest.feedthrough);
        Robust {
            law: self.part(&Approach::DEAD_BEAT).quantize(&quick, step_v),
            quick: quick.estimator,
            gain: Weight::new(gain),
            of_gain: Weight::new(1.0 / (1.0 + gain)),
            part: Weight::new(2.0 * overshoot / (overshoot + MISSING)),
            overshoot: Weight::new(overshoot),
            overshoot_blind: Weight::new(((1.0 + overshoot) / (1.0 + gain) - 1.0).max(0.0)),
            rise: signal(RISE_V_PER_S * self.sample_time().seconds()),
            fall_back: fall_back.map(|it| Thresholds::new(&it, &quick.largest, amplifier, self.sample_time())),
        }
    }
}

impl<E: Estimator> Robust<E> {
    /// Returns the voltage that this law asks for, before the amplifier's limits. `feedback` is the correction with its state, and
    /// what it did with the reading of this tick.
    #[inline(always)]
    pub(crate) fn voltage(
        &self,
        state: &mut State<E::State>,
        aim: Aim,
        feedback: Option<(&feedback::Config, &feedback::State, Observed)>,
    ) -> Volts {
        let blind = feedback.is_none_or(|(_, _, observed)| observed == Observed::Untrusted);
        let quick = self.quick.predict(&state.quick, aim.applied).now;
        let changed = aim.target.0 != state.target;
        if changed {
            (state.target, state.step) = (aim.target.0, aim.pursued.0.saturating_sub(aim.model));
        }
        if changed || state.trusted == blind {
            // What remains unseen is the same.
            state.seen = state.seen.saturating_sub(widened(self.by_gain(state, quick)));
            (state.base, state.trusted) = (quick, !blind);
            state.phase = if changed && blind { Phase::Before(Signal::ZERO) } else { Phase::Never };
        }
        let lead = self.lead(state, quick, aim.model);
        if let Some((feedback, correction, observed)) = feedback {
            feedback.follow(correction, observed, &mut state.seen, lead);
        }
        let overshoot = if blind { self.overshoot_blind } else { self.overshoot };
        let (seen, most) = (upper(state.seen), saturated(overshoot.times(state.step)));
        let unseen = lead.saturating_sub(seen);
        let (fall, part) = match &self.fall_back {
            None => (Signal::ZERO, self.part),
            Some(thresholds) => {
                if changed {
                    // A slow spring begins below the last target by what it still lacks, of which half remains at the end.
                    state.lead_before = unseen >> 1;
                }
                let gained = unseen.saturating_sub(state.lead_before);
                let missing = aim.pursued.0.saturating_sub(quick);
                let leads = (state.lead_before, gained);
                let fall = thresholds.fall(&mut state.phase, state.step, leads, missing, aim.driven.0);
                (fall, thresholds.part(state.phase, self.part))
            }
        };
        let unseen = saturated(part.times(unseen));
        let excess = unseen.max(most.min(Signal::ZERO)).min(most.max(Signal::ZERO));
        let wanted = aim.pursued.0.saturating_add(seen).saturating_add(excess).saturating_sub(fall);
        let wanted = self.without_gain(state, wanted);
        let voltage =
            self.law.voltage(&mut state.law, Volts(wanted), &self.quick, &state.quick, aim.driven, aim.applied);
        if blind {
            return voltage;
        }
        let driven = aim.driven.0;
        Volts(if state.step < Signal::ZERO {
            voltage.0.max(driven.saturating_sub(self.rise))
        } else {
            voltage.0.min(driven.saturating_add(self.rise))
        })
    }

    /// Holds `applied` across the quick spring for one sample time.
    #[inline(always)]
    pub(crate) fn run(&self, state: &mut State<E::State>, applied: Volts) {
        self.quick.run(&mut state.quick, applied);
    }

    /// Takes over from the model at `model` so that the law asks for the last voltage again: no lead is unseen. `trusted`: there is a
    /// sensor that is.
    pub(crate) fn transfer(&self, state: &mut State<E::State>, aim: Aim, model: &E::State, trusted: bool) {
        state.quick = *model;
        let quick = self.quick.predict(&state.quick, aim.applied).now;
        (state.target, state.step, state.base, state.trusted) = (aim.target.0, Signal::ZERO, quick, trusted);
        state.phase = Phase::Never;
        let lead = if trusted { self.lead(state, quick, aim.model) } else { Signal::ZERO };
        state.seen = widened(lead);
        let wanted = self.without_gain(state, aim.pursued.0.saturating_add(lead));
        self.law.preset_offset(&mut state.law, Volts(wanted), &self.quick, &state.quick, aim.applied);
    }

    /// How much farther than the model's stiffness `model` the quick spring may be whose stiffness is `quick` but for its gain.
    #[inline(always)]
    fn lead(&self, state: &State<E::State>, quick: Signal, model: Signal) -> Signal {
        quick.saturating_sub(model).saturating_add(self.by_gain(state, quick))
    }

    /// The part of the lead that is due to the gain; none where no sensor would show it.
    #[inline(always)]
    fn by_gain(&self, state: &State<E::State>, quick: Signal) -> Signal {
        if state.trusted { saturated(self.gain.times(quick.saturating_sub(state.base))) } else { Signal::ZERO }
    }

    /// Stiffness of the quick spring without its gain at which it has `wanted` with it.
    #[inline(always)]
    fn without_gain(&self, state: &State<E::State>, wanted: Signal) -> Signal {
        if !state.trusted {
            return wanted;
        }
        let base = state.base;
        saturated(sum(base).saturating_add(self.of_gain.times(wanted.saturating_sub(base))))
    }
}

#[cfg(test)]
impl<S> State<S> {
    /// Returns this state with the law's of another.
    pub(crate) fn with_law_of(self, other: &Self) -> Self {
        Self { law: other.law, ..self }
    }

    /// Returns what the present step has of its fall back.
    #[cfg(feature = "feedback")]
    pub(crate) fn phase(&self) -> Phase {
        self.phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::{self, Plant};
    use crate::units::SampleTime;
    use crate::validated::Validate;

    fn law(gain: f64, overshoot: f64) -> Robust<estimator::Config> {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let margin = Margin { gain, overshoot, ..Margin::TYPICAL };
        let quick = Invertible::new(Plant::PAPER.validate(time).unwrap(), 0.17);
        margin.validate(time).unwrap().quantize(quick, &Amplifier::PAPER)
    }

    fn near(got: Weight, expected: f64) -> bool {
        (got.to_f64() - expected).abs() < 1e-8
    }

    /// An error of the gain takes its part of the overshoot, and all of it if it is larger.
    #[test]
    fn without_a_sensor_the_overshoot_is_what_the_error_of_the_gain_leaves() {
        for (gain, overshoot, blind) in [(0.0, 0.02, 0.02), (0.25, 0.2, 0.0), (0.1, 0.155, 0.05), (0.02, 0.02, 0.0)] {
            let law = law(gain, overshoot);
            assert!(near(law.overshoot, overshoot) && near(law.overshoot_blind, blind), "{law:?}");
        }
    }

    /// 3 % of a step may be missing when it counts as done.
    #[test]
    fn the_target_is_moved_by_a_part_of_the_lead_that_grows_with_the_overshoot() {
        for (overshoot, part) in [(0.0, 0.0), (0.03, 1.0), (0.02, 0.8), (0.12, 1.6)] {
            assert!(near(law(0.0, overshoot).part, part), "{overshoot}");
        }
    }

    /// Asks for a target, in V, with a model at rest at `model`, without a sensor.
    fn ask(law: &Robust<estimator::Config>, state: &mut State<estimator::State>, target: f64, model: f64) -> Volts {
        let volts = |volts: f64| Volts::new(volts).unwrap();
        let (target, model) = (volts(target), volts(model).0);
        let aim = Aim { target, pursued: target, model, driven: Volts::ZERO, applied: Volts::ZERO };
        law.voltage(state, aim, None)
    }

    #[test]
    fn a_step_begins_with_the_target_or_with_the_trust_in_the_sensor() {
        let (law, mut state) = (law(0.1, 0.02), State::default());
        ask(&law, &mut state, 100.0, 0.0);
        assert_eq!((state.target, state.step), (Signal::from_num(100), Signal::from_num(100)));
        assert!(!state.trusted && state.base == Signal::ZERO && state.phase == Phase::Before(Signal::ZERO));
        (0..100).for_each(|_| law.run(&mut state, Volts::new(700.0).unwrap()));
        ask(&law, &mut state, 100.0, 0.0);
        assert_eq!(state.base, Signal::ZERO, "the same step");
        ask(&law, &mut state, 200.0, 0.0);
        let quick = state.base;
        assert!(quick > Signal::ZERO && state.phase == Phase::Before(Signal::ZERO), "another step");
        (0..100).for_each(|_| law.run(&mut state, Volts::new(700.0).unwrap()));
        state.trusted = true;
        ask(&law, &mut state, 200.0, 0.0);
        assert!(!state.trusted && state.base > quick && state.phase == Phase::Never, "the trust is lost");
    }

    /// What remains unseen of the step before, half of which remains at the end of this one.
    #[test]
    fn with_a_fall_back_the_lead_of_a_step_counts_from_half_of_that_before() {
        let margin = Margin { share: 0.0, fall_back: 0.25, ..Margin::TYPICAL };
        let time = SampleTime::from_rate(1000.0).unwrap();
        let quick = Invertible::new(Plant::PAPER.validate(time).unwrap(), 0.17);
        let law = margin.validate(time).unwrap().quantize(quick, &Amplifier::up_to(1000.0));
        let mut state = State::default();
        (0..1000).for_each(|_| law.run(&mut state, Volts::new(700.0).unwrap()));
        ask(&law, &mut state, 200.0, 40.0);
        let lead = law.quick.predict(&state.quick, Volts::ZERO).now - Signal::from_num(40);
        assert!(law.fall_back.is_some() && lead > Signal::from_num(10));
        assert_eq!(state.lead_before, lead >> 1);
    }

    /// After a transfer there is no step yet; the correction asks for 50 V of stiffness more.
    #[cfg(feature = "feedback")]
    #[test]
    fn with_a_trusted_sensor_the_voltage_rises_slowly_without_a_step_too() {
        let (law, volts) = (law(0.0, 0.02), |volts: f64| Volts::new(volts).unwrap());
        let config =
            feedback::Feedback::TYPICAL.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize(true);
        let (last, target) = (volts(100.0), volts(100.0).0);
        let mut state = State { target, trusted: true, ..State::default() };
        let aim = Aim { target: volts(100.0), pursued: volts(150.0), model: target, driven: last, applied: last };
        let correction = Some((&config, &feedback::State::default(), Observed::Reading));
        let voltage = law.voltage(&mut state, aim, correction);
        assert_eq!(state.step, Signal::ZERO);
        assert_eq!(voltage.0, last.0 + law.rise);
    }

    #[test]
    fn the_lead_is_that_of_the_quick_spring_and_of_its_gain() {
        let (law, volts) = (law(0.1, 0.02), |volts: i32| Signal::from_num(volts));
        let lead = |trusted| law.lead(&State { base: volts(20), trusted, ..State::default() }, volts(120), volts(90));
        assert_eq!(lead(false), volts(30));
        assert!((lead(true) - volts(40)).abs() < Signal::from_num(1e-5));
    }

    #[test]
    fn a_gain_is_taken_out_from_where_the_sensor_was_trusted() {
        let (law, volts) = (law(0.25, 0.02), |volts: i32| Signal::from_num(volts));
        let trusted = State { base: volts(100), trusted: true, ..State::default() };
        assert!((law.without_gain(&trusted, volts(225)) - volts(200)).abs() < Signal::from_num(1e-5));
        let blind = State { trusted: false, ..trusted };
        assert_eq!(law.without_gain(&blind, volts(225)), volts(225));
    }
}
