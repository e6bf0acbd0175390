//! The time-optimal pre-compensator: the end of the amplifier's range until the target can be held, then exactly the
//! voltage that holds it.
//!
//! Important terms:
//!
//! - *prediction*: the stiffness now, and at the end of the tick if the last voltage stayed
//!   ([`crate::estimator::Prediction`]).
//! - *inverse*: the voltage that gives a wanted change of the stiffness by the end of the tick
//!   ([`crate::estimator::Estimator::voltage_for`]).
//! - *approach*: the time constant `tau` of the last part of the way, in s; 0 is dead-beat ([`Approach`]).
//! - *dead-beat*: the target is reached at the end of the tick if the amplifier's range allows it.
//! - *braking*: limiting the wanted change so that an amplifier of limited slew can bring its voltage back in time.
//!
//! A spring whose step response never falls is fastest at the end of the amplifier's range. The voltage may leave that
//! end as soon as another voltage inside the range holds the target from there on, and no earlier. So in every tick the
//! law asks for the voltage that leads to the target by the end of the tick, and the amplifier's limits do the rest:
//!
//! ```text
//! now     stiffness just before the new voltage
//! end     stiffness at the end of the tick if the last voltage stayed
//! wanted  = now + a (target - now),   a = 1 - exp(-T / tau)      (tau = 0: a = 1)
//! u       : the stiffness at the end of the tick is `wanted`, which is wanted - end more than with the last voltage
//! ```
//!
//! - **No overshoot, no windup.** The estimator runs on the voltage that was really applied, so `now` and `end` include
//!   every limit and the DAC's rounding; there is no integrator.
//! - **Smooth.** `u` is a continuous function of state and target. At the target it falls back with the time constant
//!   `share * tau_spring` of the spring's inverse, 0.5 s for the source report's spring.
//! - **Bumpless transfer.** After a change of settings an offset moves the target to where the last voltage leads; the
//!   offset decays with a time constant of 0.1 s.
//! - **Slew.** If the slew is limited, the law brakes early enough.
//!
//! The law is the same for every [`Estimator`](crate::estimator::Estimator). Without the feature `time-optimal` the
//! types of this module have no values, so that the branches which match on them cost nothing.

#[cfg(not(feature = "time-optimal"))]
mod disabled;
#[cfg(feature = "time-optimal")]
mod enabled;

#[cfg(not(feature = "time-optimal"))]
pub use disabled::{Approach, State, TimeOptimal};
#[cfg(feature = "time-optimal")]
pub use enabled::{Approach, State, TimeOptimal};
