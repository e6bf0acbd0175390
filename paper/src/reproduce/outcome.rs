//! The result of a computation, with what the explanation of a disagreement needs.

/// What comes out.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The number.
    pub value: f64,
    /// For a measured number: where other measured numbers say that it lies.
    pub expected: Option<(f64, f64)>,
    /// True if the readings after it go on from it: then no digit of it is misread.
    pub lasts: bool,
    /// For a fitted number: its standard error.
    pub standard_error: Option<f64>,
    /// What else the computation knows, for the explanation.
    pub evidence: Option<String>,
}

impl Outcome {
    /// A number that follows from others.
    pub fn exact(value: f64) -> Self {
        Self { value, expected: None, lasts: false, standard_error: None, evidence: None }
    }
}
