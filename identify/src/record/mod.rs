//! The prepared record: rows of a measured record come in; the commanded voltage as a signal, the readings and what is
//! known about each reading go out.
//!
//! - *Normalised*: in the coordinates of the search, in which every spring has the time constant and the voltages of the paper's.
//! - *Reading*: measured stiffness, normalised to the equivalent static voltage, in V.
//! - *Command*: the voltage that was sent to the amplifier, in V.
//! - *Fold*: the rows that one fit of a cross-validation does not use; its prediction of these rows is held out.
//! - *Clock*: one interval of which the times of all rows are multiples.
//! - *Segment*: neighbouring rows that belong to the same fold.
//! - *Quantisation grid*: equally spaced values to which the readings were rounded.
//! - *Stuck sensor*: one that repeats a reading for a while.
//! - *Censored reading*: one that stopped at a bound of the sensor.

pub mod bounds;
pub(crate) mod changes;
pub mod clock;
pub mod data;
pub(crate) mod decay;
pub(crate) mod feedback;
pub(crate) mod first_order;
pub(crate) mod folds;
pub mod held;
pub mod heteroscedasticity;
pub mod input;
mod missing_codes;
pub mod normalisation;
pub mod observed;
pub mod quantisation_grid;
pub mod scales;
pub mod signal;
pub mod spectrum;
mod stuck;
