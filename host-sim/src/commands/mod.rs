//! One module a subcommand.

pub(crate) mod log;
pub(crate) mod stair;
