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

/// Returns the damped step in which no coordinate leaves the range of its changes, lowest and highest: the one that would leave it first
/// ends there, and the others follow. `None` if the matrix is not positive definite.
///
/// Cut off one by one instead, coordinates that the readings hardly tell apart would no longer compensate each other.
pub fn bounded_step(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    ranges: &[[f64; 2]],
    damping: f64,
) -> Option<DVector<f64>> {
    let mut step = DVector::zeros(gradient.nrows());
    let mut free: Vec<usize> = (0..ranges.len()).collect();
    loop {
        let rest = (gradient - normal * &step).select_rows(&free);
        let of_free = damped_step(&normal.select_columns(&free).select_rows(&free), &rest, damping)?;
        // The part of its change after which a coordinate is at the end of its range.
        let reach = |index: usize| {
            let change = of_free[index];
            let end = ranges[free[index]][usize::from(change > 0.0)];
            if change == 0.0 { f64::INFINITY } else { end / change }
        };
        let first = (0..free.len()).min_by(|&a, &b| reach(a).total_cmp(&reach(b)));
        let Some(first) = first.filter(|&first| reach(first) < 1.0) else {
            free.iter().zip(&of_free).for_each(|(&index, change)| step[index] = *change);
            return Some(step);
        };
        let index = free.remove(first);
        step[index] = ranges[index][usize::from(of_free[first] > 0.0)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns of nearly the same shape, of which one may not move up.
    #[test]
    fn the_others_follow_a_coordinate_that_ends_at_its_bound() {
        let normal = DMatrix::from_row_slice(2, 2, &[1.0, 0.999, 0.999, 1.0]);
        // The step without bounds is [10, -8].
        let gradient = &normal * DVector::from_row_slice(&[10.0, -8.0]);
        let free = bounded_step(&normal, &gradient, &[[-20.0, 20.0]; 2], 0.0).unwrap();
        assert!((free[0] - 10.0).abs() < 1e-6 && (free[1] + 8.0).abs() < 1e-6, "{free}");
        let bounded = bounded_step(&normal, &gradient, &[[-20.0, 1.0], [-20.0, 20.0]], 0.0).unwrap();
        let best = gradient[1] - 0.999;
        assert!(bounded[0] == 1.0 && (bounded[1] - best).abs() < 1e-6, "{bounded}");
        assert_eq!(bounded_step(&normal, &gradient, &[[0.0, 0.0]; 2], 0.0).unwrap(), DVector::zeros(2));
    }
}
