//! Diagnosis of a measured record: what a simulation gets wrong, the cause, and the held-out improvement of the extended model.
//!
//! - *Record*: rows of time in s, commanded voltage in V, and a reading of the stiffness in any unit, e.g. as the equivalent static
//!   voltage in V.
//! - *Cause*: a named physical effect that may be missing in the simulation, e.g. `gain-error` or `hysteresis`.
//! - *Finding*: a cause that the record supports, with its parameters and their 95 % intervals.
//! - *Held-out error*: the error of a prediction by a fit that did not use the predicted segment of the record.
//!
//! ```text
//! record -> Normalisation -> Data -> Observed -> Search (Engine: Simulator, Noise; held-out score) -> Diagnosis -> Report
//! ```
//!
//! The simulation assumes a gain of 1; the gain of this spring is 1.1:
//!
//! ```
//! use identify::{Options, Verdict, diagnose};
//! use simulation::record::{Record, Row};
//!
//! // One row per 0.2 s, steps every 20 s. The stiffness relaxes with 5.5 s after a feedthrough of 1/11; its noise is 0.6 V RMS.
//! let (gain, share, tau_s, sample_s) = (1.1, 1.0 / 11.0, 5.5, 0.2);
//! let (mut lag_v, mut state) = (0.0, 1u32);
//! let mut row = |index: usize| {
//!     let voltage_v = [0.0, 200.0, 400.0, 100.0][index / 100];
//!     state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
//!     let noise_v = 2.0 * (f64::from(state >> 8) / f64::from(1 << 24) - 0.5);
//!     let stiffness_v = gain * (share * voltage_v + (1.0 - share) * lag_v) + noise_v;
//!     lag_v = voltage_v + (lag_v - voltage_v) * f64::exp(-sample_s / tau_s);
//!     Row { line: index + 2, time_s: sample_s * index as f64, voltage_v, measured: Some(stiffness_v) }
//! };
//! let record = Record { name: "stair".into(), rows: (0..400).map(&mut row).collect() };
//!
//! let report = diagnose(&record, &Options::default())?;
//! assert_eq!(report.verdict, Verdict::Explained);
//! assert_eq!(report.findings[0].cause, "gain-error");
//! let (name, found) = &report.findings[0].parameters[0];
//! assert_eq!(name, "gain");
//! assert!(found.low < gain && gain < found.high && found.high - found.low < 0.01);
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! Each folder imports only from those above it in this table:
//!
//! | folder | what comes in | what goes out |
//! | --- | --- | --- |
//! | [`stats`] | numbers | medians, sums, scales, a periodogram; the thresholds of all decisions |
//! | [`dimension`] | | dimensions of reported numbers, and their units |
//! | [`hypotheses`] | | the data types of what a diagnosis leaves to decide |
//! | [`answer`] | | the data types of a report |
//! | [`record`] | a record's rows | the command as a signal, the readings, the grid that they lie on |
//! | [`linear`] | a record | the best linear models of order 0 to 4 |
//! | [`nominal`] | records | the smallest linear model that no larger one beats, as a plant file |
//! | [`plant`] | a plant file | the chain from command to stiffness that effects change |
//! | [`noise`] | residuals | the likelihood of readings |
//! | [`effects`] | | what may be wrong, one file an effect, and sets of effects as models |
//! | [`fit`] | a model, a record | the likeliest parameters, their intervals, held-out predictions |
//! | [`equation`] | a record, models to beat | the equation that predicts best where no cause fits |
//! | [`adequacy`] | a fit | what is left that no effect explains, and where |
//! | [`search`] | a record | which effects |
//! | [`verdict`] | a search | what is reported |
//! | [`examine`](mod@examine) | a record, options | the diagnosis: all passes in order |
//! | [`plan`](mod@plan) | what a diagnosis leaves to decide | the schedule of the experiment that decides it |
// They panic on a closed pipe; `vsj` prints in its `output::terminal`.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod adequacy;
pub mod answer;
pub mod dimension;
pub mod effects;
pub mod equation;
pub mod examine;
pub mod fit;
pub mod hypotheses;
pub mod linear;
pub mod noise;
pub mod nominal;
pub mod plan;

pub mod plant;
pub mod record;
pub mod search;
pub mod stats;
pub mod verdict;

pub use answer::{Margins, Report, Verdict};
pub use examine::{Options, diagnose, examine, examine_several};
pub use fit::budget::Effort;
pub use fit::stop::Stop;
pub use nominal::{Identified, identify, identify_with_order};
pub use record::input::Input;
pub use verdict::diagnosis::Diagnosis;
