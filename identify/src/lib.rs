//! What a simulation gets wrong on a measured record, why, and the held-out improvement of the extended model.
//!
//! ```text
//! record -> Data -> Observed -> Search (Engine: Simulator, Noise; held-out score) -> Diagnosis -> Report
//! ```
//!
//! Each folder imports only from those above it in this table:
//!
//! | folder | what comes in | what goes out |
//! | --- | --- | --- |
//! | [`stats`] | numbers | medians, sums, scales, a periodogram |
//! | [`answer`] | | the data types of a report |
//! | [`record`] | a record's rows | the command as a signal, the readings, the grid that they lie on |
//! | [`plant`] | a plant file | the chain from command to stiffness that effects change |
//! | [`noise`] | residuals | the likelihood of readings |
//! | [`effects`] | | what may be wrong, one file an effect, and sets of effects as models |
//! | [`fit`] | a model, a record | the likeliest parameters, their intervals, held-out predictions |
//! | [`adequacy`] | a fit | what is left that no effect explains, and where |
//! | [`search`] | a record | which effects |
//! | [`verdict`] | a search | what is reported |
//! | [`examine`](mod@examine) | a record, options | the diagnosis: all passes in order |

pub mod adequacy;
pub mod answer;
pub mod effects;
pub mod examine;
pub mod fit;
pub mod noise;
pub mod plant;
pub mod record;
pub mod search;
pub mod stats;
pub mod verdict;

pub use answer::{Margins, Report, Verdict};
pub use examine::{Options, diagnose, examine};
pub use record::data::Input;
pub use verdict::diagnosis::Diagnosis;
