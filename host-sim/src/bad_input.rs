//! The error that is the caller's to mend: a wrong file, setting or schedule. Exit code 2.

use std::fmt;

/// One line that names what was given and what was expected.
#[derive(Debug)]
pub struct BadInput(pub String);

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BadInput {}

/// Returns early with a [`BadInput`] made of a format string.
#[macro_export]
macro_rules! bad_input {
    ($($message:tt)*) => {
        return Err($crate::bad_input::BadInput(format!($($message)*)).into())
    };
}
