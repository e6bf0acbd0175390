//! The record made ready: rows in, the command as a signal and the readings out.

pub mod data;
pub mod growth;
pub mod observed;
pub mod quantisation_grid;
pub mod signal;
pub mod spectrum;
