//! How well a model foretells stretches that its fit never saw.
//!
//! For each fold, the points are refitted without the fold's rows and judged on those rows alone. The refit is one
//! Newton step from the fit to all rows: the likelihood without a few stretches is nearly the same parabola, moved by
//! what those stretches had pulled. The prediction at the refitted points is a real run of the model.

use super::fit::{Engine, Fit, Jacobian, damped_step, normal_equations};
use super::noise::Term;

/// A judgement on rows that were not seen.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// Log-likelihood of all rows, each unseen by its fit.
    pub log_likelihood: f64,
    /// Readings less prediction for each row, unseen, in V.
    pub residual: Vec<f64>,
}

impl Engine<'_> {
    /// Judges a fit.
    pub fn held_out(&mut self, fit: &Fit) -> HeldOut {
        let data = self.data;
        let Fit { model, residual, noise, .. } = fit;
        let jacobian = self.jacobian(model, noise, residual);
        let terms = self.terms(noise, residual);
        let mut unseen = residual.clone();
        let mut log_likelihood = 0.0;
        let (points, bounds) = (model.points(), model.coordinates(data));
        for fold in 0..data.folds {
            let there = if jacobian.places.is_empty() {
                residual.clone()
            } else {
                let seen: Vec<Term> = terms
                    .iter()
                    .zip(&data.fold)
                    .map(|(term, &of)| Term {
                        weight: if usize::from(of) == fold { 0.0 } else { term.weight },
                        ..*term
                    })
                    .collect();
                let mut moved = points.clone();
                for (place, step) in newton(&jacobian, &seen) {
                    moved[place] = (moved[place] + step).clamp(bounds[place].lowest, bounds[place].highest);
                }
                let mut refitted = model.clone();
                refitted.set_points(&moved);
                self.residual(&refitted)
            };
            let logs = noise.logs(&there, self.observed).zip(&data.fold);
            log_likelihood += logs.filter(|(_, of)| usize::from(**of) == fold).map(|(log, _)| log).sum::<f64>();
            for row in (0..unseen.len()).filter(|&row| usize::from(data.fold[row]) == fold) {
                unseen[row] = there[row];
            }
        }
        HeldOut { log_likelihood: log_likelihood - noise.cost(unseen.len()), residual: unseen }
    }
}

/// The step of each fitted coordinate.
fn newton(jacobian: &Jacobian, terms: &[Term]) -> Vec<(usize, f64)> {
    let (normal, gradient) = normal_equations(jacobian, terms);
    match damped_step(&normal, &gradient, 1e-6) {
        Some(step) => jacobian.places.iter().copied().zip(step.iter().copied()).collect(),
        None => Vec::new(),
    }
}
