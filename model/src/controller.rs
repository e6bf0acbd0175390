//! One tick of the whole controller.
//!
//! [`Settings`] are what a person writes, in SI units and floats. [`Settings::check`] turns them, once and off the hot
//! path, into a [`Config`] of scaled fixed-point numbers, or into an error that names the field. [`Config::tick`] sees
//! nothing else. Each of them is written for any spring; without a name it is the plain one, [`Plant`].

use crate::amplifier::{self, Amplifier, Limits};
use crate::error::OutOfRange;
use crate::estimator::{self, Estimator, Model, Plant};
use crate::feedback::{self, Feedback, Reading, Sensor};
use crate::pre_compensator::{self, Gains, ProportionalIntegral};
use crate::time_optimal::{self, Approach, TimeOptimal};
use crate::units::{DacCode, SampleTime, ScaledStiffness, Volts};

/// Everything the controller is built from, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<P = Plant> {
    /// Ticks per second, 100 to 10 000 Hz.
    pub rate_hz: f64,
    /// The spring that the estimator runs.
    pub plant: P,
    /// How the voltage is led to its target.
    pub compensation: Compensation,
    /// The amplifier and its limits.
    pub amplifier: Amplifier,
    /// A stiffness sensor that corrects the estimate.
    pub feedback: Option<Feedback>,
}

/// Which pre-compensator, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compensation {
    /// None: the target is put out as it is.
    None,
    /// The report's.
    ProportionalIntegral(Gains),
    /// As fast as the amplifier allows.
    TimeOptimal(Approach),
}

impl Settings {
    /// The report's spring, controller and range at 1 kHz.
    pub const PAPER: Self = Self {
        rate_hz: 1000.0,
        plant: Plant::PAPER,
        compensation: Compensation::ProportionalIntegral(Gains::PAPER),
        amplifier: Amplifier::PAPER,
        feedback: None,
    };
}

impl<P: Model> Settings<P> {
    /// Scales the settings for the tick.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field, its value and what is allowed.
    pub fn check(&self) -> Result<Config<P::Config>, OutOfRange> {
        self.judge().map(|sample_time| self.scaled(sample_time))
    }

    /// The time between two ticks, if the settings can be scaled for it: [`Settings::check`] without making anything.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field, its value and what is allowed.
    pub fn judge(&self) -> Result<SampleTime, OutOfRange> {
        let sample_time = SampleTime::from_rate(self.rate_hz)?;
        self.plant.check(sample_time)?;
        self.amplifier.check()?;
        match &self.compensation {
            Compensation::None => {}
            Compensation::ProportionalIntegral(gains) => {
                gains.check(&self.plant.promptness(sample_time), sample_time)?;
            }
            Compensation::TimeOptimal(approach) => {
                self.plant.check_inverse()?;
                approach.check()?;
            }
        }
        self.feedback.as_ref().map_or(Ok(()), |feedback| feedback.check(sample_time))?;
        Ok(sample_time)
    }

    /// Of settings and the sample time that [`Settings::judge`] gives for them; of others, anything.
    pub fn scaled(&self, sample_time: SampleTime) -> Config<P::Config> {
        let estimator = self.plant.scaled(sample_time);
        let promptness = self.plant.promptness(sample_time);
        let pre_compensator = match &self.compensation {
            Compensation::None => PreCompensator::None,
            Compensation::ProportionalIntegral(gains) => {
                PreCompensator::ProportionalIntegral(ProportionalIntegral::new(gains, &promptness, sample_time))
            }
            Compensation::TimeOptimal(approach) => {
                let inverse = self.plant.inverse(&estimator, sample_time, self.amplifier.volts_per_code());
                let step_v = self.amplifier.step_v(sample_time);
                let slew = step_v.map(|step_v| (self.plant.least_promptness(sample_time), step_v));
                PreCompensator::TimeOptimal(TimeOptimal::new(approach, inverse, &promptness, slew, sample_time))
            }
        };
        Config {
            estimator,
            pre_compensator,
            amplifier: amplifier::Config::new(&self.amplifier, sample_time),
            feedback: self.feedback.as_ref().map(|feedback| feedback::Config::new(feedback, sample_time)),
        }
    }
}

/// How the voltage is led to its target. A tag of its own is read faster than one that hides in 64 bits of a variant.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PreCompensator<I> {
    /// The target is the voltage.
    None,
    /// Past the target and back, around the estimate.
    ProportionalIntegral(ProportionalIntegral),
    /// To where the target can be held, by the spring's inverse.
    TimeOptimal(TimeOptimal<I>),
}

/// A checked configuration, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config<E: Estimator = estimator::Config> {
    estimator: E,
    pre_compensator: PreCompensator<E::Inverse>,
    amplifier: amplifier::Config,
    feedback: Option<feedback::Config>,
}

/// What the controller remembers from tick to tick; the default is a spring at rest without voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State<S = estimator::State> {
    estimator: S,
    pre_compensator: pre_compensator::State,
    time_optimal: time_optimal::State,
    amplifier: amplifier::State,
    feedback: feedback::State,
}

impl<S> State<S> {
    /// What the sensor adds to the model, in V.
    pub fn correction(&self) -> ScaledStiffness {
        self.feedback.correction()
    }
}

/// What a tick is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Input {
    /// Static voltage of the desired stiffness.
    pub target: Volts,
    /// What the stiffness sensor said last; nobody asks for it without [`Settings::feedback`].
    pub measured: Option<Reading>,
}

/// What a tick says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The target that was pursued: the input's, held inside the amplifier's range.
    pub target: Volts,
    /// Voltage after slew and range, before rounding.
    pub voltage: Volts,
    /// What to write to the DAC now.
    pub code: DacCode,
    /// The voltage that `code` stands for.
    pub applied: Volts,
    /// Stiffness with `applied` just put across the spring, as the model says and the sensor corrects.
    pub stiffness: ScaledStiffness,
    /// The limits that acted.
    pub limits: Limits,
    /// Whether the stiffness sensor is trusted; none without [`Settings::feedback`].
    pub sensor: Option<Sensor>,
}

impl<E: Estimator> Config<E> {
    /// The range of voltages that is really used.
    pub fn range(&self) -> (Volts, Volts) {
        self.amplifier.range()
    }

    /// One tick: no heap, no float, no panic, no loop without bound.
    #[inline(always)]
    pub fn tick(&self, state: &mut State<E::State>, input: Input) -> Output {
        let (target, moved) = self.amplifier.reachable(input.target);
        let pursued = match &self.feedback {
            None => target,
            Some(feedback) => {
                let corrected = feedback.hear(&mut state.feedback, target, input.measured);
                self.amplifier.reachable(corrected).0
            }
        };
        let wanted = match &self.pre_compensator {
            PreCompensator::None => pursued,
            PreCompensator::ProportionalIntegral(it) => {
                it.voltage(&state.pre_compensator, pursued, self.estimator.pivot(&state.estimator))
            }
            PreCompensator::TimeOptimal(it) => self.time_optimal(it, state, pursued),
        };
        let drive = self.amplifier.drive(&mut state.amplifier, wanted);
        let model = self.estimator.run(&mut state.estimator, drive.applied);
        if let PreCompensator::ProportionalIntegral(it) = &self.pre_compensator {
            it.track(&mut state.pre_compensator, drive.voltage);
        }
        let (stiffness, sensor) = self.correct(&mut state.feedback, model);
        let limits = drive.limits.with(Limits::TARGET, moved);
        Output { target, voltage: drive.voltage, code: drive.code, applied: drive.applied, stiffness, limits, sensor }
    }

    /// One tick with the amplifier off: zero volts at once, whatever slew and range. The integrator waits for
    /// [`Config::adopt`]; the sensor is heard as ever.
    pub fn rest(&self, state: &mut State<E::State>, measured: Option<Reading>) -> Output {
        let (zero, code) = (Volts::ZERO, DacCode(0));
        state.amplifier = amplifier::State::default();
        if let Some(feedback) = &self.feedback {
            feedback.hear(&mut state.feedback, zero, measured);
        }
        let model = self.estimator.run(&mut state.estimator, zero);
        let (stiffness, sensor) = self.correct(&mut state.feedback, model);
        Output { target: zero, voltage: zero, code, applied: zero, stiffness, limits: Limits::NONE, sensor }
    }

    /// The estimate, and what is thought of the sensor.
    #[inline(always)]
    fn correct(&self, state: &mut feedback::State, model: ScaledStiffness) -> (ScaledStiffness, Option<Sensor>) {
        match &self.feedback {
            None => (model, None),
            Some(feedback) => feedback.correct(state, model),
        }
    }

    /// A function of its own, so that a tick which leads by other means keeps its registers.
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

    /// Takes over a running `state` without a bump: with the same `target`, the next voltage is the last one.
    ///
    /// For new gains, limits, plant or rate. A new range that excludes the last voltage still takes effect at once, and
    /// without a pre-compensator the voltage goes to the target.
    pub fn adopt(&self, state: &mut State<E::State>, target: Volts) {
        state.feedback.adopted_by(self.feedback.as_ref());
        let (target, _) = self.amplifier.reachable(target);
        let (target, _) = self.amplifier.reachable(state.feedback.corrected(target));
        match &self.pre_compensator {
            PreCompensator::None => (),
            PreCompensator::ProportionalIntegral(it) => {
                let pivot = self.estimator.pivot(&state.estimator);
                it.align(&mut state.pre_compensator, state.amplifier.voltage(), target, pivot);
            }
            PreCompensator::TimeOptimal(it) => {
                let applied = self.amplifier.applied(&state.amplifier);
                it.align(&mut state.time_optimal, target, &self.estimator, &state.estimator, applied);
            }
        }
    }
}
