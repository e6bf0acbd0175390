//! Weighted least squares around one point: the Jacobian, the normal equations and their damped solution.
//!
//! ```text
//! (J' W J) delta = J' W r      gain(delta) = delta' J' W r - delta' (J' W J) delta / 2     [nats]
//! ```

use nalgebra::{DMatrix, DVector};

use crate::noise::Term;
use crate::stats::sums::dot;

/// Derivatives of the prediction by the fitted coordinates, whitened as the residual is.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// Index of each column's coordinate among all coordinates.
    pub places: Vec<usize>,
    /// Columns, in V per unit of the coordinate.
    pub columns: Vec<Vec<f64>>,
}

/// Returns the matrix `J' W J` and the vector `J' W r`.
pub fn normal_equations(jacobian: &Jacobian, terms: &[Term]) -> (DMatrix<f64>, DVector<f64>) {
    let size = jacobian.columns.len();
    let mut normal = DMatrix::zeros(size, size);
    let mut gradient = DVector::zeros(size);
    let mut weighted = vec![0.0; terms.len()];
    let residual: Vec<f64> = terms.iter().map(|term| term.residual).collect();
    for (i, column) in jacobian.columns.iter().enumerate() {
        for ((weighted, value), term) in weighted.iter_mut().zip(column).zip(terms) {
            *weighted = value * term.weight;
        }
        gradient[i] = dot(&weighted, &residual);
        for (j, other) in jacobian.columns.iter().enumerate().skip(i) {
            let product = dot(&weighted, other);
            normal[(i, j)] = product;
            normal[(j, i)] = product;
        }
    }
    (normal, gradient)
}

/// Returns the increase of the log-likelihood, in nats, that the quadratic approximation predicts between two points.
pub(crate) fn predicted_gain(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    places: &[usize],
    from: &[f64],
    to: &[f64],
) -> f64 {
    let step = DVector::from_iterator(places.len(), places.iter().map(|&place| to[place] - from[place]));
    gradient.dot(&step) - 0.5 * (normal * &step).dot(&step)
}

/// Returns the solution of the normal equations, scaled to unit diagonal, with `damping` added to the diagonal; `None`
/// if the matrix is not positive definite.
pub fn damped_step(normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let size = normal.nrows();
    let scale = DVector::from_fn(size, |i, _| 1.0 / normal[(i, i)].max(1e-30).sqrt());
    let mut scaled = DMatrix::from_fn(size, size, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    for i in 0..size {
        scaled[(i, i)] = scaled[(i, i)].max(1e-12) + damping;
    }
    let right = gradient.component_mul(&scale);
    let step = scaled.cholesky()?.solve(&right).component_mul(&scale);
    step.iter().all(|value| value.is_finite()).then_some(step)
}
