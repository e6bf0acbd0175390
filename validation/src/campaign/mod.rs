//! The identification campaign: diagnoses many records with known effects and counts the causes that are named.
//!
//! In: records of [`ground_truth`]. Out: counts, accuracies and detection limits with their
//! acceptance criteria, as Markdown and as data to serialise.
//!
//! | module | contents |
//! | --- | --- |
//! | [`diagnosis`], [`real`] | the only modules that call `identify` |
//! | [`cramer_rao`] | lower bound of a parameter's error |
//! | [`mixture`], [`detectable`], [`isolable`] | the smallest effect that can be detected, and distinguished from every other cause |
//! | [`score`] | the diagnosis of one record compared with the truth |
//! | [`part`], [`summary`] | the parts of the campaign, and the counts over their records |
//! | [`subject`] | what is diagnosed: a record in any units with its nominal spring |
//! | [`case`] | records that can be drawn, with the names that are true of them |
//! | [`answer`], [`answer_table`] | diagnoses graded by these names; their tables |
//! | [`shared`] | pairs of causes that share a stage or mimic each other |
//! | [`steps`] | plain steps of one to three levels |
//! | [`sensitivity`] | the smallest effect that is named |
//! | [`thresholds`] | diagnoses with each empirical threshold of `identify` at half and twice its value |
//! | [`scales`] | single effects in springs of any size, in any unit |
//! | [`plants`] | single effects in springs of several time constants, other schedules and noise |
//! | [`identified`] | the same records without a plant file |
//! | [`out_of_model`] | records of laws that the diagnosis does not model |
//! | [`unforeseen`] | records of laws that nobody looked at while the diagnosis was made, in two editions |
//! | [`reliability`] | stated probabilities compared with frequencies, over all sets |
//! | [`plan`] | minutes of the next experiment until the diagnosis is right, by schedule |
//! | [`equation`], [`equation_blocks`] | equations of records that nothing explains, compared with other tools |
//! | [`rivals`] | other identification tools on the same records |
//! | [`criteria`], [`tables`] | acceptance criteria; results as Markdown |

pub mod answer;
pub mod answer_table;
pub mod case;
pub mod cramer_rao;
pub mod criteria;
pub mod detectable;
pub mod diagnosis;
pub mod equation;
pub mod equation_blocks;
pub mod identified;
pub mod isolable;
pub mod mixture;
pub mod out_of_model;
pub mod part;
pub mod plan;
pub mod plants;
pub mod real;
pub mod reliability;
pub mod rivals;
pub mod scales;
pub mod score;
pub mod sensitivity;
pub mod shared;
pub mod steps;
pub mod subject;
pub mod summary;
pub mod tables;
pub mod thresholds;
pub mod unforeseen;
