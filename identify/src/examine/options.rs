//! The options of a diagnosis.

use crate::plant::base::Base;
use crate::record::data::Input;

/// How a record is read, and with what it is compared.
#[derive(Clone, Debug)]
pub struct Options {
    /// Course of the voltage between rows.
    pub input: Input,
    /// The simulation that is diagnosed.
    pub base: Base,
}

impl Default for Options {
    /// Voltage held between rows, and the paper's spring.
    fn default() -> Self {
        Self { input: Input::Hold, base: Base::paper() }
    }
}
