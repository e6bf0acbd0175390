//! Measured feedback: the model's estimate corrected by a stiffness sensor.
//!
//! The estimator stays the pure model of the spring, and everything around it stays as it is without a sensor. One state
//! is added, the correction `d`: a first-order low-pass of what a reading `m` says the model `y` gets wrong.
//!
//! ```text
//! target -(-)--> pre-compensator -> amplifier -+-> spring P -> sensor -> m
//!          |            ^                      |                         |
//!          |            +---- estimator M <----+                         |
//!          |                      +--------------- y ------------------>(-)
//!          +------- d = low-pass of (m - y) <----------------------------+
//!
//! nu = (m - y) - d,   d' = d + L nu          at every reading
//! ```
//!
//! The pre-compensator pursues `target - d`, and the estimate is `y + d`. At rest `m = y + d` and `y = target - d`: the
//! *measured* stiffness is the target, whatever the model gets wrong. This is internal model control with the filter in
//! the feedback (Garcia and Morari 1982; Morari and Zafiriou, *Robust Process Control*, 1989), and a disturbance observer
//! whose disturbance is referred to the output (Ohnishi 1987). It knows nothing of spring or pre-compensator, so it
//! serves all of them.
//!
//! **Gain.** Let the model's error be a random walk of `q` V per root second, and a reading's noise `r` V. The steady
//! Kalman filter of that, with readings every `h` seconds, has `rho = q^2 h / r^2` and
//! `L = (sqrt(rho^2 + 4 rho) - rho) / 2`: its time constant is about `h / L = r sqrt(h) / q`.
//!
//! **Stability.** The sensor closes one loop only, of gain `F T D`: `F` the low-pass, `T` the loop that the
//! pre-compensator closes around the model (of magnitude 1 or little more up to its bandwidth, less beyond), and
//! `D = (P - M) / M` the model's relative error. By Nyquist it is stable wherever `|F T D| < 1` (small gain):
//!
//! - a static gain of 0 to 2 times the model's is stable at any `L`;
//! - an unknown delay `theta` has `D = exp(-s theta) - 1`; with `T = 1` what is left is `tau s + exp(-s theta) = 0`,
//!   stable for `tau > 2 theta / pi` and free of oscillation from `tau = e theta` on;
//! - an unknown mode `omega`, `zeta` has `|D|` up to `1 / (2 zeta)`: stable for `tau > 1 / (2 zeta omega)`.
//!
//! So [`Feedback::fastest_s`] bounds `tau` from below, whatever noise and uncertainty say; and where that was not enough,
//! the [swing] is seen and `L` made smaller.
//!
//! **Readings that are late.** A reading is compared with what the model said when the sensor sampled it, for which the
//! state keeps the model's last [`MEMORY`] ticks. A *known* delay therefore is no model error at all.
//!
//! **Robustness.** The innovation `nu` is held inside bounds (Huber's bounded influence), narrower where the spring may just
//! be late: `influence`.
//!
//! **Faults.** The [watch] says in each tick whether the sensor is trusted. While it is not, `d` fades to nothing with
//! [`Feedback::fade_s`], and the loop is the one without a sensor. Trusted again, `d` goes on from where it is. As `d` is
//! the only thing that the sensor changes, and has no jumps, neither has the voltage.

mod envelope;
mod influence;
pub mod swing;
pub mod watch;

use crate::coefficient::{Rate, upper};
use crate::error::OutOfRange;
use crate::units::{Accumulator, SampleTime, ScaledStiffness, Signal, Volts, part_of_way};
pub use watch::{Fault, Sensor};

/// The model's last ticks, with which late readings are compared.
pub const MEMORY: usize = 32;

/// A stiffness sensor and what is known of it, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedback {
    /// Standard deviation of one reading, rounding included, in V, 0.001 to 100; at least half of what it is rounded to.
    pub noise_v: f64,
    /// How fast the model's error wanders, in V per root second, 0.001 to 1000.
    pub model_uncertainty: f64,
    /// Shortest time constant of the correction, in s, 0 to 100: at least `e` times a delay and `1 / (2 zeta omega)` of a
    /// mode that the model lacks.
    pub fastest_s: f64,
    /// Time between two readings in s, one tick to 0.1 s.
    pub interval_s: f64,
    /// Readings sampled longer ago than this are stale, in s: 0 to 31 ticks.
    pub oldest_s: f64,
    /// What the sensor can read, in V within +-1000 V; anything beyond is no reading.
    pub lowest_v: f64,
    /// The upper end of that, above `lowest_v`.
    pub highest_v: f64,
    /// Time constant with which a correction fades when the sensor is no longer trusted, in s, two ticks to 100 s.
    pub fade_s: f64,
}

impl Feedback {
    /// A sensor of 0.2 % noise that is read at 1 kHz, beside a model that is right within some volts in a second.
    pub const TYPICAL: Self = Self {
        noise_v: 1.0,
        model_uncertainty: 1.0,
        fastest_s: 0.1,
        interval_s: 1e-3,
        oldest_s: 0.01,
        lowest_v: -50.0,
        highest_v: 1000.0,
        fade_s: 2.0,
    };

    /// # Errors
    /// [`OutOfRange`] names the field.
    pub(crate) fn check(&self, sample_time: SampleTime) -> Result<(), OutOfRange> {
        let Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s } = *self;
        let seconds = sample_time.seconds();
        OutOfRange::check("noise_v", noise_v, 0.001..=100.0, "V")?;
        OutOfRange::check("model_uncertainty", model_uncertainty, 0.001..=1000.0, "V per root second")?;
        OutOfRange::check("fastest_s", fastest_s, 0.0..=100.0, "s")?;
        OutOfRange::check("interval_s", interval_s, seconds..=0.1, "s")?;
        OutOfRange::check("oldest_s", oldest_s, 0.0..=(MEMORY - 1) as f64 * seconds, "s")?;
        OutOfRange::check("lowest_v", lowest_v, -1000.0..=990.0, "V")?;
        OutOfRange::check("highest_v", highest_v, lowest_v + 1.0..=1000.0, "V")?;
        OutOfRange::check("fade_s", fade_s, 2.0 * seconds..=100.0, "s")
    }

    /// What part of an innovation one reading adds to the correction.
    ///
    /// The Kalman gain, as far as [`fastest_s`](Self::fastest_s) allows it, and below 1/2.
    pub fn gain(&self) -> f64 {
        let ratio = self.model_uncertainty / self.noise_v;
        let rho = ratio * ratio * self.interval_s;
        // Newton's way to the root of L^2 + rho L - rho, from above: a square root takes 0.7 KB of flash.
        let kalman = (0..40).fold(1.0, |gain, _| (gain * gain + rho) / (2.0 * gain + rho));
        let most = if self.fastest_s > 0.0 { part_of_way(self.interval_s, self.fastest_s) } else { 1.0 };
        kalman.min(most).min(0.499)
    }
}

/// What the sensor said last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// What it read.
    pub stiffness: ScaledStiffness,
    /// Whole ticks since it was sampled; 0: after the last tick's voltage had gone out. The same sample may be passed again
    /// as it ages.
    pub age: u16,
}

impl Reading {
    /// Sampled after the last tick's voltage had gone out. None where the crate is built without this module.
    pub fn fresh(stiffness: ScaledStiffness) -> Option<Self> {
        Some(Self { stiffness, age: 0 })
    }
}

/// The correction for one sample time, scaled for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    gain: Rate,
    fade: Rate,
    influence: influence::Config,
    watch: watch::Config,
    swing: swing::Config,
}

/// What the correction remembers; the default is that of a sensor not yet heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    correction: Accumulator,
    /// What the model said, in a ring.
    model: [Signal; MEMORY],
    newest: u8,
    influence: influence::State,
    watch: watch::State,
    swing: swing::State,
}

impl Config {
    /// Of a sensor that [`Feedback::check`] accepts.
    pub(crate) fn new(feedback: &Feedback, sample_time: SampleTime) -> Self {
        let watch = watch::Config::new(feedback, sample_time);
        Self {
            gain: Rate::new(feedback.gain()),
            fade: Rate::new(sample_time.part_of_way(feedback.fade_s)),
            influence: influence::Config::new(feedback.interval_s, watch.noise()),
            watch,
            swing: swing::Config::new(feedback.interval_s, sample_time),
        }
    }

    /// What the sensor said before this tick's voltage: corrects, or fades. What the model has to be led to, for the spring
    /// to come to `target`. One tick passes.
    #[inline]
    pub(crate) fn hear(&self, state: &mut State, target: Volts, reading: Option<Reading>) -> Volts {
        self.swing.asked(&mut state.swing, target.0);
        let correction = upper(state.correction);
        let sample = reading.map(|reading| {
            let model = state.model_at(reading.age);
            watch::Sample { reading, model, mismatch: reading.stiffness.0.saturating_sub(model) }
        });
        let believed = self.watch.judge(&mut state.watch, sample);
        let step = match (state.watch.sensor(), believed) {
            (Sensor::Trusted, Some(mismatch)) => {
                self.swing.hear(&mut state.swing, mismatch, self.watch.noise());
                let (innovation, model) = (mismatch.saturating_sub(correction), state.model_at(0));
                let counts = self.influence.bounded(&mut state.influence, innovation, model, state.watch.moved());
                state.swing.soften(self.gain.step(counts))
            }
            (Sensor::Trusted, None) => Accumulator::ZERO,
            _ => self.fade.step(Signal::ZERO.saturating_sub(correction)),
        };
        state.correction = state.correction.saturating_add(step);
        state.corrected(target)
    }

    /// What the model says with this tick's voltage just put out; the corrected estimate, and whether the sensor is trusted.
    #[inline]
    pub(crate) fn correct(&self, state: &mut State, model: ScaledStiffness) -> (ScaledStiffness, Option<Sensor>) {
        self.watch.moved(&mut state.watch, model.0);
        state.newest = state.newest.wrapping_add(1);
        if let Some(newest) = state.model.get_mut(usize::from(state.newest) % MEMORY) {
            *newest = model.0;
        }
        (ScaledStiffness(model.0.saturating_add(upper(state.correction))), Some(state.watch.sensor()))
    }
}

impl State {
    /// Another configuration takes over; `None`: one without a sensor.
    pub(crate) fn adopted_by(&mut self, config: Option<&Config>) {
        if config.is_some() {
            self.swing = swing::State::default();
        } else {
            *self = Self::default();
        }
    }

    /// What the model has to be led to, for the spring to come to `target`.
    #[inline]
    pub(crate) fn corrected(&self, target: Volts) -> Volts {
        Volts(target.0.saturating_sub(upper(self.correction)))
    }

    /// What the sensor adds to the model, in V.
    pub fn correction(&self) -> ScaledStiffness {
        ScaledStiffness(upper(self.correction))
    }

    /// What the model said `age` ticks before its last word.
    #[inline]
    fn model_at(&self, age: u16) -> Signal {
        // The ring's length divides 256: the index may wrap.
        let index = usize::from(self.newest.wrapping_sub(age as u8)) % MEMORY;
        self.model.get(index).copied().unwrap_or(Signal::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gain_is_the_kalman_filters() {
        // The steady filter by iterating its variance: predict, update.
        for (noise_v, model_uncertainty, interval_s) in [(1.0, 1.0, 1e-3), (0.2, 3.0, 1e-2), (20.0, 0.1, 1e-4)] {
            let feedback = Feedback { noise_v, model_uncertainty, interval_s, fastest_s: 0.0, ..Feedback::TYPICAL };
            let (mut variance, mut gain) = (1.0, 0.0);
            for _ in 0..10_000_000 {
                let predicted: f64 = variance + model_uncertainty * model_uncertainty * interval_s;
                let next = predicted / (predicted + noise_v * noise_v);
                variance = (1.0 - next) * predicted;
                if f64::abs(next - gain) < 1e-15 {
                    break;
                }
                gain = next;
            }
            assert!((feedback.gain() - gain.min(0.499)).abs() < 1e-6, "{} {gain}", feedback.gain());
        }
        // Bounded by what the loop bears.
        let bounded = Feedback { noise_v: 0.01, fastest_s: 0.5, ..Feedback::TYPICAL };
        assert!((bounded.gain() - (1.0 - (-0.002f64).exp())).abs() < 1e-12);
    }

    #[test]
    fn a_wrong_sensor_is_named() {
        let time = SampleTime::from_rate(1000.0).unwrap();
        let good = Feedback::TYPICAL;
        assert_eq!(good.check(time), Ok(()));
        for (field, wrong) in [
            ("noise_v", Feedback { noise_v: 0.0, ..good }),
            ("noise_v", Feedback { noise_v: f64::NAN, ..good }),
            ("model_uncertainty", Feedback { model_uncertainty: -1.0, ..good }),
            ("fastest_s", Feedback { fastest_s: f64::INFINITY, ..good }),
            ("interval_s", Feedback { interval_s: 1e-4, ..good }),
            ("interval_s", Feedback { interval_s: 1.0, ..good }),
            ("oldest_s", Feedback { oldest_s: 0.04, ..good }),
            ("lowest_v", Feedback { lowest_v: -1001.0, ..good }),
            ("highest_v", Feedback { highest_v: -60.0, ..good }),
            ("fade_s", Feedback { fade_s: 0.0, ..good }),
        ] {
            assert_eq!(wrong.check(time).unwrap_err().field, field, "{wrong:?}");
        }
    }
}
