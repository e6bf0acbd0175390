//! What the voltage does between the rows of a record.

/// Voltage between two rows of the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Input {
    /// The voltage stays at the value of the earlier row.
    #[default]
    Hold,
    /// The voltage is linear between the rows.
    Linear,
    /// The voltage is the report's stair with its ramps of 0.1 s.
    Stair,
}
