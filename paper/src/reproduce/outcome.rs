//! The result of a computation, with what the explanation of a disagreement needs.

/// The result of a computation.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The computed number, in the unit of the printed one.
    pub value: f64,
    /// Range that other measured numbers predict, for a printed number that was measured.
    pub expected: Option<(f64, f64)>,
    /// True if the following readings continue from this one, so that none of its digits can be misread.
    pub persists: bool,
    /// Standard error of the number, if it was fitted.
    pub standard_error: Option<f64>,
    /// Further facts for the explanation of a disagreement.
    pub evidence: Option<String>,
}

impl Outcome {
    /// A number computed without uncertainty.
    pub fn exact(value: f64) -> Self {
        Self { value, expected: None, persists: false, standard_error: None, evidence: None }
    }
}
