//! The reported parameters of a fit, with 95 % intervals.
//!
//! ```text
//! covariance = (J' W J + B)^-1        interval = value +- 1.96 sqrt(g' covariance g),    g: gradient over the
//! coordinates
//! ```
//!
//! `B` is the information of the bounds: `(1.96 / (highest - lowest))^2` for each coordinate. It is the only
//! information where two effects are equivalent (a delay below one row, and the feedthrough).
//!
//! A point of a curve is reported only where the record has been, an end of a curve as extrapolated elsewhere.
//!
//! A parameter whose value is an end of what its bounds allow is marked as at a bound.
//!
//! Under a nominal spring that was identified from the same readings, zero and gain of the reading are estimated for each model. A
//! point of a curve is then that of the reading: its gradient contains theirs, and its variance what they leave open at given
//! coordinates.
//!
//! A parameter that only a search finds has the range that the search returns.

use nalgebra::DMatrix;

use crate::answer::Parameter;
use crate::dimension::Dimension;
use crate::effects::effect::{FitContext, Quantity};
use crate::effects::model::{Block, Reported};
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::normal_equations;
use crate::fit::reading_map::ReadingMap;
use crate::record::data::Data;
use crate::stats::thresholds::probability::Z;

/// Distance from a bound, relative to it, at which a value is at that bound.
const AT_BOUND: f64 = 1e-6;

/// Returns the information matrix of the fitted coordinates.
pub(crate) fn information(engine: &mut Engine, fit: &Fit) -> DMatrix<f64> {
    let (jacobian, terms) = engine.linearised(fit);
    let (normal, _) = normal_equations(&jacobian, &terms);
    // Reweighting overstates the information under a heavy tail; the variance of the scores corrects it.
    let squares: f64 = terms.iter().map(|term| (term.weight * term.residual).powi(2)).sum();
    let weights: f64 = terms.iter().map(|term| term.weight).sum();
    let heavy = fit.noise.half_step == 0.0 && (fit.noise.nu.is_finite() || fit.noise.outliers.is_some());
    if heavy { normal * (squares / weights).min(1.0) } else { normal }
}

/// Returns the covariance of the fitted coordinates, with the information of their bounds; `None` if the matrix cannot
/// be inverted.
pub(crate) fn covariance(engine: &mut Engine, fit: &Fit) -> Option<DMatrix<f64>> {
    let mut known = information(engine, fit);
    let bounds = fit.model.coordinates(engine.data);
    let places = (0..bounds.len()).filter(|&place| bounds[place].fitted);
    for (index, place) in places.enumerate() {
        known[(index, index)] += (Z / (bounds[place].highest - bounds[place].lowest)).powi(2);
    }
    known.try_inverse().filter(|matrix| matrix.iter().all(|value| value.is_finite()))
}

/// Returns the reported parameters of an effect with their intervals, by the delta method; values are normalised.
pub fn parameters(engine: &mut Engine, fit: &Fit, effect: usize) -> Vec<(String, Parameter)> {
    let data = engine.data;
    let covariance = covariance(engine, fit);
    let bounds = fit.model.coordinates(data);
    let places: Vec<usize> = (0..bounds.len()).filter(|&place| bounds[place].fitted).collect();
    let is_reading = |(block, point): &(Block, Vec<f64>)| {
        let mut quantities = block.effect().quantities(block.form, point, data).into_iter();
        block.effect == effect && quantities.any(|quantity| quantity.dimension == Dimension::Stiffness)
    };
    let reading = fit.model.blocks.iter().any(is_reading).then(|| ReadingMap::of(engine, fit, &places)).flatten();
    let mut start = 0;
    let mut found = Vec::new();
    for (of, (block, point)) in fit.model.blocks.iter().enumerate() {
        if block.effect == effect {
            let quantities = |point: &[f64]| block.effect().quantities(block.form, point, data);
            for Reported { index, quantity, extrapolated } in fit.model.reported(of, engine.base(), data) {
                let Quantity { name, dimension, value, .. } = quantity;
                let mut slope: Vec<f64> = places
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
                let mut reach = reach(block, point, data, index);
                let (mut value, mut variance) = (value, 0.0);
                if let Some(reading) = reading.as_ref().filter(|_| dimension == Dimension::Stiffness) {
                    variance = reading.variance(value);
                    slope.iter_mut().enumerate().for_each(|(of, slope)| *slope = reading.slope(of, value, *slope));
                    value = reading.at(value);
                    // Gain and zero are free: no bound of a curve's coordinates limits its readings.
                    reach = (f64::NEG_INFINITY, f64::INFINITY);
                }
                let error = covariance.as_ref().map_or(f64::INFINITY, |matrix| {
                    let slope = nalgebra::DVector::from_vec(slope);
                    ((slope.transpose() * matrix * &slope)[(0, 0)].max(0.0) + variance).sqrt()
                });
                let extrapolated_from_v = extrapolated.map(|range| [range.low, range.high]);
                found.push((name, Parameter { extrapolated_from_v, ..interval(value, error, dimension, reach) }));
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

/// Returns the smallest and the largest value of a quantity with one coordinate at a time at its bounds and at the
/// fitted point.
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

/// Returns a symmetric interval; if the quantity cannot be negative, a logarithmic one instead of one that would cross
/// zero. Limited to `reach` where that contains the value.
fn interval(value: f64, error: f64, dimension: Dimension, reach: (f64, f64)) -> Parameter {
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
    let near = |one: f64, other: f64| (one - other).abs() <= AT_BOUND * other.abs();
    // A quantity that no coordinate changes has no range.
    let at_bound = !near(reach.0, reach.1) && (near(value, reach.0) || near(value, reach.1));
    Parameter { value, low, high, unit: String::new(), at_bound, extrapolated_from_v: None, dimension }
}
