//! The robust pre-compensator: as fast as every spring allows that a spring known to within errors may be.
//!
//! Important terms:
//!
//! - *quick spring*, `q`: the spring that rises fastest of all that are possible: the time constants are shorter, share and gain
//!   larger than the model's by their errors ([`Margin`]).
//! - *lead*: how much farther than the model the quick spring is, in V.
//! - *seen*: the part of the lead that the sensor's readings have had time to show, in V.
//! - *base*: stiffness of the quick spring when the target changed, or the sensor was trusted again; an error of the gain counts from
//!   there.
//!
//! The time-optimal law on the model alone overshoots on every spring that is quicker. Here it runs on the quick spring, so that none
//! does, with a target that is moved by
//!
//! ```text
//! lead   = (q - y) + g (q - base)                 y: stiffness of the model, g: error of the gain
//! seen'  = seen + L (lead - seen)                 at every reading, with the gain L of the sensor's correction,
//!                                                 or 3/4 instead of L if that is what the correction has taken
//! excess = part (lead - seen), at most overshoot |step|
//! fall   = depth step while the springs fall back, else 0
//! q + g (q - base)  ->  target - d + seen + excess - fall
//! ```
//!
//! - **Without a sensor** the slow springs lag behind the quick one, which is held above the target by up to the overshoot that is
//!   allowed, until they are there: with `part = 2 overshoot / (overshoot + 3 %)` the band of -3 % to the overshoot is used on both
//!   sides. An error of the gain cannot be removed; it uses up the overshoot that is allowed.
//!   Where it is allowed ([`Margin::fall_back`]), all springs fall back by a part of the step, `depth`, once the quick one has been at its
//!   target, as long as the lead that this step has brought is between two thresholds, and no longer than four times the planned time: the
//!   slow springs are in the band earlier, and the model's spring leaves it for a while. From then on `part` is that of the design.
//! - **With a sensor** the correction `d` brings the model to the readings, as without this law. What has been seen needs no margin any
//!   more: the margin lasts as long as the sensor takes to show an error, and not as long as the spring takes to settle. The voltage
//!   rises by at most 20 V in a millisecond (falls, in a step downward), so that a spring whose share is larger than the margin shows that
//!   in the readings before it is above its target; the correction uses what shows a spring ahead of the model without delay. While the
//!   sensor is not trusted, `seen` decays as the correction does, and `g` is 0 in the equations above.
//!
//! Reference: the least time of any controller without a sensor, by a linear programme (`vsj bound`). Without the feature `robust` the
//! types of this module have no values.

#[cfg(not(feature = "robust"))]
mod disabled;
#[cfg(feature = "robust")]
mod enabled;
#[cfg(feature = "robust")]
mod fall_back;
#[cfg(feature = "robust")]
mod margin;

#[cfg(not(feature = "robust"))]
pub(crate) use disabled::Robust;
#[cfg(not(feature = "robust"))]
pub use disabled::{Margin, State};
#[cfg(feature = "robust")]
pub(crate) use enabled::Robust;
#[cfg(feature = "robust")]
pub use enabled::State;
#[cfg(feature = "robust")]
pub use fall_back::FallBack;
#[cfg(all(test, feature = "feedback", feature = "robust"))]
pub(crate) use fall_back::Phase;
#[cfg(feature = "robust")]
pub use margin::Margin;

use crate::units::{Signal, Volts};

/// What a tick asks the law for.
#[cfg_attr(not(feature = "robust"), allow(dead_code, reason = "only the robust pre-compensator needs it"))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aim {
    /// The desired stiffness, before and after the correction by the sensor.
    pub(crate) target: Volts,
    pub(crate) pursued: Volts,
    /// Stiffness of the model under the last voltage.
    pub(crate) model: Signal,
    /// The last voltage after the amplifier's limits, and the same rounded to a code.
    pub(crate) driven: Volts,
    pub(crate) applied: Volts,
}
