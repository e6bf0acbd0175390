//! The leaf spring as a beam, clamped at one end: what was measured, what theory says, and the stack of its layers.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`readings`] | Table 1, or one like it |
//! | [`regression`] | straight lines through readings, with intervals and a test for readings out of line |
//! | [`experiment`] | Table 1: spring constants, Young's modulus against voltage, the range within reach |
//! | [`cantilever`] | deflection under tip load and own weight, linear |
//! | [`elastica`] | the same, geometrically exact |
//! | [`droop`] | where the linear result stops being valid, and the exact one takes over |
//! | [`stack`] | the layers of the spring |
//! | [`limits`] | the stack bonded and sliding, in closed form |
//! | [`layered`], `element` | the stack by finite elements, with slip between its layers |
//! | [`slip`] | how much slip the measured stiffness says there is |
//! | [`report`], `text` | what `vsj beam` says and draws |

pub mod cantilever;
pub mod droop;
pub mod elastica;
mod element;
pub mod experiment;
pub mod layered;
pub mod limits;
pub mod readings;
pub mod regression;
pub mod report;
pub mod slip;
pub mod stack;
