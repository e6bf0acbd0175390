//! What a person gets to see: text on the terminal, files in a folder.

pub mod comparison;
pub mod diagnosis;
mod draw;
pub mod figure;
pub mod files;
pub mod plots;
mod step_response;
pub mod terminal;
pub mod tuning;
