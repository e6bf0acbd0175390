//! Measured feedback: the model's estimate corrected by a stiffness sensor.
//!
//! Important terms:
//!
//! - *reading*, `m`: a value of the stiffness sensor, in V ([`Reading`]).
//! - *mismatch*, `m - y`: the reading minus the model's stiffness when the sensor sampled, in V.
//! - *correction*, `d`: a first-order low-pass of the mismatch, in V. It is the only state that the sensor changes.
//! - *innovation*, `nu`: the mismatch minus the correction, in V.
//! - *gain*, `L`: the fraction of an innovation that one reading adds to the correction ([`Feedback::gain`]).
//! - *trusted*: no fault of the sensor is detected ([`Sensor`]).
//!
//! The estimator stays the pure model of the spring, and everything around it works as it does without a sensor:
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
//! *measured* stiffness is the target, whatever the error of the model. This is internal model control with the filter
//! in the feedback (Garcia and Morari 1982; Morari and Zafiriou, *Robust Process Control*, 1989), and a disturbance
//! observer whose disturbance is referred to the output (Ohnishi 1987). It does not depend on the spring or on the
//! pre-compensator.
//!
//! **Gain.** Let the model's error be a random walk of `q` V per root second, and a reading's noise `r` V. The steady
//! Kalman filter for that, with readings every `h` seconds, has `rho = q^2 h / r^2` and
//! `L = (sqrt(rho^2 + 4 rho) - rho) / 2`: its time constant is about `h / L = r sqrt(h) / q`.
//!
//! **Stability.** The sensor closes one loop only, of gain `F T D`: `F` is the low-pass, `T` the loop that the
//! pre-compensator closes around the model (of magnitude 1 or little more up to its bandwidth, less beyond), and
//! `D = (P - M) / M` the model's relative error. By the small-gain theorem it is stable wherever `|F T D| < 1`:
//!
//! - a static gain of 0 to 2 times the model's is stable at any `L`;
//! - an unknown delay `theta` has `D = exp(-s theta) - 1`; with `T = 1` the characteristic equation is
//!   `tau s + exp(-s theta) = 0`, stable for `tau > 2 theta / pi` and free of oscillation for `tau >= e theta`;
//! - an unknown mode `omega`, `zeta` has `|D|` up to `1 / (2 zeta)`: stable for `tau > 1 / (2 zeta omega)`.
//!
//! [`Feedback::fastest_s`] therefore bounds `tau` from below, whatever noise and uncertainty are; and where that was
//! not enough, the [`oscillation`] is detected and `L` reduced.
//!
//! **Late readings.** A reading is compared with the model's stiffness when the sensor sampled it, for which the state
//! keeps the model's last [`HISTORY`] ticks. A *known* delay therefore is no model error.
//!
//! **Robustness.** The innovation is clipped (Huber's bounded influence), more tightly where the spring may only be
//! late. With the robust pre-compensator, readings that show a spring ahead of its model, two in a row or the mean of the last ones, are
//! used without the delay of `L`, and those of a spring that has answered the beginning of the movement without delay with less of it.
//!
//! **Faults.** The module [`fault_detection`] decides in each tick whether the sensor is trusted. While it is not, `d`
//! decays to 0 V with the time constant [`Feedback::fade_s`], and the loop becomes the one without a sensor. When the
//! sensor is trusted again, `d` continues from its present value. As `d` is the only thing that the sensor changes, and
//! has no jumps, the voltage has none either.
//!
//! Without the feature `feedback` the types of this module have no values, so that the branches which match on them
//! cost nothing.
#![cfg_attr(not(feature = "feedback"), allow(rustdoc::broken_intra_doc_links, reason = "the items are not built"))]

#[cfg(not(feature = "feedback"))]
mod disabled;
#[cfg(feature = "feedback")]
mod enabled;

/// Names of what can be said of a stiffness sensor, in the order of their numbers in frames: 0 stands for no sensor.
pub const SENSOR_NAMES: [&str; 7] = ["none", "trusted", "absent", "stale", "stuck", "jumping", "out-of-range"];

/// What became of a tick's reading.
#[cfg_attr(not(feature = "feedback"), allow(dead_code, reason = "without a sensor there are no readings"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Observed {
    /// The sensor is trusted, and its reading was used.
    Reading,
    /// The sensor is trusted, and its reading was used, more quickly, as the spring follows its model without delay.
    Prompt,
    /// The sensor is trusted, and its last readings have shown a spring ahead of its model: part of that was used without delay.
    Ahead,
    /// The sensor is trusted, and there was none to use.
    Nothing,
    /// The sensor is not trusted.
    Untrusted,
}

#[cfg(not(feature = "feedback"))]
pub use disabled::{Config, Feedback, Reading, Sensor, State};
#[cfg(feature = "feedback")]
pub use enabled::{Config, Fault, Feedback, HISTORY, Reading, Sensor, State, fault_detection, oscillation};
