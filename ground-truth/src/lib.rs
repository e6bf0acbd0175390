//! Ground-truth simulators: records of a spring with known effects in them.
//!
//! In: causes, a noise and a seed. Out: a [`LabelledRecord`], which holds the commanded voltages, the noisy readings
//! and the true values of every effect, or a [`Live`] spring that a controller can be run against. The same seed gives
//! the same record, to the bit.
//!
//! Nothing here shares code with the crate `identify`. The numerical method differs too (small time steps instead of
//! exact exponentials), and most causes have several physical forms, so that a diagnosis is tested on the cause and not
//! on one way of writing it.
//!
//! | module | contents |
//! | --- | --- |
//! | [`cause`] | 19 causes, all but `stuck-sensor`: names, blocks, parameters, forms |
//! | [`effect`], [`full_size`] | one cause with its values; random values of size 1 |
//! | [`schedule`], [`noise`] | the commanded voltages; the noise on the readings |
//! | [`physics`], [`hysteresis`] | the laws of the spring and their forms |
//! | [`spring`], [`integrator`] | spring and amplifier as differential equations; their integration over time |
//! | [`sensor`] | from stiffness to reading |
//! | [`live`] | spring and sensor step by step, for a controller in closed loop |
//! | [`plain_steps`] | records of one to three levels |
//! | [`record`], [`truth`] | the finished record and the true values of its parameters |
//! | [`export`] | the record as CSV, as JSON and as the host tools' record type |
//! | [`out_of_model`] | other laws for the same causes, by a simulator of their own |
//! | [`unforeseen`] | laws of a second such set, which nobody looked at while the diagnosis was made |
//! | [`unseen`] | laws of a third one, its second edition |
//! | [`other_plants`] | records of other instruments, in their own units |

pub mod cause;
pub mod effect;
pub mod export;
pub mod full_size;
pub mod hysteresis;
pub mod integrator;
pub mod live;
pub mod noise;
pub mod other_plants;
pub mod out_of_model;
pub mod physics;
pub mod plain_steps;
pub mod record;
pub mod schedule;
pub mod sensor;
pub mod spring;
pub mod truth;
pub mod unforeseen;
pub mod unseen;

pub use cause::{Block, Cause};
pub use effect::Effect;
pub use live::Live;
pub use noise::Noise;
pub use record::LabelledRecord;
pub use schedule::Schedule;
