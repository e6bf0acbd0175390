//! What an effect that is not fitted yet promises: how much of the residual its change could explain.

use crate::effects::effect::Coordinate;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::Jacobian;
use crate::noise::Noise;
use crate::stats::sums::dot;

/// How many times its start an effect may be, in the hope of a promise.
const FARTHEST: f64 = 6.0;

/// How much a change of the prediction could explain, when the model's own points follow.
pub(super) struct Metric {
    noise: Noise,
    residual: Vec<f64>,
    /// Square roots of the rows' weights.
    roots: Vec<f64>,
    /// What the model's own points can make, orthonormal.
    own: Vec<Vec<f64>>,
}

impl Metric {
    pub(super) fn new(engine: &mut Engine, fit: &Fit, noise: Noise) -> Self {
        let terms = engine.terms(&noise, &fit.residual);
        let roots: Vec<f64> = terms.iter().map(|term| term.weight.sqrt()).collect();
        let residual: Vec<f64> = terms.iter().map(|term| term.weight.sqrt() * term.residual).collect();
        let Jacobian { columns, places } = engine.jacobian(&fit.model, &noise, &fit.residual);
        let (points, bounds) = (fit.model.points(), fit.model.coordinates(engine.data));
        let mut own: Vec<Vec<f64>> = Vec::new();
        for (column, place) in columns.iter().zip(places) {
            let mut column: Vec<f64> = column.iter().zip(&roots).map(|(value, root)| value * root).collect();
            // A point at its bound cannot follow where it wants out: what it wants there, another effect may be.
            let wanted = dot(&column, &residual);
            let Coordinate { lowest, highest, .. } = bounds[place];
            if points[place] <= lowest && wanted < 0.0 || points[place] >= highest && wanted > 0.0 {
                continue;
            }
            let size = norm(&column);
            remove(&mut column, &own);
            let left = norm(&column);
            if left > 1e-6 * size {
                column.iter_mut().for_each(|value| *value /= left);
                own.push(column);
            }
        }
        Self { noise, residual, roots, own }
    }

    /// Gain in nats of the best step along `change`, as far as a straight line may be believed.
    pub(super) fn promise(&self, change: &[f64]) -> f64 {
        let mut change: Vec<f64> =
            self.noise.whitened(change).iter().zip(&self.roots).map(|(value, root)| value * root).collect();
        remove(&mut change, &self.own);
        let size = dot(&change, &change);
        if size < 1e-9 {
            return 0.0;
        }
        let along = dot(&self.residual, &change);
        let step = (along / size).clamp(0.0, FARTHEST);
        let total = dot(&self.residual, &self.residual);
        let part = ((2.0 * along - step * size) * step / total.max(1e-300)).clamp(0.0, 1.0 - 1e-9);
        // The noise's scale would shrink along; not that of rounded rows, most of which tell nothing.
        let telling = if self.noise.half_step > 0.0 { total } else { self.residual.len() as f64 };
        -0.5 * telling * (1.0 - part).ln()
    }
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Takes off what lies along an orthonormal basis.
fn remove(vector: &mut [f64], basis: &[Vec<f64>]) {
    for direction in basis {
        let along = dot(vector, direction);
        vector.iter_mut().zip(direction).for_each(|(value, unit)| *value -= along * unit);
    }
}
