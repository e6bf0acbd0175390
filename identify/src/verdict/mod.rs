//! What is reported of a record: a search in, the report and what is needed to draw it out.
//!
//! | term | meaning |
//! | --- | --- |
//! | finding | a named cause with its parameters, its probability and the evidence for it |
//! | rival, alternative | another set of causes that the record cannot reject |
//! | odds | difference of two scores, in nats |
//! | credibility | how much of what a finding removes an unknown law would not |
//! | linear rival, extrapolation | what the extended simulation has to predict as well as: the best linear model, the model without a cause |
//! | margins | smallest errors of gain and time constant that a record without findings would have shown |
//! | export | the extended simulation as a plant file |
//! | suspect | a cause that comes close to a finding but is none |
//! | unconfirmed | changes the last readings alone, and no reading after it shows whether an error of the simulation does |
//! | ranking | the best sets of causes compared by score and held-out error |
//! | hypotheses | the best sets with their fits, and the experiment: what the next experiment is computed from |
//! | further rows | the errors of the extended simulation beyond the rows that were diagnosed |
//! | restored | converted from the coordinates of the search to the file's units |
//!
//! [`diagnosis`] puts the parts together.

pub mod alternatives;
mod cause;
pub(crate) mod credibility;
pub mod diagnosis;
pub(crate) mod doubt;
pub mod export;
mod extrapolation;
mod fewer_lags;
pub mod finding;
mod form_average;
pub(crate) mod found;
mod further_rows;
pub(crate) mod held_findings;
pub(crate) mod hypotheses;
pub(crate) mod linear_rival;
pub mod margins;
pub mod quality;
pub mod ranking;
pub mod reading_findings;
mod restore;
pub(crate) mod suspects;
mod unconfirmed;
