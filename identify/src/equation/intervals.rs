//! Parameters of an equation with 95 % intervals, under the law of the noise of its residual.
//!
//! ```text
//! covariance = (J' W J)^-1        J: derivatives by linear coefficients and coordinates, whitened
//! ```

use nalgebra::DMatrix;

use crate::answer::Parameter;
use crate::dimension::Dimension;
use crate::equation::clock::Term;
use crate::equation::fitted::Fitted;
use crate::equation::problem::Problem;
use crate::equation::text::Text;
use crate::fit::normal_equations::{Jacobian, normal_equations};
use crate::noise::Noise;
use crate::record::observed::Kind as Reading;
use crate::stats::thresholds::probability::Z;

/// Distance from a bound, relative to the range, at which a coordinate is at that bound.
const AT_BOUND: f64 = 1e-6;

/// Returns every parameter of an equation, in the file's units; the linear coefficients first.
pub(super) fn parameters(fit: &Fitted, problem: &Problem, text: &Text) -> Vec<(String, Parameter)> {
    let (_, response) = problem.evaluate(fit.structure.clone(), &problem.used(None), &fit.residual);
    let (places, jacobian) = problem.jacobian(fit, &response);
    let noise = Noise::fitted(&fit.residual, problem.observed);
    let deviations = deviations(fit, problem, [&response.columns[..], &jacobian].concat(), &noise);
    let scales = problem.data.scales();
    let unit_of_gain = match (scales.units.reading.as_str(), "V") {
        (reading, base) if reading == base => String::new(),
        (reading, base) => format!("{reading}/{base}"),
    };
    let made = |value: f64, low: f64, high: f64, dimension: Dimension, at_bound: bool| {
        let mut ends = [low, high].map(|end| scales.restored(dimension, end));
        if ends[0] > ends[1] {
            ends.reverse();
        }
        Parameter {
            value: scales.restored(dimension, value),
            low: ends[0],
            high: ends[1],
            unit: dimension.unit(&scales.units),
            at_bound,
            extrapolated_from_v: None,
            dimension,
        }
    };
    let mut found = Vec::new();
    let weights = fit.structure.last_sum().map_or(0, |sum| sum.chains.len());
    for (index, name) in text.linear.iter().enumerate() {
        let (value, half) = (fit.coefficients[index], Z * deviations[index]);
        let dimension = match index {
            0 => Dimension::Reading,
            _ if index <= weights => Dimension::Ratio,
            _ => Dimension::ReadingDifference,
        };
        let parameter = match dimension {
            Dimension::Ratio => {
                let gain = scales.reading / scales.volt_v;
                let ends = [gain * (value - half), gain * (value + half)];
                let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                let made = made(gain * value, low, high, dimension, false);
                Parameter { unit: unit_of_gain.clone(), ..made }
            }
            _ => made(value, value - half, value + half, dimension, false),
        };
        found.push((name.clone(), parameter));
    }
    let mut names = text.others.iter();
    for (index, (_, value, coordinate)) in fit.structure.coordinates(&problem.scale).iter().enumerate() {
        let Some(name) = names.next() else { break };
        let half = match places.iter().position(|place| *place == index) {
            Some(place) => Z * deviations[response.columns.len() + place],
            None => problem.scale.sample_s,
        };
        let ends = [value - half, value + half].map(|end| end.clamp(coordinate.lowest, coordinate.highest));
        let [value, low, high] = [*value, ends[0], ends[1]].map(|at| coordinate.parameter(at));
        let reach = AT_BOUND * (coordinate.highest - coordinate.lowest);
        let at = coordinate.of(value);
        let at_bound = at - coordinate.lowest <= reach || coordinate.highest - at <= reach;
        found.push((name.clone(), made(value, low, high, coordinate.dimension, at_bound && coordinate.fitted)));
    }
    let steps = fit.structure.terms.iter().filter_map(|term| match term {
        Term::Step(from_s) => Some(*from_s),
        _ => None,
    });
    for (name, from_s) in names.zip(steps) {
        let half = problem.scale.sample_s;
        found.push((name.clone(), made(from_s, from_s - half, from_s + half, Dimension::TimePoint, false)));
    }
    found
}

/// Standard deviations of the linear coefficients, then of the fitted coordinates.
fn deviations(fit: &Fitted, problem: &Problem, columns: Vec<Vec<f64>>, noise: &Noise) -> Vec<f64> {
    let observed = problem.observed;
    let white = noise.innovations(&observed.errors(&fit.residual));
    let terms: Vec<_> =
        (0..white.len()).map(|row| noise.term(observed.kinds[row], fit.residual[row], white[row])).collect();
    let whitened = |column: &Vec<f64>| {
        let mut white = noise.whitened(column);
        for (white, kind) in white.iter_mut().zip(&observed.kinds) {
            *white = if *kind == Reading::Exact { *white } else { 0.0 };
        }
        white
    };
    let jacobian = Jacobian { places: (0..columns.len()).collect(), columns: columns.iter().map(whitened).collect() };
    let (normal, _) = normal_equations(&jacobian, &terms);
    let scale: Vec<f64> = (0..columns.len()).map(|i| 1.0 / normal[(i, i)].max(1e-300).sqrt()).collect();
    let scaled = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
        normal[(i, j)] * scale[i] * scale[j] + if i == j { 1e-12 } else { 0.0 }
    });
    let inverse = scaled.try_inverse().unwrap_or_else(|| DMatrix::identity(columns.len(), columns.len()));
    (0..columns.len()).map(|i| (scale[i] * inverse[(i, i)].max(0.0).sqrt()).min(f64::MAX.sqrt())).collect()
}
