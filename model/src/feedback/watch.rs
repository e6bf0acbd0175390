//! Whether a stiffness sensor is to be trusted.
//!
//! Judged by what it says beside what the model says, reading by reading, in constant time. `gate` below is
//! `6 noise_v + 2 moved`. `moved` is the range that the model has covered of late: from its lower to its upper envelope,
//! which come back to the model within about half a second. So a model that is wrong by up to twice its own movement (a
//! share of 0.25 where it says 0.09, under overdrive) is no jump.
//!
//! | fault | what is seen | found within |
//! | --- | --- | --- |
//! | [`Absent`](Fault::Absent) | no new reading | `oldest_s` and [`SILENT`] intervals |
//! | [`Stale`](Fault::Stale) | no new reading, and what comes is older than `oldest_s` | the same |
//! | [`Stuck`](Fault::Stuck) | [`IDENTICAL_AT_REST`] readings equal to the bit, or [`IDENTICAL`] while the model moved by more than `6 noise_v` | as many intervals, and that movement |
//! | [`Jumping`](Fault::Jumping) | [`REJECTED`] readings in a row whose mismatch `m - y` is a gate away from that of the last believed ones, or abruptly away both from that and from the reading before | [`REJECTED`] intervals |
//! | [`OutOfRange`](Fault::OutOfRange) | [`REJECTED`] readings in a row outside of what the sensor can read | [`REJECTED`] intervals |
//!
//! Readings in noise of `noise_v` repeat by rounding only. To twice the noise, and from the middle of a step, one in a row of
//! 100 does so with 0.78^99, once in 10^10; a sensor that rounds more coarsely than that is taken for stuck, and so it is
//! better than believed. *Abruptly* is by more than `9 noise_v` and what a mode of [`FASTEST_MODE_HZ`] makes of the movement
//! in an interval: a spring that comes late may jump once, but not to and fro.
//!
//! A single rejected reading is an outlier: it is not believed, and forgotten after [`AMENDS`] good ones; so more than one
//! in five are a fault too, in the end. A sensor is trusted again, and at first, after [`TRUSTED`] good readings in a row.
//! After a jump they have to come back to where they were before it; that is forgotten with [`FORGIVE_S`], for the
//! spring itself may have changed.
//!
//! What cannot be seen: a sensor that shifts its readings slowly, or by less than the gate, which is wide while the model
//! moves. A model that is wrong, or a spring that comes late, looks the same.

use super::envelope::{self, Envelope};
use super::{Feedback, Reading};
use crate::coefficient::{Rate, Weight, saturated, upper};
use crate::units::{Accumulator, SampleTime, Signal, part_of_way, signal};

/// Intervals without a new reading that are borne, beside `oldest_s`.
pub const SILENT: u32 = 4;
/// Equal readings in a row that are a fault, if the model moves.
pub const IDENTICAL: u16 = 8;
/// Equal readings in a row that are a fault even at rest.
pub const IDENTICAL_AT_REST: u16 = 100;
/// Rejected readings in a row that are a fault.
pub const REJECTED: u16 = 4;
/// Good readings that make a rejected one forgotten.
pub const AMENDS: u16 = 4;
/// Good readings in a row after which the sensor is trusted.
pub const TRUSTED: u16 = 50;
/// Standard deviations that a reading may be off.
const SIGMAS: f64 = 6.0;
/// Of an oscillation that the model may lack, in Hz.
pub const FASTEST_MODE_HZ: f64 = 5.0;
/// Believed readings that a mismatch is compared with, about.
const RECENT: f64 = 4.0;
/// Time constant with which a jump becomes the new state of things, in s.
pub const FORGIVE_S: f64 = 30.0;

/// What the loop thinks of its sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Its readings correct the estimate.
    Trusted,
    /// The loop runs on the model alone.
    Failed(Fault),
}

impl Sensor {
    /// For logs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Trusted => "trusted",
            Self::Failed(Fault::Absent) => "absent",
            Self::Failed(Fault::Stale) => "stale",
            Self::Failed(Fault::Stuck) => "stuck",
            Self::Failed(Fault::Jumping) => "jumping",
            Self::Failed(Fault::OutOfRange) => "out-of-range",
        }
    }
}

/// Why a sensor is not trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    /// Nothing new is heard, or not yet enough.
    #[default]
    Absent,
    /// What is heard is too old.
    Stale,
    /// Its readings don't change while the stiffness does.
    Stuck,
    /// Its readings change where the stiffness doesn't.
    Jumping,
    /// Its readings are none that it can give.
    OutOfRange,
}

/// A reading beside the model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub reading: Reading,
    /// What the model said when the sensor sampled.
    pub model: Signal,
    /// Reading less model.
    pub mismatch: Signal,
}

/// Bounds for one sample time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Config {
    noise: Signal,
    lowest: Signal,
    highest: Signal,
    oldest: u16,
    /// Ticks without a new reading that are borne.
    silence: u32,
    envelope: envelope::Config,
    /// What part of its range an oscillation makes in an interval, at the most.
    swings: Weight,
    recent: Rate,
    forgive: Rate,
}

/// What the watch remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    doubt: Doubt,
    /// Ticks since the last reading was sampled.
    since: u32,
    /// Low-pass of the believed readings' mismatch.
    mismatch: Accumulator,
    rejected: u16,
    good: u16,
    /// Of the last reading.
    last: Signal,
    /// The last reading, how often in a row it came, and what the model said at first.
    same: u16,
    reading: Signal,
    model: Signal,
    /// Of the model.
    envelope: Envelope,
}

/// A fault, or none; a sensor that was never heard is absent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Doubt(Option<Fault>);

impl Default for Doubt {
    fn default() -> Self {
        Self(Some(Fault::Absent))
    }
}

impl State {
    #[inline]
    pub(super) fn sensor(&self) -> Sensor {
        self.doubt.0.map_or(Sensor::Trusted, Sensor::Failed)
    }

    /// What the model has covered of late.
    #[inline]
    pub(super) fn moved(&self) -> &Envelope {
        &self.envelope
    }

    #[inline]
    fn follow(&mut self, rate: Rate, away: Signal) {
        self.mismatch = self.mismatch.saturating_add(rate.step(away));
    }

    #[inline]
    fn fail(&mut self, fault: Fault) {
        (self.doubt, self.good, self.rejected) = (Doubt(Some(fault)), 0, 0);
    }
}

impl Config {
    pub(super) fn new(feedback: &Feedback, sample_time: SampleTime) -> Self {
        let Feedback { noise_v, interval_s, oldest_s, lowest_v, highest_v, .. } = *feedback;
        // Rounded down and up; a hair's breadth keeps whole ticks whole.
        let oldest = (oldest_s / sample_time.seconds() + 1e-6) as u16;
        let silent = (f64::from(SILENT) * interval_s / sample_time.seconds() + (1.0 - 1e-6)) as u32;
        Self {
            noise: signal(SIGMAS * noise_v),
            lowest: signal(lowest_v),
            highest: signal(highest_v),
            oldest,
            silence: u32::from(oldest).saturating_add(silent),
            envelope: envelope::Config::new(sample_time.seconds()),
            swings: Weight::new((core::f64::consts::TAU * FASTEST_MODE_HZ * interval_s).min(2.0)),
            recent: Rate::new(1.0 / RECENT),
            forgive: Rate::new(part_of_way(interval_s, FORGIVE_S)),
        }
    }

    /// Of a model at rest.
    #[inline]
    pub(super) fn noise(&self) -> Signal {
        self.noise
    }

    /// One tick passes; the mismatch of a sample that is new and believed.
    #[inline]
    pub(super) fn judge(&self, state: &mut State, sample: Option<Sample>) -> Option<Signal> {
        state.since = state.since.saturating_add(1);
        let is_new = |sample: &Sample| sample.reading.age <= self.oldest && u32::from(sample.reading.age) < state.since;
        let Some(sample) = sample.filter(is_new) else {
            if state.since > self.silence {
                state.fail(if sample.is_some() { Fault::Stale } else { Fault::Absent });
            }
            return None;
        };
        state.since = u32::from(sample.reading.age);
        let away = sample.mismatch.saturating_sub(upper(state.mismatch));
        match (self.wrong(state, &sample, away), state.doubt.0) {
            (None, doubt) => {
                state.rejected = state.rejected.saturating_sub(1);
                state.good = state.good.saturating_add(1);
                state.follow(self.recent, away);
                if state.good >= TRUSTED {
                    state.doubt = Doubt(None);
                }
                doubt.is_none().then_some(sample.mismatch)
            }
            (Some(Fault::Stuck), _) => {
                state.fail(Fault::Stuck);
                None
            }
            (Some(fault), None) => {
                state.rejected = state.rejected.saturating_add(AMENDS);
                if state.rejected > AMENDS * (REJECTED - 1) {
                    state.fail(fault);
                }
                None
            }
            (Some(_), Some(Fault::Jumping)) => {
                state.good = 0;
                state.follow(self.forgive, away);
                None
            }
            (Some(_), Some(_)) => {
                state.good = 0;
                state.mismatch = Accumulator::from_bits(i64::from(sample.mismatch.to_bits()) << 32);
                None
            }
        }
    }

    /// By how much the mismatch may change from one reading to the next.
    #[inline]
    fn abrupt(&self, envelope: &Envelope) -> Signal {
        let range = envelope.range();
        self.noise.saturating_add(self.noise >> 1).saturating_add(saturated(self.swings.of(range)))
    }

    /// What speaks against a new sample.
    #[inline]
    fn wrong(&self, state: &mut State, sample: &Sample, away: Signal) -> Option<Fault> {
        let reading = sample.reading.stiffness.0;
        if state.same == 0 || reading != state.reading {
            (state.same, state.reading, state.model) = (0, reading, sample.model);
        }
        state.same = state.same.saturating_add(1);
        if reading < self.lowest || reading > self.highest {
            return Some(Fault::OutOfRange);
        }
        // What has been stuck has to vary as noise does.
        let moved = distance(sample.model, state.model) > self.noise || state.doubt.0 == Some(Fault::Stuck);
        if state.same >= if moved { IDENTICAL } else { IDENTICAL_AT_REST } {
            return Some(Fault::Stuck);
        }
        // A movement must not let a reading back in that has jumped.
        let gate = if state.doubt.0 == Some(Fault::Jumping) { self.noise } else { state.envelope.gate(self.noise) };
        let away = away.saturating_abs();
        let jumped = distance(sample.mismatch, state.last).min(away) > self.abrupt(&state.envelope);
        state.last = sample.mismatch;
        (jumped || away > gate).then_some(Fault::Jumping)
    }

    /// The model is at `now` in this tick.
    #[inline]
    pub(super) fn moved(&self, state: &mut State, now: Signal) {
        self.envelope.follow(&mut state.envelope, now);
    }
}

#[inline]
fn distance(a: Signal, b: Signal) -> Signal {
    // The least signal has no positive counterpart.
    a.saturating_sub(b).saturating_abs()
}
