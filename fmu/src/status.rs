//! The status of a call, and the category of the message that explains it.

use std::ffi::c_int;

/// A status of a call, with the numbers of both standards.
pub(crate) type Status = c_int;
pub(crate) const OK: Status = 0;
pub(crate) const WARNING: Status = 1;
pub(crate) const DISCARD: Status = 2;
pub(crate) const ERROR: Status = 3;
pub(crate) const FATAL: Status = 4;

/// Category of the messages about errors, which both standards name so.
pub(crate) const ERRORS: &str = "logStatusError";
/// Category of the remarks, which both standards name so.
pub(crate) const WARNINGS: &str = "logStatusWarning";

/// The category of a message with this status.
pub(crate) const fn category(status: Status) -> &'static str {
    if status == WARNING { WARNINGS } else { ERRORS }
}
