//! The predicted gain of an effect that is not fitted yet: how much of the residual its change of the prediction explains,
//! linearised, while the model's own parameters follow.

use crate::effects::effect::Coordinate;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::Jacobian;
use crate::noise::Noise;
use crate::stats::sums::dot;

/// Largest multiple of an effect's start to which its change of the prediction is extrapolated.
const LONGEST_STEP: f64 = 6.0;
/// Norm of a column after orthogonalisation over its norm before, below which the column is linearly dependent.
const DEPENDENT: f64 = 1e-6;

/// Predicts gains for one fit, under one noise model.
pub(super) struct GainPredictor {
    noise: Noise,
    /// Part of the whitened residual that the model's own parameters cannot change, in scales of the noise, dimensionless.
    residual: Vec<f64>,
    /// Sum of the squares of the whole whitened residual.
    total: f64,
    /// Square roots of the rows' weights, in 1/V.
    roots: Vec<f64>,
    /// Orthonormal basis of the changes that the model's own parameters can make.
    own: Vec<Vec<f64>>,
}

impl GainPredictor {
    /// Linearises a fit under `noise`, which need not be the fit's own.
    pub(super) fn new(engine: &mut Engine, fit: &Fit, noise: Noise) -> Self {
        let terms = engine.terms(&noise, &fit.residual);
        let roots: Vec<f64> = terms.iter().map(|term| term.weight.sqrt()).collect();
        let mut residual: Vec<f64> = terms.iter().map(|term| term.weight.sqrt() * term.residual).collect();
        let Jacobian { columns, places } = engine.jacobian(&fit.model, &noise, &fit.residual);
        let (points, bounds) = (fit.model.points(), fit.model.coordinates(engine.data));
        let mut own: Vec<Vec<f64>> = Vec::new();
        for (column, place) in columns.iter().zip(places) {
            let column: Vec<f64> = column.iter().zip(&roots).map(|(value, root)| value * root).collect();
            // A parameter at its bound cannot move outwards, so that another effect may explain what it cannot.
            let slope = dot(&column, &residual);
            let Coordinate { lowest, highest, .. } = bounds[place];
            if points[place] <= lowest && slope < 0.0 || points[place] >= highest && slope > 0.0 {
                continue;
            }
            add_direction(&mut own, column);
        }
        // The initial state follows as well.
        for state in engine.initial_states(&fit.model) {
            let column: Vec<f64> = noise.whitened(state).iter().zip(&roots).map(|(value, root)| value * root).collect();
            add_direction(&mut own, column);
        }
        let total = dot(&residual, &residual);
        remove(&mut residual, &own);
        Self { noise, residual, total, roots, own }
    }

    /// Gain in log-likelihood, in nats, of the best multiple of `change` (a change of the residual, in V), 0 to
    /// [`LONGEST_STEP`].
    pub(super) fn predicted_gain(&self, change: &[f64]) -> f64 {
        let change: Vec<f64> =
            self.noise.whitened(change).iter().zip(&self.roots).map(|(value, root)| value * root).collect();
        let whole = dot(&change, &change);
        let size = whole - self.own.iter().map(|direction| dot(direction, &change).powi(2)).sum::<f64>();
        if size < (DEPENDENT * DEPENDENT * whole).max(1e-9) {
            return 0.0;
        }
        let along = dot(&self.residual, &change);
        let step = (along / size).clamp(0.0, LONGEST_STEP);
        let total = self.total;
        let part = ((2.0 * along - step * size) * step / total.max(1e-300)).clamp(0.0, 1.0 - 1e-9);
        // The scale of the noise would shrink with the residual, but not that of rounded rows, few of which are informative.
        let informative = if self.noise.half_step > 0.0 { total } else { self.residual.len() as f64 };
        -0.5 * informative * (1.0 - part).ln()
    }

    /// Unit vector of a change of the residual, in V, whitened and without what the model's own parameters can make, and the residual
    /// along it; `None` if hardly anything of the change is left.
    pub(super) fn direction(&self, change: &[f64]) -> Option<(Vec<f64>, f64)> {
        let mut change: Vec<f64> =
            self.noise.whitened(change).iter().zip(&self.roots).map(|(value, root)| value * root).collect();
        let whole = norm(&change);
        remove(&mut change, &self.own);
        let left = norm(&change);
        if !left.is_finite() || left < (DEPENDENT * whole).max(1e-5) {
            return None;
        }
        change.iter_mut().for_each(|value| *value /= left);
        let along = dot(&self.residual, &change);
        Some((change, along))
    }

    /// Sum of the squares of the whole whitened residual.
    pub(super) fn total(&self) -> f64 {
        self.total
    }
}

/// Euclidean norm, in the unit of the values.
fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Adds the part of a vector that is orthogonal to all directions, unless almost nothing of it is left.
fn add_direction(basis: &mut Vec<Vec<f64>>, mut vector: Vec<f64>) {
    let size = norm(&vector);
    remove(&mut vector, basis);
    let left = norm(&vector);
    if left > DEPENDENT * size {
        vector.iter_mut().for_each(|value| *value /= left);
        basis.push(vector);
    }
}

/// Subtracts the projection onto an orthonormal basis.
fn remove(vector: &mut [f64], basis: &[Vec<f64>]) {
    for direction in basis {
        let along = dot(vector, direction);
        vector.iter_mut().zip(direction).for_each(|(value, unit)| *value -= along * unit);
    }
}
