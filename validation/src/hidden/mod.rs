//! Records of a spring that does something the paper's plant does not: what it is, how large, and the readings.
//!
//! Written beside `vsj diagnose`, never from it: other numerics (small time steps instead of exact exponentials), and for
//! most causes several physical forms, because a cause must be named by what it is, not by how one simulator writes it.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`cause`] | the 18 causes: names, blocks, parameters, forms |
//! | [`effect`], [`plain`] | one cause with its values; values that are plain to see |
//! | [`schedule`], [`noise`] | what the amplifier is told; what rides on the readings |
//! | [`spring`], [`physics`], [`memory`] | the spring and its amplifier |
//! | [`moving`] | the same, stepped through time |
//! | [`reading`] | what happens to the readings after the spring |
//! | [`live`] | spring and sensor step by step, for a controller to close a loop around |
//! | [`strangers`] | forms of the causes that the diagnosis was not made with, by a simulator of their own |
//! | [`record`], [`truth`], [`export`] | the finished record, what is true about it, both as files |

pub mod cause;
pub mod effect;
pub mod export;
pub mod live;
pub mod memory;
pub mod moving;
pub mod noise;
pub mod physics;
pub mod plain;
pub mod reading;
pub mod record;
pub mod schedule;
pub mod spring;
pub mod strangers;
pub mod truth;

pub use cause::{Block, Cause};
pub use effect::Effect;
pub use live::Live;
pub use noise::Noise;
pub use record::Hidden;
pub use schedule::Schedule;
