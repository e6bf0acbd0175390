//! One module per subcommand: it reads arguments, calls a library, and hands the result to [`host_sim::output`].

pub(crate) mod adapt;
pub(crate) mod beam;
pub(crate) mod bound;
mod choice;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod diagnose;
pub(crate) mod dynamics;
pub(crate) mod export;
mod identified;
pub(crate) mod identify;
pub(crate) mod isolate;
pub(crate) mod joint;
pub(crate) mod link;
pub(crate) mod log;
mod loop_arguments;
pub(crate) mod plan;
mod plant;
mod record_arguments;
pub(crate) mod reproduce;
mod spring_error;
pub(crate) mod stair;
pub(crate) mod tune;
pub(crate) mod watch;
