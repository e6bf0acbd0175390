//! A search in, what is reported out.

pub mod alternatives;
pub mod diagnosis;
pub mod export;
pub mod finding;
pub mod margins;
pub mod quality;
pub mod ranking;
pub mod reading_findings;
