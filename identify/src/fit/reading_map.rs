//! Zero and gain of the reading under a nominal spring that was identified from the same readings: they are estimated for each model,
//! as the initial state is.

use nalgebra::DMatrix;

use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::plant::initial_state::Start;

/// Step of a coordinate for a derivative.
const STEP: f64 = 1e-5;

/// Zero and gain of the reading at a fit, and how well they are known.
pub(super) struct ReadingMap {
    /// Zero, in V, and gain, relative to those of the nominal spring.
    here: [f64; 2],
    /// Derivatives of zero and gain by each fitted coordinate.
    slopes: Vec<[f64; 2]>,
    /// Covariance of zero and gain at given coordinates.
    covariance: [[f64; 2]; 2],
}

impl ReadingMap {
    /// Returns them at a fit, with their derivatives by the coordinates at some places; `None` if they are those of the nominal spring.
    pub(super) fn of(engine: &mut Engine, fit: &Fit, places: &[usize]) -> Option<Self> {
        let start = engine.start_with_reading_map(&fit.model)?;
        let full_scale_v = engine.data.full_scale_v;
        let points = fit.model.points();
        let slopes = places.iter().map(|&place| {
            let (mut moved, mut model) = (points.clone(), fit.model.clone());
            let step = STEP * (1.0 + points[place].abs());
            moved[place] += step;
            model.set_points(&moved);
            let there = engine.residual_from(&model, &start.start_v);
            let change: Vec<f64> =
                start.residual.iter().zip(there).map(|(here, there)| (there - here) / step).collect();
            let [zero_v, gain_v] = last_two(&start.estimate.moved_by(&change))?;
            Some([zero_v, gain_v / full_scale_v])
        });
        let slopes = slopes.collect::<Option<_>>()?;
        let all: DMatrix<f64> = start.estimate.covariance(fit.noise.marginal);
        let (zero, units) = (all.nrows().checked_sub(2)?, [1.0, 1.0 / full_scale_v]);
        let covariance =
            std::array::from_fn(|i| std::array::from_fn(|j| units[i] * units[j] * all[(zero + i, zero + j)]));
        Some(Self { here: reading_map(&start, full_scale_v)?, slopes, covariance })
    }

    /// Returns the reading of a stiffness, both in V.
    pub(super) fn at(&self, stiffness: f64) -> f64 {
        self.here[0] + self.here[1] * stiffness
    }

    /// Returns the derivative of the reading by a fitted coordinate, from that of the stiffness.
    pub(super) fn slope(&self, coordinate: usize, stiffness: f64, slope: f64) -> f64 {
        let [zero, gain] = self.slopes[coordinate];
        zero + gain * stiffness + self.here[1] * slope
    }

    /// Returns the variance of the reading of a stiffness at given coordinates, in V^2.
    pub(super) fn variance(&self, stiffness: f64) -> f64 {
        let [[zero, both], [_, gain]] = self.covariance;
        (zero + 2.0 * stiffness * both + stiffness * stiffness * gain).max(0.0)
    }
}

impl Engine<'_> {
    /// Returns zero, in V, and gain of the reading relative to those of the nominal spring at a model, if that was identified from the
    /// same readings.
    pub fn reading_map(&mut self, model: &Model) -> Option<[f64; 2]> {
        let start = self.start_with_reading_map(model)?;
        reading_map(&start, self.data.full_scale_v).filter(|[zero_v, gain]| zero_v.is_finite() && gain.is_normal())
    }

    /// Returns an estimate that ends with zero and gain; `None` if they are not estimated.
    fn start_with_reading_map(&mut self, model: &Model) -> Option<Start> {
        if self.data.normalisation.identified { self.start(model) } else { None }
    }
}

/// Returns zero, in V, and gain of an estimate that ends with them.
fn reading_map(start: &Start, full_scale_v: f64) -> Option<[f64; 2]> {
    last_two(&start.start_v).map(|[zero_v, gain_v]| [zero_v, 1.0 + gain_v / full_scale_v])
}

fn last_two(values: &[f64]) -> Option<[f64; 2]> {
    values.last_chunk().copied()
}
