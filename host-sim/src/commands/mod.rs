//! One module a subcommand.

pub(crate) mod link;
pub(crate) mod log;
pub(crate) mod stair;
