//! The origin of a diagnosis.

use identify::Input;

/// The data and command line of a diagnosis, for the page's footer.
#[derive(Clone, Debug)]
pub struct Origin {
    /// Name of the record.
    pub record: String,
    /// Name of its measured column.
    pub column: String,
    /// Interpolation of the voltage between its rows.
    pub input: Input,
    /// The command line that was run.
    pub command: String,
}
