//! The next experiment: the schedule that separates the explanations which a record leaves undecided, within the range, slew rate
//! and time that the user allows.
//!
//! In come the rivals and the experiment of a diagnosis ([`hypotheses`](crate::hypotheses)) with a [`Request`], out comes a
//! [`Plan`]: commanded voltages, and the predicted odds of each explanation against each other one.
//!
//! ```text
//! candidate -> commands -> predictions of every rival -> separations -> objective       (search: the best of many candidates)
//! best candidate -> predictions -> separations, rivals fitted again -> probability that it decides
//! ```
//!
//! - *Separation*: expected log-likelihood ratio, in nats, of a true explanation against a rival whose parameters are fitted again
//!   to what the truth predicts: the T-optimality of Hunter and Reiner and of Atkinson and Fedorov (*Biometrika* 62, 1975), averaged
//!   over the posterior of the true parameters. For normal noise it is four times the Bhattacharyya distance of both predictions,
//!   the criterion of auxiliary inputs for active fault diagnosis (Blackmore and Williams, *ACC* 2006).
//! - *Breadth*: information on the catalogue causes that a voltage can show, in nats, each with all others unknown, between the mean and
//!   the least: what the schedule would tell if none of the rivals is true.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `request` | what the user allows, checked |
//! | `candidate` | a schedule as few numbers, and its commands on the grid of the readings |
//! | `library` | the schedules from which the search starts |
//! | `design` | the rivals as models, with draws from their posteriors |
//! | `grid` | the rows in which a candidate is predicted |
//! | `predictor` | predictions and sensitivities of a model on those rows, whitened |
//! | `separation` | distances between predictions, information on causes |
//! | `search` | the search for the best candidate |
//! | `intervals` | 95 % intervals before and after an experiment |
//! | `odds` | the probability that a schedule decides |
//! | `suspects` | suspects of a diagnosis that explains nothing: odds today, and what an experiment shows of them |
//! | `run` | a plan from a diagnosis |
//! | [`answer`] | the data types of a plan |

pub mod answer;
mod candidate;
mod design;
mod grid;
mod intervals;
mod library;
mod odds;
mod predictor;
mod request;
mod run;
mod search;
mod separation;
mod suspects;

pub use answer::Plan;
pub use request::{Basis, Request};
pub use run::plan;
