//! Detection of the sensor's faults: whether its readings may correct the model.
//!
//! Important terms:
//!
//! - *reading*, `m`, and *model*, `y`: measured and modelled stiffness at the same moment, in V.
//! - *mismatch*: `m - y`, in V.
//! - *deviation*: the mismatch minus the low-passed mismatch of the accepted readings, in V.
//! - *moved*: the range that the model has covered recently, between its upper and its lower envelope, which return to
//!   the model within about 0.5 s.
//! - *gate*: `6 noise_v + 2 moved`, the largest deviation of an accepted reading, in V.
//! - *accepted*: a new reading in which no fault was found, of a trusted sensor. Only accepted readings correct the
//!   model.
//!
//! Each reading is compared with the model, in constant time:
//!
//! | fault | what is detected | detected within |
//! | --- | --- | --- |
//! | [`Absent`](Fault::Absent) | no new reading | `oldest_s` and [`MISSED_INTERVALS`] intervals |
//! | [`Stale`](Fault::Stale) | no new reading, and the present one is older than `oldest_s` | the same |
//! | [`Stuck`](Fault::Stuck) | [`IDENTICAL_AT_REST`] readings with identical bits, or [`IDENTICAL`] while the model moved by more than `6 noise_v` | as many intervals, and that movement |
//! | [`Jumping`](Fault::Jumping) | [`REJECTED`] readings in a row whose deviation exceeds the gate, or which changed abruptly both from the accepted readings and from the reading before | [`REJECTED`] intervals |
//! | [`OutOfRange`](Fault::OutOfRange) | [`REJECTED`] readings in a row outside the sensor's range | [`REJECTED`] intervals |
//!
//! The gate is wide enough for a model that is wrong by up to twice its own movement (a share of 0.25 where it assumes
//! 0.09, with full overshoot): that is no jump.
//!
//! Readings with noise of `noise_v` repeat by rounding only. If a sensor rounds to twice its noise, one row of 100 in
//! 10^10 is identical (0.78^99, starting from the middle of a step); a sensor that rounds more coarsely is rejected as
//! stuck. *Abruptly* means by more than `9 noise_v` plus what a mode of [`FASTEST_MODE_HZ`] makes of the movement in
//! one interval: a spring that is late may jump once, but not back and forth.
//!
//! A single rejected reading is an outlier: it does not correct the model, and it is forgotten after
//! [`GOOD_PER_REJECTED`] good ones; so more than one outlier in five readings becomes a fault. A sensor is trusted, at
//! the start or again, after [`TRUSTED`] good readings in a row. After a jump the readings have to return to where they
//! were before it; that level is forgotten with the time constant [`FORGET_JUMP_S`], because the spring itself may have
//! changed.
//!
//! Not detectable: a sensor that shifts its readings slowly, or by less than the gate, which is wide while the model
//! moves. A wrong model, or a spring that is late, gives the same readings.

use super::super::SENSOR_NAMES;
use super::envelope::{self, Envelope};
use super::settings::{Feedback, Reading};
use crate::coefficient::{Rate, Weight, saturated, upper, widened};
use crate::units::{Accumulator, SampleTime, Signal, lag_fraction, signal};

/// Number of intervals without a new reading, beyond `oldest_s`, after which the sensor is absent.
pub const MISSED_INTERVALS: u32 = 4;
/// Number of identical readings in a row that are a fault while the model moves.
pub const IDENTICAL: u16 = 8;
/// Number of identical readings in a row that are a fault even at rest.
pub const IDENTICAL_AT_REST: u16 = 100;
/// Number of rejected readings in a row that are a fault.
pub const REJECTED: u16 = 4;
/// Number of good readings after which a rejected one is forgotten.
pub const GOOD_PER_REJECTED: u16 = 4;
/// Number of good readings in a row after which the sensor is trusted.
pub const TRUSTED: u16 = 50;
/// Width of the gate at rest, in standard deviations of a reading.
const SIGMAS: f64 = 6.0;
/// Highest frequency, in Hz, of an oscillation that the model may lack without its readings being rejected as jumps.
pub const FASTEST_MODE_HZ: f64 = 5.0;
/// Time constant of the low-pass of the mismatch, in accepted readings.
const LOW_PASS_READINGS: f64 = 4.0;
/// Time constant, in s, with which the level before a jump is forgotten.
pub const FORGET_JUMP_S: f64 = 30.0;

/// Whether the stiffness sensor is trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// The readings correct the estimate.
    Trusted,
    /// The correction decays, and the loop runs on the model alone.
    Failed(Fault),
}

impl Sensor {
    /// Returns a stable lower-case name for logs: `trusted`, or the fault.
    pub const fn name(self) -> &'static str {
        SENSOR_NAMES[self.code() as usize]
    }

    /// Returns true if the readings correct the estimate.
    pub const fn is_trusted(self) -> bool {
        matches!(self, Self::Trusted)
    }

    /// Returns the stable number for frames: the index of the name in [`SENSOR_NAMES`], never 0.
    pub const fn code(self) -> u8 {
        match self {
            Self::Trusted => 1,
            Self::Failed(Fault::Absent) => 2,
            Self::Failed(Fault::Stale) => 3,
            Self::Failed(Fault::Stuck) => 4,
            Self::Failed(Fault::Jumping) => 5,
            Self::Failed(Fault::OutOfRange) => 6,
        }
    }
}

/// Fault of the stiffness sensor; the module's table states how each is detected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    /// There is no new reading, or there are not enough good ones yet.
    #[default]
    Absent,
    /// The readings are too old.
    Stale,
    /// The readings do not change although the stiffness does.
    Stuck,
    /// The readings change although the stiffness does not.
    Jumping,
    /// The readings are outside the sensor's range.
    OutOfRange,
}

/// A reading and the model's stiffness at the same moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub reading: Reading,
    /// The model's stiffness when the sensor sampled.
    pub model: Signal,
    /// The reading minus the model's stiffness.
    pub mismatch: Signal,
}

/// Bounds for one sensor and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    /// `6 noise_v`, in V.
    noise: Signal,
    lowest: Signal,
    highest: Signal,
    /// Highest age of a reading, in ticks.
    oldest: u16,
    /// Ticks without a new reading after which the sensor is absent.
    timeout: u32,
    envelope: envelope::Config,
    /// Largest change of an oscillation in one interval, as a fraction of its range.
    oscillation: Weight,
    low_pass: Rate,
    forget_jump: Rate,
}

/// State of the detection; the default is that of a sensor from which no reading has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    diagnosis: Diagnosis,
    /// Ticks since the last new reading was sampled.
    since: u32,
    /// Low-pass of the accepted readings' mismatch.
    mismatch: Accumulator,
    /// Rejected readings, each counted `GOOD_PER_REJECTED` times, less the good ones since.
    rejected: u16,
    /// Good readings in a row.
    good: u16,
    /// Mismatch of the last reading.
    last: Signal,
    /// Number of identical readings in a row.
    identical: u16,
    /// The last reading, and the model when it came for the first time.
    reading: Signal,
    model: Signal,
    /// Envelope of the model.
    envelope: Envelope,
}

/// The present fault, if any; a sensor from which no reading has come is absent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Diagnosis(Option<Fault>);

impl Default for Diagnosis {
    fn default() -> Self {
        Self(Some(Fault::Absent))
    }
}

impl State {
    #[inline]
    pub(super) fn sensor(&self) -> Sensor {
        self.diagnosis.0.map_or(Sensor::Trusted, Sensor::Failed)
    }

    /// Returns the envelope of the model's recent stiffness.
    #[inline]
    pub(super) fn model_envelope(&self) -> &Envelope {
        &self.envelope
    }

    /// Shifts the mismatch of the earlier readings, as a jump of the model does.
    pub(super) fn shift(&mut self, by: Signal) {
        self.mismatch = self.mismatch.saturating_add(widened(by));
        self.last = self.last.saturating_add(by);
    }

    /// Moves the low-passed mismatch by `deviation` times `rate`.
    #[inline]
    fn low_pass(&mut self, rate: Rate, deviation: Signal) {
        self.mismatch = self.mismatch.saturating_add(rate.step(deviation));
    }

    #[inline]
    fn fail(&mut self, fault: Fault) {
        (self.diagnosis, self.good, self.rejected) = (Diagnosis(Some(fault)), 0, 0);
    }
}

impl Config {
    pub(super) fn new(feedback: &Feedback, sample_time: SampleTime) -> Self {
        let Feedback { noise_v, interval_s, oldest_s, lowest_v, highest_v, .. } = *feedback;
        // Rounded down and up, with a tolerance that keeps whole ticks whole.
        let oldest = (oldest_s / sample_time.seconds() + 1e-6) as u16;
        let missed = (f64::from(MISSED_INTERVALS) * interval_s / sample_time.seconds() + (1.0 - 1e-6)) as u32;
        Self {
            noise: signal(SIGMAS * noise_v),
            lowest: signal(lowest_v),
            highest: signal(highest_v),
            oldest,
            timeout: u32::from(oldest).saturating_add(missed),
            envelope: envelope::Config::new(sample_time.seconds()),
            oscillation: Weight::new((core::f64::consts::TAU * FASTEST_MODE_HZ * interval_s).min(2.0)),
            low_pass: Rate::new(1.0 / LOW_PASS_READINGS),
            forget_jump: Rate::new(lag_fraction(interval_s, FORGET_JUMP_S)),
        }
    }

    /// Returns the largest deviation of an accepted reading while the model is at rest, `6 noise_v`, in V.
    #[inline]
    pub(super) fn noise(&self) -> Signal {
        self.noise
    }

    /// Advances the detection by one tick. Returns the mismatch of `sample` if it is accepted.
    #[inline]
    pub(super) fn evaluate(&self, state: &mut State, sample: Option<Sample>) -> Option<Signal> {
        state.since = state.since.saturating_add(1);
        let is_new = |sample: &Sample| sample.reading.age <= self.oldest && u32::from(sample.reading.age) < state.since;
        let Some(sample) = sample.filter(is_new) else {
            if state.since > self.timeout {
                state.fail(if sample.is_some() { Fault::Stale } else { Fault::Absent });
            }
            return None;
        };
        state.since = u32::from(sample.reading.age);
        let deviation = sample.mismatch.saturating_sub(upper(state.mismatch));
        match (self.fault_of(state, &sample, deviation), state.diagnosis.0) {
            (None, present) => {
                state.rejected = state.rejected.saturating_sub(1);
                state.good = state.good.saturating_add(1);
                state.low_pass(self.low_pass, deviation);
                if state.good >= TRUSTED {
                    state.diagnosis = Diagnosis(None);
                }
                present.is_none().then_some(sample.mismatch)
            }
            (Some(Fault::Stuck), _) => {
                state.fail(Fault::Stuck);
                None
            }
            (Some(fault), None) => {
                state.rejected = state.rejected.saturating_add(GOOD_PER_REJECTED);
                if state.rejected > GOOD_PER_REJECTED * (REJECTED - 1) {
                    state.fail(fault);
                }
                None
            }
            (Some(_), Some(Fault::Jumping)) => {
                state.good = 0;
                state.low_pass(self.forget_jump, deviation);
                None
            }
            (Some(_), Some(_)) => {
                state.good = 0;
                state.mismatch = widened(sample.mismatch);
                None
            }
        }
    }

    /// Returns the largest change of the mismatch from one reading to the next that is not abrupt, in V.
    #[inline]
    fn largest_change(&self, envelope: &Envelope) -> Signal {
        let range = envelope.range();
        self.noise.saturating_add(self.noise >> 1).saturating_add(saturated(self.oscillation.times(range)))
    }

    /// Returns the fault that a new sample shows, if any.
    #[inline]
    fn fault_of(&self, state: &mut State, sample: &Sample, deviation: Signal) -> Option<Fault> {
        let reading = sample.reading.stiffness.0;
        if state.identical == 0 || reading != state.reading {
            (state.identical, state.reading, state.model) = (0, reading, sample.model);
        }
        state.identical = state.identical.saturating_add(1);
        if reading < self.lowest || reading > self.highest {
            return Some(Fault::OutOfRange);
        }
        // A sensor that was stuck has to show noise again, even at rest.
        let moved = distance(sample.model, state.model) > self.noise || state.diagnosis.0 == Some(Fault::Stuck);
        if state.identical >= if moved { IDENTICAL } else { IDENTICAL_AT_REST } {
            return Some(Fault::Stuck);
        }
        // A movement of the model must not make readings acceptable that have jumped before.
        let jumping = state.diagnosis.0 == Some(Fault::Jumping);
        let gate = if jumping { self.noise } else { state.envelope.gate(self.noise) };
        let deviation = deviation.saturating_abs();
        let abrupt = distance(sample.mismatch, state.last).min(deviation) > self.largest_change(&state.envelope);
        state.last = sample.mismatch;
        (abrupt || deviation > gate).then_some(Fault::Jumping)
    }

    /// Advances the model's envelope by one tick.
    #[inline]
    pub(super) fn track_model(&self, state: &mut State, now: Signal) {
        self.envelope.track(&mut state.envelope, now);
    }
}

#[inline]
fn distance(a: Signal, b: Signal) -> Signal {
    // The lowest signal has no positive counterpart.
    a.saturating_sub(b).saturating_abs()
}

#[cfg(test)]
mod tests;
