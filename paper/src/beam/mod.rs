//! The leaf spring as a cantilever: the measurements, beam theory, and the stack of layers it is made of.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`readings`] | readings of Table 1, or of a file like it |
//! | [`regression`] | linear regression with 95 % intervals and an outlier test |
//! | [`experiment`] | Table 1 evaluated: spring constants, Young's modulus over the voltage, stiffness range |
//! | [`cantilever`] | deflection under tip force and own weight, linear theory |
//! | [`elastica`] | the same deflection, geometrically exact |
//! | [`droop`] | the load at which the linear theory stops being valid |
//! | [`stack`] | the layers of the spring |
//! | [`limits`] | the stack with bonded and with sliding layers, in closed form |
//! | [`layered`], `element` | the stack with slip between its layers, by finite elements |
//! | [`slip`] | the interlayer stiffness identified from the measured spring constants |
//! | [`report`] | the answer of `vsj beam` |

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
