//! The report's four models of how the stiffness changes over time, and the relations between them.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`input`] | the level over time that is a model's input |
//! | [`zener`] | spring in series with spring and damper (sections 3.2.3 and 8.1.5) |
//! | [`spring_damper`] | spring and damper in parallel, without the series spring (8.1.6) |
//! | [`circuit`], [`analogue`] | the electrical analogue (8.1.7), by nodal analysis |
//! | [`plant`] | the proportional-integral plant (4.2.2) |
//! | [`mapping`] | the Zener model equivalent to the proportional-integral plant, and the limits of that equivalence |
//! | [`report`] | the answer of `vsj dynamics` |

pub mod analogue;
pub mod circuit;
pub mod input;
pub mod mapping;
pub mod plant;
pub mod report;
pub mod spring_damper;
pub mod zener;

/// One step of the classical fourth-order Runge-Kutta method for `dy/dt = slope(t, y)`.
pub(crate) fn runge_kutta(slope: impl Fn(f64, f64) -> f64, t: f64, y: f64, h: f64) -> f64 {
    let first = slope(t, y);
    let second = slope(t + 0.5 * h, y + 0.5 * h * first);
    let third = slope(t + 0.5 * h, y + 0.5 * h * second);
    let fourth = slope(t + h, y + h * third);
    y + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
}
