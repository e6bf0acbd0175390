//! Fault isolation in the tick: how soon and how rightly the bank of `model::isolation` names faults that begin while it runs.
//!
//! In: seeds. Out: Markdown tables over all faults, sizes and noises, compared with the limit of any detector and with recursive
//! least squares. The springs are those of [`crate::ground_truth`], which share no code with the bank.

mod false_alarms;
mod fault;
mod known;
mod least_squares;
mod page;
mod run;
mod tables;
mod watched;

pub use false_alarms::{Alarms, Watch, predicted_per_block};
pub use fault::{Fault, SIZES};
pub use least_squares::Thresholds;
pub use page::{TITLE, page};
pub use run::{Decision, Outcome, Size, reported, run};
pub use tables::{Row, rows, sizes, summary, table};

/// Standard deviations of the noise in the tables, in percent of 500 V.
pub const NOISES: [f64; 2] = [0.2, 1.0];
