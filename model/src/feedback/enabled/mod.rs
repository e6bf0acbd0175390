//! The correction with its settings and state, built with the feature `feedback`.
//!
//! Readings come in through [`fault_detection`], which rejects what cannot be true; [`influence`] clips what remains, and corrects a
//! spring whose [`response`] shows no delay more quickly, and [`oscillation`] reduces the gain if the loop oscillates. What goes out is the
//! corrected target and the corrected estimate.

mod envelope;
pub mod fault_detection;
mod influence;
pub mod oscillation;
mod response;
mod settings;

pub use fault_detection::{Fault, Sensor};
pub use settings::{Feedback, HISTORY, Reading};

use self::influence::{Influence, PROMPT_SHIFT};
use self::response::Response;
use super::Observed;
use crate::coefficient::{Rate, upper, widened};
use crate::units::{Accumulator, ScaledStiffness, Signal, Volts};
use crate::validated::Validated;

/// The correction for one sensor and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    gain: Rate,
    fade: Rate,
    influence: influence::Config,
    detection: fault_detection::Config,
    oscillation: oscillation::Config,
}

/// State of the correction; the default is that of a sensor from which no reading has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    correction: Accumulator,
    /// Ring buffer of the model's stiffness at the last ticks.
    model: [Signal; HISTORY],
    newest: u8,
    response: Response,
    influence: influence::State,
    detection: fault_detection::State,
    oscillation: oscillation::State,
}

impl Validated<'_, Feedback> {
    /// Quantizes the correction for the tick. `is_quick`: readings that show a spring ahead of its model are used without delay.
    pub(crate) fn quantize(self, is_quick: bool) -> Config {
        let (feedback, sample_time) = (self.settings(), self.sample_time());
        let detection = fault_detection::Config::new(feedback, sample_time);
        Config {
            gain: Rate::new(feedback.gain()),
            fade: Rate::new(sample_time.lag_fraction(feedback.fade_s)),
            influence: influence::Config::new(feedback.interval_s, detection.noise(), is_quick),
            detection,
            oscillation: oscillation::Config::new(feedback.interval_s, sample_time),
        }
    }
}

impl Config {
    /// First half of a tick, before its voltage: updates the correction with the latest reading, or lets it decay while
    /// the sensor is not trusted. Returns the stiffness to which the model has to be brought for the spring to reach
    /// `target`, and what became of the reading.
    #[inline]
    pub(crate) fn update(&self, state: &mut State, target: Volts, reading: Option<Reading>) -> (Volts, Observed) {
        self.oscillation.track_target(&mut state.oscillation, target.0);
        let correction = upper(state.correction);
        let sample = reading.map(|reading| {
            let model = state.model_at(reading.age);
            fault_detection::Sample { reading, model, mismatch: reading.stiffness.0.saturating_sub(model) }
        });
        let accepted = self.detection.evaluate(&mut state.detection, sample);
        let (step, observed) = match (state.detection.sensor(), accepted) {
            (Sensor::Trusted, Some(mismatch)) => {
                self.oscillation.detect(&mut state.oscillation, mismatch, self.detection.noise());
                let (innovation, model) = (mismatch.saturating_sub(correction), state.model_at(0));
                let recent = state.detection.model_envelope();
                let Influence { clipped, quick, observed } = self.influence.of(
                    (&mut state.influence, &mut state.response),
                    innovation,
                    correction,
                    model,
                    recent,
                );
                let step = self.gain.step(clipped).saturating_add(widened(quick));
                (state.oscillation.reduce(step), observed)
            }
            (Sensor::Trusted, None) => (Accumulator::ZERO, Observed::Nothing),
            _ => {
                state.forget();
                (self.fade.step(Signal::ZERO.saturating_sub(correction)), Observed::Untrusted)
            }
        };
        state.correction = state.correction.saturating_add(step);
        (state.corrected(target), observed)
    }

    /// Lets `seen` follow a signal as the correction follows the mismatch: by the gain at a reading, more quickly where the spring is prompt,
    /// without delay at a reading that shows it ahead, all reduced after an oscillation, and back to 0 V while the sensor is not trusted.
    #[inline]
    #[cfg_attr(not(feature = "robust"), allow(dead_code, reason = "only the robust pre-compensator needs it"))]
    pub(crate) fn follow(&self, state: &State, observed: Observed, seen: &mut Accumulator, signal: Signal) {
        let distance = |to: Signal| to.saturating_sub(upper(*seen));
        let by_gain = || self.gain.step(distance(signal));
        let step = match observed {
            Observed::Reading => state.oscillation.reduce(by_gain()),
            Observed::Prompt => {
                let without_delay = widened(distance(signal)) >> PROMPT_SHIFT;
                state.oscillation.reduce(by_gain().saturating_add(without_delay))
            }
            // As much of it as the correction has taken of the innovation.
            Observed::Ahead => state.oscillation.reduce(widened(distance(signal)) - (widened(distance(signal)) >> 2)),
            Observed::Nothing => Accumulator::ZERO,
            Observed::Untrusted => self.fade.step(distance(Signal::ZERO)),
        };
        *seen = seen.saturating_add(step);
    }

    /// Second half of a tick, after its voltage was applied: records the model's stiffness. Returns the corrected
    /// estimate, and whether the sensor is trusted.
    #[inline]
    pub(crate) fn estimate(&self, state: &mut State, model: ScaledStiffness) -> (ScaledStiffness, Option<Sensor>) {
        self.detection.track_model(&mut state.detection, model.0);
        state.newest = state.newest.wrapping_add(1);
        if let Some(newest) = state.model.get_mut(usize::from(state.newest) % HISTORY) {
            *newest = model.0;
        }
        (ScaledStiffness(model.0.saturating_add(upper(state.correction))), Some(state.detection.sensor()))
    }
}

impl State {
    /// Prepares the state for another configuration; `None` is one without a sensor.
    pub(crate) fn transfer_to(&mut self, config: Option<&Config>) {
        if config.is_some() {
            self.forget();
            self.oscillation = oscillation::State::default();
        } else {
            *self = Self::default();
        }
    }

    /// Forgets what the last readings have shown: they say nothing about the ones to come, and a movement that has begun is not rated.
    #[inline]
    fn forget(&mut self) {
        self.influence.forget();
        self.response = Response::Unknown;
    }

    /// Shifts the correction by a jump of the model that the spring has not made, and what the readings are compared with.
    pub(crate) fn shift(&mut self, by: Signal) {
        self.correction = self.correction.saturating_add(widened(by));
        self.detection.shift(by);
    }

    /// Returns the stiffness to which the model has to be brought for the spring to reach `target`: `target - d`.
    #[inline]
    pub(crate) fn corrected(&self, target: Volts) -> Volts {
        Volts(target.0.saturating_sub(upper(self.correction)))
    }

    /// Returns whether the sensor is trusted.
    pub(crate) fn is_trusted(&self) -> bool {
        self.detection.sensor() == Sensor::Trusted
    }

    /// Returns the correction `d` that is added to the model's stiffness, in V.
    pub fn correction(&self) -> ScaledStiffness {
        ScaledStiffness(upper(self.correction))
    }

    /// Returns the model's stiffness `age` ticks before the last one.
    #[inline]
    fn model_at(&self, age: u16) -> Signal {
        // The length of the ring divides 256: the index may wrap.
        let index = usize::from(self.newest.wrapping_sub(age as u8)) % HISTORY;
        self.model.get(index).copied().unwrap_or(Signal::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::SampleTime;
    use crate::validated::Validate;

    fn quick() -> Config {
        Feedback::TYPICAL.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap().quantize(true)
    }

    /// Otherwise the margin would be kept for what the correction has taken, or given up for what it has not.
    #[test]
    fn what_is_seen_follows_as_much_as_the_correction_has_taken() {
        let (feedback, config) = (Feedback::TYPICAL, quick());
        let seen_in = |state: &State, observed| {
            let mut seen = widened(Signal::from_num(20));
            config.follow(state, observed, &mut seen, Signal::from_num(100));
            upper(seen).to_num::<f64>()
        };
        let seen = |observed| seen_in(&State::default(), observed);
        assert_eq!((seen(Observed::Nothing), seen(Observed::Ahead)), (20.0, 80.0));
        assert!((seen(Observed::Reading) - (20.0 + 80.0 * feedback.gain())).abs() < 1e-3);
        assert!((seen(Observed::Prompt) - (20.0 + 80.0 * (feedback.gain() + 1.0 / 16.0))).abs() < 1e-3);
        assert!((19.0..20.0).contains(&seen(Observed::Untrusted)));
        let reduced = State { oscillation: oscillation::State::reduced(1), ..State::default() };
        assert_eq!(seen_in(&reduced, Observed::Ahead), 20.0 + 60.0 / 4.0);
        assert!((seen_in(&reduced, Observed::Reading) - (20.0 + 80.0 / 4.0 * feedback.gain())).abs() < 1e-3);
    }

    /// What the sensor has corrected stays, unless the next configuration has no sensor; a movement that has begun is not rated.
    #[test]
    fn after_a_transfer_the_gain_is_not_reduced() {
        let running = State {
            correction: widened(Signal::from_num(20)),
            oscillation: oscillation::State::reduced(1),
            ..State::default()
        };
        let after = |config: Option<&Config>| {
            let mut state = running;
            state.transfer_to(config);
            state
        };
        let response = Response::Unknown;
        assert_eq!(after(Some(&quick())), State { response, oscillation: oscillation::State::default(), ..running });
        assert_eq!(after(None), State::default());
    }

    /// A spring that is two and a half deviations of the noise ahead of a model that moves.
    #[test]
    fn a_reading_before_a_time_without_trust_is_not_the_first_of_two() {
        let (config, volts) = (quick(), |volts: f64| ScaledStiffness(Signal::from_num(volts)));
        let ahead = Some(2.5 * Feedback::TYPICAL.noise_v);
        // Readings differ by 0.1 V, as equal ones would be those of a stuck sensor.
        let tick = |state: &mut State, number: u32, ahead: Option<f64>| {
            let model = 0.2 * f64::from(number);
            let reading = ahead.map(|ahead| model - 0.2 + ahead + 0.1 * (f64::from(number % 3) - 1.0));
            let reading = reading.map(|reading| Reading { stiffness: volts(reading), age: 0 });
            let (_, observed) = config.update(state, Volts(Signal::from_num(500)), reading);
            config.estimate(state, volts(model));
            observed
        };
        let (mut state, mut ticks) = (State::default(), 1..2000);
        for number in ticks.by_ref().take(500) {
            tick(&mut state, number, Some(0.0));
        }
        let number = ticks.next().unwrap();
        assert_eq!(tick(&mut state, number, ahead), Observed::Reading, "one ahead");
        let (mut next, number) = (state, ticks.next().unwrap());
        assert_eq!(tick(&mut next, number, ahead), Observed::Ahead, "two of them");
        assert!(ticks.any(|number| tick(&mut state, number, None) == Observed::Untrusted));
        let mut again = ticks.map(|number| tick(&mut state, number, ahead));
        assert_eq!(
            again.find(|observed| matches!(observed, Observed::Reading | Observed::Ahead)),
            Some(Observed::Reading)
        );
        assert_eq!(again.next(), Some(Observed::Ahead));
    }
}
