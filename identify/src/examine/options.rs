//! The options of a diagnosis.

use crate::fit::budget::Effort;
use crate::fit::stop::Stop;
use crate::plant::base::Base;
use crate::record::data::Input;

/// How a record is read, and with what it is compared.
#[derive(Clone, Debug)]
pub struct Options {
    /// Course of the voltage between rows.
    pub input: Input,
    /// The simulation that is diagnosed.
    pub base: Base,
    /// How long causes are searched for.
    pub effort: Effort,
    /// Ends the search early with the best answer so far.
    pub stop: Stop,
}

impl Default for Options {
    /// Voltage held between rows, the paper's spring, and the normal effort.
    fn default() -> Self {
        Self { input: Input::Hold, base: Base::paper(), effort: Effort::Normal, stop: Stop::default() }
    }
}
