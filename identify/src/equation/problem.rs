//! Fits of equations to a record: Levenberg-Marquardt steps on the likelihood of robust noise, in free run.
//!
//! The linear coefficients are solved for at every step and eliminated from the normal equations (variable projection, Golub and
//! Pereyra 1973, with Kaufman's Jacobian); rows are weighted as under Student's t distribution of five degrees of freedom.

use nalgebra::{DMatrix, DVector};

use crate::equation::fitted::Fitted;
use crate::equation::response::{Response, Source};
use crate::equation::scale::Scale;
use crate::equation::structure::Structure;
use crate::fit::budget::Budget;
use crate::fit::normal_equations::damped_step;
use crate::noise::Noise;
use crate::record::data::Data;
use crate::record::observed::{Kind as Reading, Observed};
use crate::record::signal::Signal;
use crate::stats::sums::dot;

/// Step of a coordinate for a difference quotient, relative to one plus its size.
const DIFFERENCE: f64 = 1e-5;
/// Trial steps of one round.
const TRIALS: usize = 5;
/// Ridge on the scaled normal equations of the linear coefficients, for columns that are nearly dependent.
const RIDGE: f64 = 1e-10;
/// A fit ends with a round that gains less, in nats.
const LEAST_GAIN: f64 = 0.05;
/// Work for each row of one column in a step, in pieces of the voltage through one lag.
const WORK_OF_COLUMN: u64 = 3;
/// Work for each row of a likelihood.
const WORK_OF_LIKELIHOOD: u64 = 6;

/// A record to which equations are fitted.
pub struct Problem<'a> {
    /// The record, normalised.
    pub data: &'a Data,
    /// How its readings were taken.
    pub observed: &'a Observed,
    /// Scales of the record.
    pub scale: Scale,
    input: Signal,
    time_s: Vec<f64>,
    /// Reading plus what a converter cut off.
    pub(super) reading: Vec<f64>,
    pub(super) budget: &'a Budget,
}

impl<'a> Problem<'a> {
    /// Prepares a record.
    pub fn new(data: &'a Data, observed: &'a Observed, budget: &'a Budget) -> Self {
        let input = if data.normalisation.even { data.command.magnitude() } else { data.command.clone() };
        let first = data.time_s.first().copied().unwrap_or(0.0);
        Self {
            data,
            observed,
            scale: Scale::of(data),
            input,
            time_s: data.time_s.iter().map(|time_s| time_s - first).collect(),
            reading: data.reading.iter().map(|reading| reading + observed.truncation_v).collect(),
            budget,
        }
    }

    pub(super) fn source(&self) -> Source<'_> {
        Source {
            input: &self.input,
            time_s: &self.time_s,
            scale: &self.scale,
            initial_state_unknown: self.data.initial_state_unknown,
        }
    }

    /// Returns the price of an equation's parameters, in nats: half the logarithm of the number of rows for each.
    pub(super) fn price(&self, structure: &Structure) -> f64 {
        0.5 * (self.data.rows().max(2) as f64).ln() * structure.priced(&self.scale) as f64
    }

    fn respond(&self, structure: &Structure) -> Response {
        let response = Response::of(structure, self.source());
        self.budget.spend(response.work);
        response
    }

    /// Returns reading minus prediction of a fitted equation, which may have been fitted to another record of the same spring with
    /// the same scales.
    pub fn residual(&self, fit: &Fitted) -> Vec<f64> {
        let prediction = self.respond(&fit.structure).prediction(&fit.coefficients);
        self.reading.iter().zip(&prediction).map(|(reading, of)| reading - of).collect()
    }

    /// Returns the rows that are fitted: readings that are known but for noise and are not of the fold `without`.
    pub(super) fn used(&self, without: Option<u8>) -> Vec<bool> {
        let rows = self.observed.kinds.iter().zip(&self.data.fold);
        rows.map(|(kind, fold)| *kind == Reading::Exact && Some(*fold) != without).collect()
    }

    /// Returns the robust law of the used rows of a residual, and their log-likelihood in nats.
    fn likelihood(&self, residual: &[f64], used: &[bool]) -> (Noise, f64) {
        let weights = self.observed.weights.as_deref();
        let even = |row: usize| residual[row] * weights.map_or(1.0, |weights| weights[row]);
        let errors: Vec<f64> = (0..residual.len()).filter(|&row| used[row]).map(even).collect();
        let law = Noise::robust(&errors);
        self.budget.spend(WORK_OF_LIKELIHOOD * residual.len() as u64);
        let log_likelihood = law.exact_log_likelihood(&errors);
        (law, log_likelihood)
    }

    /// Returns the weights of the rows in a least-squares step around a residual, in 1/V^2; 0 for rows that are not used.
    fn weights(&self, residual: &[f64], used: &[bool]) -> Vec<f64> {
        let (law, _) = self.likelihood(residual, used);
        let even = self.observed.weights.as_deref();
        let weight = |row: usize| {
            let size = even.map_or(1.0, |even| even[row]);
            let variance = law.nu * law.sigma * law.sigma;
            size * size * (law.nu + 1.0) / (variance + (size * residual[row]).powi(2))
        };
        (0..residual.len()).map(|row| if used[row] { weight(row) } else { 0.0 }).collect()
    }

    /// Evaluates a structure at its coordinates, with the most likely linear coefficients, from the residual of a similar one.
    pub(super) fn evaluate(&self, structure: Structure, used: &[bool], near: &[f64]) -> (Fitted, Response) {
        let response = self.respond(&structure);
        (self.solved(structure, &response, used, near), response)
    }

    /// Returns the equation with the linear coefficients that are most likely for rows weighted as their residual `near` says.
    fn solved(&self, structure: Structure, response: &Response, used: &[bool], near: &[f64]) -> Fitted {
        let coefficients = self.solve(response, &self.weights(near, used));
        let prediction = response.prediction(&coefficients);
        let residual: Vec<f64> = self.reading.iter().zip(&prediction).map(|(reading, of)| reading - of).collect();
        let (_, value) = self.likelihood(&residual, used);
        let value = if value.is_finite() { value } else { f64::NEG_INFINITY };
        Fitted { structure, coefficients, residual, value }
    }

    /// Solves for the linear coefficients by weighted least squares.
    fn solve(&self, response: &Response, weights: &[f64]) -> Vec<f64> {
        let target: Vec<f64> = match response.fixed.is_empty() {
            true => self.reading.clone(),
            false => self.reading.iter().zip(&response.fixed).map(|(reading, of)| reading - of).collect(),
        };
        let (normal, products) = self.products(&response.columns, &response.columns, weights);
        let mut right = DVector::zeros(response.columns.len());
        for (index, column) in products.iter().enumerate() {
            right[index] = dot(column, &target);
        }
        self.budget.spend(WORK_OF_COLUMN * (response.columns.len() * weights.len()) as u64);
        damped_step(&normal, &right, RIDGE).map_or_else(|| vec![0.0; right.len()], |x| x.iter().copied().collect())
    }

    /// Returns `A' W B`, and the columns of `W A`.
    fn products(&self, a: &[Vec<f64>], b: &[Vec<f64>], weights: &[f64]) -> (DMatrix<f64>, Vec<Vec<f64>>) {
        let weighted: Vec<Vec<f64>> =
            a.iter().map(|column| column.iter().zip(weights).map(|(value, weight)| value * weight).collect()).collect();
        (DMatrix::from_fn(a.len(), b.len(), |i, j| dot(&weighted[i], &b[j])), weighted)
    }

    /// Returns the derivatives of the prediction by the fitted coordinates, and the index of each among all coordinates.
    pub(super) fn jacobian(&self, fit: &Fitted, response: &Response) -> (Vec<usize>, Vec<Vec<f64>>) {
        let coordinates = fit.structure.coordinates(&self.scale);
        let values: Vec<f64> = coordinates.iter().map(|(_, value, _)| *value).collect();
        let (mut places, mut columns) = (Vec::new(), Vec::new());
        for (index, (place, value, coordinate)) in coordinates.iter().enumerate() {
            if !coordinate.fitted || coordinate.lowest >= coordinate.highest {
                continue;
            }
            let mut step = DIFFERENCE * (1.0 + value.abs()).min(coordinate.highest - coordinate.lowest);
            if value + step > coordinate.highest {
                step = -step;
            }
            let mut moved = values.clone();
            moved[index] += step;
            let mut structure = fit.structure.clone();
            structure.set(&self.scale, &moved);
            let (mut change, work) = response.change(&structure, *place, &fit.coefficients, self.source());
            change.iter_mut().for_each(|value| *value /= step);
            self.budget.spend(work + WORK_OF_COLUMN * change.len() as u64);
            places.push(index);
            columns.push(change);
        }
        (places, columns)
    }

    /// Refines a structure by at most `rounds` steps on the rows that are used.
    pub fn fit(&self, structure: Structure, used: &[bool], near: &[f64], rounds: usize) -> Fitted {
        let (mut fit, mut response) = self.evaluate(structure, used, near);
        let reweighted = self.solved(fit.structure.clone(), &response, used, &fit.residual);
        if reweighted.value > fit.value {
            fit = reweighted;
        }
        let mut damping = 1e-3;
        for _ in 0..rounds {
            if self.budget.is_over() || !fit.value.is_finite() {
                break;
            }
            let (places, jacobian) = self.jacobian(&fit, &response);
            if places.is_empty() {
                break;
            }
            let weights = self.weights(&fit.residual, used);
            let (normal, gradient) = self.projected(&jacobian, &response.columns, &weights, &fit.residual);
            let coordinates = fit.structure.coordinates(&self.scale);
            let mut gained = 0.0;
            for _ in 0..TRIALS {
                let Some(step) = damped_step(&normal, &gradient, damping) else {
                    damping *= 10.0;
                    continue;
                };
                let mut moved: Vec<f64> = coordinates.iter().map(|(_, value, _)| *value).collect();
                for (&place, step) in places.iter().zip(step.iter()) {
                    let bounds = &coordinates[place].2;
                    moved[place] = (moved[place] + step.clamp(-2.0, 2.0)).clamp(bounds.lowest, bounds.highest);
                }
                let mut structure = fit.structure.clone();
                structure.set(&self.scale, &moved);
                let (there, response_there) = self.evaluate(structure, used, &fit.residual);
                if there.value > fit.value {
                    gained = there.value - fit.value;
                    (fit, response) = (there, response_there);
                    damping = (damping / 8.0).max(1e-9);
                    break;
                }
                damping *= 6.0;
            }
            if gained < LEAST_GAIN {
                break;
            }
        }
        fit
    }

    /// Returns the normal equations of the coordinates after the linear coefficients are eliminated.
    fn projected(
        &self,
        jacobian: &[Vec<f64>],
        columns: &[Vec<f64>],
        weights: &[f64],
        residual: &[f64],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let (own, weighted) = self.products(jacobian, jacobian, weights);
        let (linear, weighted_columns) = self.products(columns, columns, weights);
        let gradient = DVector::from_fn(jacobian.len(), |i, _| dot(&weighted[i], residual));
        self.budget.spend((jacobian.len() * (jacobian.len() + columns.len()) * residual.len() / 4) as u64);
        let cross = DMatrix::from_fn(columns.len(), jacobian.len(), |i, j| dot(&weighted_columns[i], &jacobian[j]));
        let scale = DVector::from_fn(columns.len(), |i, _| 1.0 / linear[(i, i)].max(1e-30).sqrt());
        let mut scaled = DMatrix::from_fn(columns.len(), columns.len(), |i, j| linear[(i, j)] * scale[i] * scale[j]);
        (0..columns.len()).for_each(|i| scaled[(i, i)] += RIDGE);
        let Some(factor) = scaled.cholesky() else { return (own, gradient) };
        let cross = DMatrix::from_fn(columns.len(), jacobian.len(), |i, j| scale[i] * cross[(i, j)]);
        let rest = DVector::from_fn(columns.len(), |i, _| scale[i] * dot(&weighted_columns[i], residual));
        let normal = &own - cross.transpose() * factor.solve(&cross);
        let gradient = gradient - cross.transpose() * factor.solve(&rest);
        (normal, gradient)
    }

    /// Returns reading minus prediction of every row by fits without the fold of the row.
    pub fn held_out(&self, fit: &Fitted, rounds: usize) -> Vec<f64> {
        let mut held_out = fit.residual.clone();
        for fold in 0..self.data.folds as u8 {
            let used = self.used(Some(fold));
            let without = self.fit(fit.structure.clone(), &used, &fit.residual, rounds);
            for (row, left) in held_out.iter_mut().enumerate() {
                if self.data.fold[row] == fold {
                    *left = without.residual[row];
                }
            }
        }
        held_out
    }
}
