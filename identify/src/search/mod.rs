//! Which effects a record needs: blocks are added while held-out data supports them, and removed when it does not.
//!
//! In comes a record (an [`Engine`](crate::fit::engine::Engine) behind the trait [`Evaluator`]), out come structures with their
//! fits and scores ([`Scored`]), the best first.
//!
//! | term | meaning |
//! | --- | --- |
//! | block, structure | one effect in one form; a set of blocks, whatever their parameters |
//! | score | held-out log-likelihood less the price of each block, in nats |
//! | price | what a block that is found by chance among all that are tried would gain, in nats |
//! | penalty factor | multiplies the prices where noise is autocorrelated beyond what its model describes, 1 or more |
//! | predicted gain | gain in log-likelihood of a block that is not fitted yet, in nats, from a linearisation |
//! | beam | structures that are extended in parallel: a wrong first block may stand in for two right ones |
//! | warm start | best structures of one search, from which another starts |
//!
//! From each structure of the beam every effect is tried in every form; then blocks are removed and exchanged until the score no
//! longer grows.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `scored` | a structure with its fit and score |
//! | `warm_start` | what one search passes to another |
//! | `predicted_gain` | the predicted gain of a block |
//! | `penalty_factor` | the penalty factor of a residual |
//! | `initial_models` | models from which the search also starts, if the nominal spring is far from the record, and models with a delay |
//! | `evaluator` | what a search asks about structures, and its answer from a record |
//! | `first_fits` | first fits of a structure's extensions |
//! | `evaluated` | all structures evaluated so far, and the prices |
//! | `structure_search` | the search |
//! | `as_independent` | a further search as if the noise were independent, where the first leaves structure |
//! | `joint_gain` | pairs and triples of blocks that explain a residual together |
//! | `extend` | a structure's extensions: which are fitted, and which of those are evaluated |
//! | `predicting` | the structure that a search ends with, by held-out error where the likeliest does not predict |
//! | `explored` | what a search has evaluated, for questions of the report |

mod as_independent;
mod evaluated;
mod evaluator;
mod explored;
mod extend;
mod first_fits;
mod initial_models;
mod joint_gain;
mod penalty_factor;
mod predicted_gain;
mod predicting;
mod scored;
mod structure_search;
#[cfg(test)]
mod tests;
mod warm_start;

pub use evaluator::Evaluator;
pub use explored::Explored;
pub use scored::{Scored, effects};
pub use structure_search::Search;
pub use warm_start::WarmStart;
