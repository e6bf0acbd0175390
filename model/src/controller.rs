//! One tick of the whole controller.
//!
//! Important terms:
//!
//! - [`Settings`]: what a person writes, in SI units and floats. [`Settings::validate`] checks them once, off the hot
//!   path, and `Validated::quantize` turns them into a `Config`.
//! - [`Config`]: the same in fixed-point numbers, which is all that a tick sees.
//! - [`State`]: what the controller remembers from tick to tick.
//! - *target*: the desired stiffness expressed as the equivalent static voltage, in V.
//! - *pre-compensator*: shapes the voltage so that the spring reaches the target faster than by itself
//!   ([`Compensation`]).
//! - *bumpless transfer*: a change of the configuration that does not move the voltage.
//!
//! [`Config::tick`] does, in this order: target into the amplifier's range, correction by the sensor, pre-compensator,
//! amplifier limits and rounding, estimator on the applied voltage, integrator. What is remembered follows from the voltages that were put
//! out, from targets and from readings, and not from what a limit has held back. All types are generic over the spring; without a parameter
//! it is the plain one, [`Plant`].

use crate::amplifier::{self, Amplifier, Drive, Limits};
use crate::error::OutOfRange;
use crate::estimator::{self, Estimator, Invertible, Model, Plant};
use crate::feedback::{self, Feedback, Observed, Reading, Sensor};
use crate::pre_compensator::{self, Gains, ProportionalIntegral};
use crate::robust::{self, Aim, Margin, Robust};
use crate::time_optimal::{self, Approach, TimeOptimal};
use crate::units::{DacCode, SampleTime, ScaledStiffness, Signal, Volts};
use crate::validated::{Validate, Validated};

/// Everything the controller is built from, in SI units.
///
/// ```
/// use model::{Amplifier, Config, Input, OutOfRange, Settings, State, Volts};
///
/// fn main() -> Result<(), OutOfRange> {
///     let settings = Settings { amplifier: Amplifier::up_to(1000.0), ..Settings::PAPER };
///     let config: Config = settings.validate()?.quantize();
///     let mut state = State::default();
///     let input = Input { target: Volts::new(500.0)?, ..Input::default() };
///     // The voltage overshoots the target deliberately. After 4 s the stiffness is within 3 % of the target; with
///     // a constant 500 V it would have reached 280 V by then.
///     assert_eq!(config.tick(&mut state, input).applied.to_f64().round(), 1000.0);
///     let after_4_s = (1..4000).map(|_| config.tick(&mut state, input)).last().unwrap();
///     assert!((after_4_s.stiffness.to_f64() - 500.0).abs() < 0.03 * 500.0);
///     Ok(())
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<P = Plant> {
    /// Ticks per second, 100 to 10 000 Hz.
    pub rate_hz: f64,
    /// The spring that the estimator runs.
    pub plant: P,
    /// The pre-compensator.
    pub compensation: Compensation,
    /// The amplifier and its limits.
    pub amplifier: Amplifier,
    /// A stiffness sensor that corrects the estimate; `None` if there is no sensor.
    pub feedback: Option<Feedback>,
}

/// Choice of the pre-compensator, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compensation {
    /// No pre-compensator: the target is put out as the voltage.
    None,
    /// The source report's proportional-integral pre-compensator ([`crate::pre_compensator`]).
    ProportionalIntegral(Gains),
    /// The time-optimal pre-compensator, as fast as the amplifier allows ([`crate::time_optimal`]).
    TimeOptimal(Approach),
    /// The robust pre-compensator, as fast as a spring allows that is known to within errors ([`crate::robust`]).
    Robust(Margin),
}

impl Settings {
    /// The source report's spring, controller and range at 1 kHz.
    pub const PAPER: Self = Self {
        rate_hz: 1000.0,
        plant: Plant::PAPER,
        compensation: Compensation::ProportionalIntegral(Gains::PAPER),
        amplifier: Amplifier::PAPER,
        feedback: None,
    };
}

impl<P: Model> Settings<P> {
    /// Checks every field and returns the token with which the settings can be quantized.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first field outside its allowed range, its value and the range.
    pub fn validate(&self) -> Result<Validated<'_, Self>, OutOfRange> {
        let sample_time = SampleTime::from_rate(self.rate_hz)?;
        self.plant.check(sample_time)?;
        self.amplifier.check(sample_time)?;
        match &self.compensation {
            Compensation::None => {}
            Compensation::ProportionalIntegral(gains) => {
                gains.check(&self.plant.largest_step_gain(sample_time), sample_time)?;
            }
            Compensation::TimeOptimal(approach) => {
                self.plant.check_inverse()?;
                approach.check(sample_time)?;
            }
            Compensation::Robust(margin) => {
                self.plant.check_inverse()?;
                margin.check(sample_time)?;
                self.plant.check_differing(margin.factors(), sample_time)?;
            }
        }
        self.feedback.check(sample_time)?;
        Ok(Validated::new(self, sample_time))
    }
}

impl<P: Model> Validated<'_, Settings<P>> {
    /// Rounds the validated settings to the fixed-point numbers that a tick sees.
    pub fn quantize(self) -> Config<P::Config> {
        let (settings, sample_time) = (self.settings(), self.sample_time());
        let plant = self.part(&settings.plant);
        let step_v = settings.amplifier.slew_per_tick_v(sample_time);
        let resolution_v = settings.amplifier.volts_per_code();
        let is_robust = matches!(settings.compensation, Compensation::Robust(_));
        let pre_compensator = match &settings.compensation {
            Compensation::None => PreCompensator::None,
            Compensation::ProportionalIntegral(gains) => {
                let step_gain = settings.plant.largest_step_gain(sample_time);
                PreCompensator::ProportionalIntegral(self.part(gains).quantize(&step_gain))
            }
            Compensation::TimeOptimal(approach) => {
                PreCompensator::TimeOptimal(self.part(approach).quantize(&Invertible::new(plant, resolution_v), step_v))
            }
            Compensation::Robust(margin) => self.robust(margin),
        };
        Config {
            amplifier: self.part(&settings.amplifier).quantize(),
            estimator: P::quantize(plant),
            pre_compensator,
            feedback: settings.feedback.as_ref().map(|feedback| self.part(feedback).quantize(is_robust)),
        }
    }

    /// Quantizes the robust law. Not inlined: its second spring would be on the stack of every start.
    #[inline(never)]
    fn robust(&self, margin: &Margin) -> PreCompensator<P::Config> {
        let settings = self.settings();
        let quick = P::differing(self.part(&settings.plant), margin.factors(), settings.amplifier.volts_per_code());
        PreCompensator::Robust(self.part(margin).quantize(quick, &settings.amplifier))
    }
}

/// The quantized pre-compensator. A tag of its own is read faster than one hidden in 64 bits of a variant.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PreCompensator<E: Estimator> {
    None,
    ProportionalIntegral(ProportionalIntegral),
    TimeOptimal(TimeOptimal<E::Inverse>),
    Robust(Robust<E>),
}

/// A validated configuration, quantized for the tick.
// In this order the MCU's compiler needs no stack for a tick of the plain spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Config<E: Estimator = estimator::Config> {
    amplifier: amplifier::Config,
    estimator: E,
    pre_compensator: PreCompensator<E>,
    feedback: Option<feedback::Config>,
}

/// What the controller remembers from tick to tick; the default is a spring at rest at 0 V.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State<S = estimator::State> {
    estimator: S,
    pre_compensator: pre_compensator::State,
    time_optimal: time_optimal::State,
    robust: robust::State<S>,
    amplifier: amplifier::State,
    feedback: feedback::State,
}

impl<S> State<S> {
    /// Returns the correction that the sensor adds to the model's stiffness, in V.
    pub fn correction(&self) -> ScaledStiffness {
        self.feedback.correction()
    }
}

/// Input of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Input {
    /// Desired stiffness, expressed as the equivalent static voltage.
    pub target: Volts,
    /// Latest reading of the stiffness sensor; ignored without [`Settings::feedback`].
    pub measured: Option<Reading>,
}

/// Output of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The input's target, moved into the amplifier's range.
    pub target: Volts,
    /// Voltage after slew and range, before rounding to a code.
    pub voltage: Volts,
    /// Code to be written to the DAC.
    pub code: DacCode,
    /// Voltage across the spring while `code` is written.
    pub applied: Volts,
    /// Estimated stiffness just after `applied` was put across the spring: the model's, corrected by the sensor.
    pub stiffness: ScaledStiffness,
    /// Limits that acted in this tick.
    pub limits: Limits,
    /// Whether the stiffness sensor is trusted; `None` without [`Settings::feedback`].
    pub sensor: Option<Sensor>,
}

impl Output {
    /// Output of an amplifier that is off, across a spring at rest.
    #[inline(always)]
    fn off() -> Self {
        Self {
            target: Volts::ZERO,
            voltage: Volts::ZERO,
            code: DacCode(0),
            applied: Volts::ZERO,
            stiffness: ScaledStiffness(Signal::ZERO),
            limits: Limits::NONE,
            sensor: None,
        }
    }
}

impl<E: Estimator> Config<E> {
    /// Returns the lowest and the highest voltage that is put out, moved inward to the next DAC code.
    pub fn range(&self) -> (Volts, Volts) {
        self.amplifier.range()
    }

    /// Advances the controller by one tick. No heap, no float, no panic, no unbounded loop: the same bits on every
    /// machine.
    #[inline(always)]
    pub fn tick(&self, state: &mut State<E::State>, input: Input) -> Output {
        // Each part is stored as soon as it is known, so that it does not occupy a register until the end.
        let mut output = Output::off();
        let (target, limits) = self.amplifier.clamp_target(input.target);
        output.target = target;
        let (pursued, observed) = match &self.feedback {
            None => (target, None),
            Some(feedback) => {
                let (corrected, observed) = feedback.update(&mut state.feedback, target, input.measured);
                (self.amplifier.clamp_target(corrected).0, Some((feedback, observed)))
            }
        };
        let wanted = match &self.pre_compensator {
            PreCompensator::None => pursued,
            PreCompensator::ProportionalIntegral(it) => {
                it.voltage(&state.pre_compensator, pursued, self.estimator.operating_point(&state.estimator))
            }
            PreCompensator::TimeOptimal(it) => self.time_optimal(it, state, pursued),
            PreCompensator::Robust(it) => self.robust(it, state, target, pursued, observed),
        };
        let Drive { voltage, code, applied, limits } = self.amplifier.drive(&mut state.amplifier, wanted, limits);
        (output.voltage, output.code, output.applied, output.limits) = (voltage, code, applied, limits);
        let model = self.estimator.run(&mut state.estimator, applied);
        (output.stiffness, output.sensor) = self.estimate(&mut state.feedback, model);
        match &self.pre_compensator {
            PreCompensator::ProportionalIntegral(it) => it.track(&mut state.pre_compensator, voltage),
            PreCompensator::Robust(it) => it.run(&mut state.robust, applied),
            PreCompensator::None | PreCompensator::TimeOptimal(_) => (),
        }
        output
    }

    /// Advances the controller by one tick with the amplifier off: 0 V regardless of slew and range. The integrator is
    /// not advanced; [`Config::bumpless_transfer`] presets it. The sensor's readings are processed as in
    /// [`Config::tick`].
    pub fn rest(&self, state: &mut State<E::State>, measured: Option<Reading>) -> Output {
        let zero = Volts::ZERO;
        state.amplifier = amplifier::State::default();
        if let Some(feedback) = &self.feedback {
            feedback.update(&mut state.feedback, zero, measured);
        }
        let model = self.estimator.run(&mut state.estimator, zero);
        if let PreCompensator::Robust(it) = &self.pre_compensator {
            it.run(&mut state.robust, zero);
        }
        let (stiffness, sensor) = self.estimate(&mut state.feedback, model);
        Output { stiffness, sensor, ..Output::off() }
    }

    /// Returns the model's stiffness corrected by the sensor, and whether the sensor is trusted.
    #[inline(always)]
    fn estimate(&self, state: &mut feedback::State, model: ScaledStiffness) -> (ScaledStiffness, Option<Sensor>) {
        match &self.feedback {
            None => (model, None),
            Some(feedback) => feedback.estimate(state, model),
        }
    }

    /// Returns the voltage that the time-optimal law asks for. Not inlined, so that a tick with another pre-compensator
    /// keeps its registers.
    #[inline(never)]
    fn time_optimal(&self, it: &TimeOptimal<E::Inverse>, state: &mut State<E::State>, target: Volts) -> Volts {
        let State { estimator, time_optimal, amplifier, .. } = state;
        it.voltage(
            time_optimal,
            target,
            &self.estimator,
            estimator,
            amplifier.voltage(),
            self.amplifier.applied(amplifier),
        )
    }

    /// Returns the voltage that the robust law asks for. Not inlined, for the same reason.
    #[inline(never)]
    fn robust(
        &self,
        it: &Robust<E>,
        state: &mut State<E::State>,
        target: Volts,
        pursued: Volts,
        observed: Option<(&feedback::Config, Observed)>,
    ) -> Volts {
        let aim = self.aim(state, target, pursued);
        let correction = observed.map(|(config, observed)| (config, &state.feedback, observed));
        it.voltage(&mut state.robust, aim, correction)
    }

    fn aim(&self, state: &State<E::State>, target: Volts, pursued: Volts) -> Aim {
        let applied = self.amplifier.applied(&state.amplifier);
        let model = self.estimator.predict(&state.estimator, applied).now;
        Aim { target, pursued, model, driven: state.amplifier.voltage(), applied }
    }

    /// Makes this configuration take over a running `state` without moving the voltage: for the same `target`, the next
    /// voltage is the last one.
    ///
    /// To be called once after a change of gains, limits, plant or rate, and before the first tick after
    /// [`Config::rest`]. A new range that excludes the last voltage takes effect in the next tick, and without a
    /// pre-compensator the next voltage is the target.
    pub fn bumpless_transfer(&self, state: &mut State<E::State>, target: Volts) {
        state.feedback.transfer_to(self.feedback.as_ref());
        self.preset(state, target);
    }

    /// Returns the estimate under the last voltage just before the next tick.
    pub fn present(&self, state: &State<E::State>) -> ScaledStiffness {
        let model = self.estimator.predict(&state.estimator, self.amplifier.applied(&state.amplifier)).now;
        ScaledStiffness(model.saturating_add(state.correction().0))
    }

    /// Makes this configuration, which differs in the spring only, take over a running `state` without moving voltage and estimate:
    /// the sensor's correction is what makes the estimate `stiffness` again. Otherwise as [`Config::bumpless_transfer`].
    pub fn take_over(&self, state: &mut State<E::State>, target: Volts, stiffness: ScaledStiffness) {
        state.feedback.shift(stiffness.0.saturating_sub(self.present(state).0));
        self.preset(state, target);
    }

    /// Presets the pre-compensator so that for the same `target` the next voltage is the last one.
    fn preset(&self, state: &mut State<E::State>, target: Volts) {
        let (desired, _) = self.amplifier.clamp_target(target);
        let (target, _) = self.amplifier.clamp_target(state.feedback.corrected(desired));
        match &self.pre_compensator {
            PreCompensator::None => (),
            PreCompensator::ProportionalIntegral(it) => {
                let point = self.estimator.operating_point(&state.estimator);
                it.preset_integrator(&mut state.pre_compensator, state.amplifier.voltage(), target, point);
            }
            PreCompensator::TimeOptimal(it) => {
                let applied = self.amplifier.applied(&state.amplifier);
                it.preset_offset(&mut state.time_optimal, target, &self.estimator, &state.estimator, applied);
            }
            PreCompensator::Robust(it) => {
                let aim = self.aim(state, desired, target);
                it.transfer(&mut state.robust, aim, &state.estimator, state.feedback.is_trusted());
            }
        }
    }
}

#[cfg(test)]
mod tests;
