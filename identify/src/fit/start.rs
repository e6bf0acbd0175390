//! What is estimated for each model instead of being moved by a fit: the initial state, and zero and gain of the reading under a
//! nominal spring that was identified from the same readings.

use crate::effects::model::Model;
use crate::fit::engine::{Engine, work};
use crate::plant::initial_state::Estimate;
use crate::record::observed::Kind;

/// Gauss-Newton steps to an initial state in which the prediction is not linear; the last has the kernels of the one before.
const STEPS: usize = 3;
/// Smallest step after which another is taken, relative to the full scale.
const SMALL_STEP: f64 = 1e-3;

/// The estimate at a model, of a single record.
pub(super) struct Start {
    /// Offset of each kernel's state, in V.
    pub(super) start_v: Vec<f64>,
    /// How it follows a change of the residual.
    pub(super) estimate: Estimate,
    /// Change of the prediction at each row for each state that is 1 V higher.
    pub(super) kernels: Vec<Vec<f64>>,
    /// Reading minus prediction from there, in V.
    pub(super) residual: Vec<f64>,
}

impl Engine<'_> {
    /// Returns the estimate of a single record at a model; `None` if nothing is unknown.
    pub(super) fn start(&mut self, model: &Model) -> Option<Start> {
        if !self.data.has_nuisances() || self.data.is_joined() {
            return None;
        }
        let observed = self.observed;
        self.start_by(model, |row| observed.kinds[row] == Kind::Exact)
    }

    /// Returns the same from the rows for which `counts` is true. Where the prediction is not linear, Gauss-Newton steps are taken as long
    /// as they make the error smaller.
    pub(super) fn start_by(&mut self, model: &Model, counts: impl Fn(usize) -> bool) -> Option<Start> {
        let mut residual = self.residual_from_rest(model);
        let mut kernels = self.initial_states(model).to_vec();
        let reach_v = self.data.full_scale_v;
        let steps = if self.simulator.is_linear_in_start() { 1 } else { STEPS };
        let squares = |residual: &[f64]| -> f64 {
            residual.iter().enumerate().filter(|(row, _)| counts(*row)).map(|(_, left)| left * left).sum()
        };
        let mut start_v = vec![0.0; kernels.len()];
        let mut found: Option<Start> = None;
        for step in 0..steps {
            if step == 1 {
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
            let kernels = kernels.clone();
            found = Some(Start { start_v: start_v.clone(), estimate, kernels, residual: residual.clone() });
            if is_small {
                break;
            }
        }
        found
    }

    /// Returns zero, in V, and gain of the reading relative to those of the nominal spring at a model, if that was identified from the
    /// same readings.
    pub fn reading_map(&mut self, model: &Model) -> Option<[f64; 2]> {
        let full_scale_v = self.data.full_scale_v;
        let start = self.start(model).filter(|_| self.data.normalisation.identified)?;
        let &[.., zero_v, gain_v] = start.start_v.as_slice() else { return None };
        Some([zero_v, 1.0 + gain_v / full_scale_v]).filter(|[zero_v, gain]| zero_v.is_finite() && gain.is_normal())
    }

    /// Returns reading minus prediction of each row, in V, from a given initial state.
    pub(super) fn residual_from(&mut self, model: &Model, start_v: &[f64]) -> Vec<f64> {
        self.simulator.run_from(model, start_v, &mut self.predicted);
        self.residual_of_predicted()
    }
}
