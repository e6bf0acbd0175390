//! Equations for records that no set of causes explains: a normalised record and structures to start from come in; the equation
//! that predicts held-out segments best goes out, as a hypothesis.

mod candidates;
pub mod clock;
pub mod curve;
pub mod fitted;
mod grammar;
mod intervals;
pub mod kind;
pub mod lag;
mod memory;
pub mod operator;
mod plant;
pub mod problem;
pub mod report;
mod response;
pub mod scale;
pub mod search;
mod smaller;
mod starts;
pub mod structure;
pub mod text;
