//! The user's parameters of a fit with their 95 % intervals.
//!
//! ```text
//! covariance = (J' W J + B)^-1        interval = value +- 1.96 sqrt(g' covariance g),    g: slope over the coordinates
//! ```
//!
//! `B` is what the bounds tell of each coordinate: it is no farther than from one to the other. Where two effects do the
//! same within them (a delay of a part of a row, the share of a step that comes at once), it is all that is known.
//!
//! What only a search has found has the range that the search leaves it.

use nalgebra::DMatrix;

use crate::answer::Parameter;
use crate::effects::effect::{FitContext, Quantity};
use crate::effects::model::Block;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::normal_equations;
use crate::record::data::Data;
use crate::stats::scale::Z;

/// What the readings tell of the fitted coordinates.
pub(crate) fn information(engine: &mut Engine, fit: &Fit) -> DMatrix<f64> {
    let jacobian = engine.jacobian(&fit.model, &fit.noise, &fit.residual);
    let terms = engine.terms(&fit.noise, &fit.residual);
    let (normal, _) = normal_equations(&jacobian, &terms);
    // Reweighting overstates what a heavy tail tells; the scores' own variance does not.
    let squares: f64 = terms.iter().map(|term| (term.weight * term.residual).powi(2)).sum();
    let weights: f64 = terms.iter().map(|term| term.weight).sum();
    let heavy = fit.noise.half_step == 0.0 && (fit.noise.nu.is_finite() || fit.noise.outliers.is_some());
    if heavy { normal * (squares / weights).min(1.0) } else { normal }
}

/// Inverse of the information on the fitted coordinates, with what their bounds tell.
pub(crate) fn covariance(engine: &mut Engine, fit: &Fit) -> Option<DMatrix<f64>> {
    let mut known = information(engine, fit);
    let bounds = fit.model.coordinates(engine.data);
    let places = (0..bounds.len()).filter(|&place| bounds[place].fitted);
    for (index, place) in places.enumerate() {
        known[(index, index)] += (Z / (bounds[place].highest - bounds[place].lowest)).powi(2);
    }
    known.try_inverse().filter(|matrix| matrix.iter().all(|value| value.is_finite()))
}

/// The user's parameters of an effect with their intervals, by the delta method.
pub(crate) fn parameters(engine: &mut Engine, fit: &Fit, effect: usize) -> Vec<(String, Parameter)> {
    let data = engine.data;
    let covariance = covariance(engine, fit);
    let bounds = fit.model.coordinates(data);
    let places: Vec<usize> = (0..bounds.len()).filter(|&place| bounds[place].fitted).collect();
    let mut start = 0;
    let mut found = Vec::new();
    for (block, point) in &fit.model.blocks {
        if block.effect == effect {
            let quantities = |point: &[f64]| block.effect().quantities(block.form, point, data);
            let values = quantities(point);
            for (index, Quantity { name, unit, value }) in values.into_iter().enumerate() {
                let slope: Vec<f64> = places
                    .iter()
                    .map(|&place| {
                        if !(start..start + point.len()).contains(&place) {
                            return 0.0;
                        }
                        let mut moved = point.clone();
                        let step = 1e-5 * (1.0 + point[place - start].abs());
                        moved[place - start] += step;
                        (quantities(&moved)[index].value - value) / step
                    })
                    .collect();
                let error = covariance.as_ref().map_or(f64::INFINITY, |matrix| {
                    let slope = nalgebra::DVector::from_vec(slope);
                    (slope.transpose() * matrix * &slope)[(0, 0)].max(0.0).sqrt()
                });
                let reach = reach(block, point, data, index);
                found.push((name, interval(value, error, unit, reach)));
            }
            let residual = engine.residual(&fit.model.without(effect));
            let context = FitContext { data, residual: &residual, sigma: fit.noise.sigma };
            for (name, low, high) in block.effect().searched_range(block.form, point, &context) {
                if let Some((_, parameter)) = found.iter_mut().find(|(other, _)| *other == name) {
                    (parameter.low, parameter.high) = (low.min(parameter.value), high.max(parameter.value));
                }
            }
        }
        start += point.len();
    }
    found
}

/// Lowest and highest that a quantity can be: one coordinate after the other at its bounds. An amplitude of two parts is
/// smallest between them.
fn reach(block: &Block, point: &[f64], data: &Data, index: usize) -> (f64, f64) {
    let mut reach = (f64::INFINITY, f64::NEG_INFINITY);
    for (place, bounds) in block.coordinates(data).iter().enumerate() {
        let [low, here, high] = [bounds.lowest, point[place], bounds.highest].map(|at| {
            let mut moved = point.to_vec();
            moved[place] = at;
            block.effect().quantities(block.form, &moved, data)[index].value
        });
        if low != here || high != here {
            reach = (reach.0.min(low).min(high), reach.1.max(low).max(high));
        }
    }
    reach
}

/// Symmetric, but for what is only a size: that never crosses zero. Within the quantity's reach, where the value is.
fn interval(value: f64, error: f64, unit: &'static str, reach: (f64, f64)) -> Parameter {
    let error = if error.is_finite() { error } else { 10.0 * value.abs() };
    let (mut low, mut high) = (value - Z * error, value + Z * error);
    if value > 0.0 && low < 0.0 && reach.0 >= 0.0 {
        let factor = (Z * error / value).min(50.0).exp();
        (low, high) = (value / factor, value * factor);
    }
    if reach.0 <= value {
        low = low.max(reach.0);
    }
    if reach.1 >= value {
        high = high.min(reach.1);
    }
    Parameter { value, low, high, unit }
}
