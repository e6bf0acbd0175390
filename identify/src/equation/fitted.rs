//! An equation with fitted numbers.

use crate::equation::structure::Structure;

/// An equation fitted to a record, or to a part of its rows.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Structure with the values of its coordinates.
    pub structure: Structure,
    /// Linear coefficients: zero, weights of the last sum, amplitudes of terms, free responses.
    pub coefficients: Vec<f64>,
    /// Reading minus prediction of every row.
    pub residual: Vec<f64>,
    /// Log-likelihood of the rows that were fitted, under robust noise, in nats.
    pub value: f64,
}

impl Fitted {
    /// Returns the structure with the fitted weights of its last sum.
    pub(super) fn weighted(&self) -> Structure {
        let mut structure = self.structure.clone();
        if structure.is_linear_at_end()
            && let Some(sum) = structure.chain.last_mut()
        {
            let count = sum.point.len();
            sum.point.copy_from_slice(&self.coefficients[1..=count]);
        }
        structure
    }
}
