//! The MCU's controller in closed loop with a spring that hides an effect, with a stiffness sensor and without.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`stair`] | the targets, and how long each step takes |
//! | [`run`] | the loop, tick by tick |
//! | [`effects`] | every hidden effect, with a sensor and without |
//! | [`failing`] | a sensor that fails and comes back |
//! | [`tables`] | what came of it as Markdown |

pub mod effects;
pub mod failing;
pub mod run;
pub mod stair;
pub mod tables;
