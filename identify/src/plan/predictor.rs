//! Predictions of models under one candidate, and their sensitivities, whitened by the noise of the first record.

use crate::effects::model::Model;
use crate::fit::simulator::Simulator;
use crate::hypotheses::FittedNoise;
use crate::noise::autocorrelation::Autocorrelation;
use crate::plan::candidate::Frame;
use crate::plan::design::Bend;
use crate::plan::grid::Grid;
use crate::plant::base::Base;
use crate::record::data::Data;

/// Step of a difference quotient, relative to the coordinate's range or size.
const STEP: f64 = 1e-4;

/// The noise of the readings, as the whitening of a grid of rows.
#[derive(Clone, Debug)]
pub(super) struct Whitening {
    filter: Autocorrelation,
    /// Information of one reading of independent noise, in 1/V^2: of the innovations, and at the corner frequency of the spring.
    of_innovation: f64,
    at_corner: f64,
}

impl Whitening {
    /// Returns the whitening of the noise of a record whose spring has a time constant of `tau_rows` rows.
    pub(super) fn new(noise: &FittedNoise, frame: &Frame) -> Self {
        // Fisher information of Student's distribution relative to the normal one, and the variance of rounding.
        let tail = noise.tail.map_or(1.0, |nu| (nu + 1.0) / (nu + 3.0));
        let of_innovation = tail / (noise.sigma.powi(2) + noise.half_step.powi(2) / 3.0);
        let filter = Autocorrelation::new(noise.ar.clone(), noise.power, frame.rows);
        let omega = 1.0 / frame.tau_rows;
        let (mut real, mut imaginary) = (1.0, 0.0);
        for (lag, phi) in (1u32..).zip(&noise.ar) {
            real -= phi * (omega * f64::from(lag)).cos();
            imaginary += phi * (omega * f64::from(lag)).sin();
        }
        let gain = (real * real + imaginary * imaginary) * (2.0 * (0.5 * omega).sin()).powf(2.0 * noise.power);
        Self { filter, of_innovation, at_corner: of_innovation * gain }
    }

    /// Returns the information on a slow signal in one reading, in 1/V^2.
    pub(super) fn at_corner(&self) -> f64 {
        self.at_corner
    }

    /// Returns a signal such that its noise is independent with unit variance.
    fn whitened(&self, signal: &[f64], grid: &Grid) -> Vec<f64> {
        if grid.complete {
            let root = self.of_innovation.sqrt();
            return self.filter.whitened(signal).into_iter().map(|value| root * value).collect();
        }
        let root = |weight: &f64| (weight * self.at_corner).sqrt();
        signal.iter().zip(&grid.weights).map(|(value, weight)| value * root(weight)).collect()
    }
}

/// Simulates models under one candidate.
pub(super) struct Predictor<'a> {
    data: &'a Data,
    grid: &'a Grid,
    whitening: &'a Whitening,
    simulator: Simulator<'a>,
    /// Lowest and highest reading of the sensor.
    bounds: (f64, f64),
}

impl<'a> Predictor<'a> {
    /// Prepares simulations of a candidate's record.
    pub(super) fn new(
        data: &'a Data,
        base: &'a Base,
        grid: &'a Grid,
        whitening: &'a Whitening,
        noise: &FittedNoise,
    ) -> Self {
        let bounds = (noise.lower.unwrap_or(f64::NEG_INFINITY), noise.upper.unwrap_or(f64::INFINITY));
        Self { data, grid, whitening, simulator: Simulator::new(data, base), bounds }
    }

    /// Returns the readings that a model predicts, in normalised V.
    pub(super) fn readings(&mut self, model: &Model) -> Vec<f64> {
        let mut readings = Vec::new();
        self.simulator.run(model, &mut readings);
        readings.iter_mut().for_each(|reading| *reading = reading.clamp(self.bounds.0, self.bounds.1));
        readings
    }

    /// Returns the difference of two predictions, whitened.
    pub(super) fn whitened_difference(&self, one: &[f64], other: &[f64]) -> Vec<f64> {
        let difference: Vec<f64> = one.iter().zip(other).map(|(a, b)| a - b).collect();
        self.whitening.whitened(&difference, self.grid)
    }

    /// Returns the change of the prediction per standard deviation of a coordinate, whitened; `here` is the prediction without it.
    pub(super) fn sensitivity(&mut self, bend: &Bend, here: &[f64]) -> Vec<f64> {
        let bounds = bend.model.coordinates(self.data)[bend.place];
        let points = bend.model.points();
        let mut step = STEP * (bounds.highest - bounds.lowest).min(1.0 + points[bend.place].abs());
        if points[bend.place] + step > bounds.highest {
            step = -step;
        }
        let mut moved = bend.model.clone();
        let mut there = points;
        there[bend.place] += step;
        moved.set_points(&there);
        let there = self.readings(&moved);
        let mut column = self.whitened_difference(&there, here);
        column.iter_mut().for_each(|value| *value *= bend.deviation / step);
        column
    }

    /// Returns a shift of all readings by the full scale, whitened.
    pub(super) fn shift(&self) -> Vec<f64> {
        self.whitening.whitened(&vec![self.data.full_scale_v; self.grid.rows.len()], self.grid)
    }

    /// Returns the mean square over all readings of the difference of two predictions, in V^2.
    pub(super) fn mean_square(&self, one: &[f64], other: &[f64]) -> f64 {
        let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
        let sum: f64 = squares.zip(&self.grid.weights).map(|(square, weight)| weight * square).sum();
        sum / self.grid.weights.iter().sum::<f64>()
    }
}
