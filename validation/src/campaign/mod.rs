//! Hides effects in many records, has each diagnosed, and counts what was named.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`seam`] | the one place that calls the diagnosis |
//! | [`part`] | which records a part of the campaign is made of |
//! | [`score`], [`summary`] | what became of one record, and of many |
//! | [`bound`] | how near a parameter can come at best |
//! | [`detectable`], [`apart`], [`mixture`], [`ladder`] | the smallest effect that can be seen, told from others, and that is named |
//! | [`aim`] | what is asked for, and whether it came out |
//! | [`tables`] | all of it as Markdown |
//! | [`rivals`] | what other tools make of the same records |
//! | [`strangers`] | records of laws that the diagnosis was not made with |

pub mod aim;
pub mod apart;
pub mod bound;
pub mod detectable;
pub mod ladder;
pub mod mixture;
pub mod part;
pub mod rivals;
pub mod score;
pub mod seam;
pub mod strangers;
pub mod summary;
pub mod tables;
