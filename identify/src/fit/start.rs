//! What is estimated for each model instead of being moved by a fit: the initial state, and zero and gain of the reading under a
//! nominal spring that was identified from the same readings.
//!
//! Of a prediction that is linear in them it is one least squares estimate. Elsewhere Gauss-Newton steps are taken, from rest or, while
//! a fit moves the model, from the estimate at the last one.

use crate::effects::model::Model;
use crate::fit::engine::{Engine, work};
use crate::plant::initial_state::{self, Estimate, Start};

/// Gauss-Newton steps from rest, and from an estimate at a similar model.
const STEPS_FROM_REST: usize = 3;
const STEPS_NEAR: usize = 2;
/// Smallest step after which another is taken, relative to the full scale.
const SMALL_STEP: f64 = 1e-3;

/// Where Gauss-Newton steps begin.
struct Origin {
    start_v: Vec<f64>,
    kernels: Vec<Vec<f64>>,
    residual: Vec<f64>,
    /// Largest number of steps.
    steps: usize,
    /// The first step before which the kernels are computed anew.
    renewed_from: usize,
}

impl Engine<'_> {
    /// Returns the estimate of a single record at a model; `None` if nothing is unknown.
    pub(super) fn start(&mut self, model: &Model) -> Option<Start> {
        if !self.data.has_nuisances() || self.data.is_joined() {
            return None;
        }
        let observed = self.observed;
        self.start_by(model, |row| observed.is_exact(row))
    }

    /// Returns the same from the rows for which `counts` is true.
    pub(super) fn start_by(&mut self, model: &Model, counts: impl Fn(usize) -> bool) -> Option<Start> {
        let residual = self.residual_from_rest(model);
        let kernels = self.initial_states(model).to_vec();
        let steps = if self.simulator.is_linear_in_start() { 1 } else { STEPS_FROM_REST };
        let from = Origin { start_v: vec![0.0; kernels.len()], kernels, residual, steps, renewed_from: 1 };
        self.approached_start(model, from, counts)
    }

    /// Returns the estimate of a single record at a model near that at a similar one, if that is known.
    pub(super) fn start_near(&mut self, model: &Model, known: Option<&Start>) -> Option<Start> {
        let Some(known) = known.filter(|known| !known.linear) else { return self.start(model) };
        let (start_v, kernels) = (known.start_v.clone(), known.kernels.clone());
        let residual = self.residual_from(model, &start_v);
        let observed = self.observed;
        let from = Origin { start_v, kernels, residual, steps: STEPS_NEAR, renewed_from: 0 };
        self.approached_start(model, from, |row| observed.is_exact(row))
    }

    /// Returns reading minus prediction of each row, in V, with the most likely initial state; to first order around the one at a similar
    /// model, if that is known and the prediction is not linear in it.
    pub(super) fn residual_near(&mut self, model: &Model, known: Option<&Start>) -> Vec<f64> {
        let Some(known) = known.filter(|known| !known.linear) else { return self.residual(model) };
        let mut residual = self.residual_from(model, &known.start_v);
        let exact = |row: usize| self.observed.is_exact(row);
        initial_state::subtract_estimate(&mut residual, &known.kernels, self.data.full_scale_v, exact);
        self.budget.spend(work::INITIAL_STATE * (known.kernels.len() * residual.len()) as u64);
        residual
    }

    /// Takes Gauss-Newton steps as long as they make the error in the rows for which `counts` is true smaller.
    fn approached_start(&mut self, model: &Model, from: Origin, counts: impl Fn(usize) -> bool) -> Option<Start> {
        let Origin { mut start_v, mut kernels, mut residual, steps, renewed_from } = from;
        let reach_v = self.data.full_scale_v;
        let squares = |residual: &[f64]| -> f64 {
            residual.iter().enumerate().filter(|(row, _)| counts(*row)).map(|(_, left)| left * left).sum()
        };
        let linear = self.simulator.is_linear_in_start();
        let mut found: Option<Start> = None;
        for step in 0..steps {
            if step >= renewed_from {
                self.simulator.update_kernels(model, &start_v, &mut kernels);
            }
            let estimate = Estimate::of(&residual, &kernels, reach_v, &counts)?;
            self.budget.spend(work::INITIAL_STATE * (kernels.len() * residual.len()) as u64);
            start_v.iter_mut().zip(&estimate.start_v).for_each(|(start, step)| *start += step);
            let is_small = estimate.start_v.iter().all(|step| step.abs() < SMALL_STEP * reach_v);
            residual = self.residual_from(model, &start_v);
            if found.as_ref().is_some_and(|best| squares(&residual) >= squares(&best.residual)) {
                break;
            }
            let (start_v, residual) = (start_v.clone(), residual.clone());
            found = Some(Start { start_v, estimate, kernels: kernels.clone(), residual, linear });
            if is_small {
                break;
            }
        }
        found
    }

    /// Returns reading minus prediction of each row, in V, from a given initial state.
    pub(super) fn residual_from(&mut self, model: &Model, start_v: &[f64]) -> Vec<f64> {
        self.simulator.run_from(model, start_v, &mut self.predicted);
        self.residual_of_predicted()
    }
}
