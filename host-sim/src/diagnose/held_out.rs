//! How well a model foretells stretches that its fit never saw.
//!
//! For each fold, the points are refitted without the fold's rows and judged on those rows alone. The refit is one
//! Newton step from the fit to all rows: the likelihood without a few stretches is nearly the same parabola, moved by
//! what those stretches had pulled. The prediction at the refitted points is a real run of the model. A block of which
//! the other stretches tell nothing is not there: nobody who has not seen the stretch could know of it.
//!
//! What only a search can place, a run of shifted readings, may lie within one stretch, which no other stretch foretells.
//! So there are two judgements. [`Engine::judged_unseen`] chooses between structures: it leaves such a run where all rows
//! have put it, and the price of the block pays for the places that were looked at. [`Engine::foretold`] is what is
//! reported as error on unseen stretches: it searches the run anew in the rows that are seen.

use super::effect::Scene;
use super::fit::{Engine, Fit, Jacobian, damped_step, normal_equations};
use super::model::Model;
use super::noise::{Term, scale};

/// A coordinate of which the seen rows hold less than this part of all information is not known.
const KNOWN: f64 = 0.01;

impl Engine<'_> {
    /// Log-likelihood of all rows, each unseen by its fit, places apart.
    pub fn judged_unseen(&mut self, fit: &Fit) -> f64 {
        let whole = Whole::new(self, fit);
        let mut log_likelihood = 0.0;
        for fold in 0..self.data.folds {
            let model = whole.refitted(self, fold);
            let there = if model == fit.model { fit.residual.clone() } else { self.residual(&model) };
            let logs = fit.noise.logs(&there, self.observed).zip(&self.data.fold);
            log_likelihood += logs.filter(|(_, of)| usize::from(**of) == fold).map(|(log, _)| log).sum::<f64>();
        }
        log_likelihood - fit.noise.cost(fit.residual.len())
    }

    /// Readings less prediction for each row, in V, by a fit that has not seen the row.
    pub fn foretold(&mut self, fit: &Fit) -> Vec<f64> {
        let whole = Whole::new(self, fit);
        let mut unseen = fit.residual.clone();
        for fold in 0..self.data.folds {
            let mut model = whole.refitted(self, fold);
            self.search_places(&mut model, fold);
            let there = self.residual(&model);
            for row in (0..unseen.len()).filter(|&row| usize::from(self.data.fold[row]) == fold) {
                unseen[row] = there[row];
            }
        }
        unseen
    }

    /// Finds anew, without a fold's rows, what only a search can place.
    fn search_places(&mut self, model: &mut Model, fold: usize) {
        for index in 0..model.blocks.len() {
            let block = model.blocks[index].0;
            if !block.searched(self.data) {
                continue;
            }
            let mut residual = self.residual(&model.without(block.effect));
            let seen = |row: usize| usize::from(self.data.fold[row]) != fold;
            let errors: Vec<f64> = (0..residual.len()).filter(|&row| seen(row)).map(|row| residual[row]).collect();
            (0..residual.len()).filter(|&row| !seen(row)).for_each(|row| residual[row] = f64::NAN);
            let scene = Scene { data: self.data, residual: &residual, sigma: scale(&errors) };
            block.effect().polish(block.form, &mut model.blocks[index].1, &scene);
        }
    }
}

/// A fit to all rows, ready to be refitted to some.
struct Whole<'f> {
    fit: &'f Fit,
    jacobian: Jacobian,
    terms: Vec<Term>,
    /// What all rows know of each column.
    known: Vec<f64>,
}

impl<'f> Whole<'f> {
    fn new(engine: &mut Engine, fit: &'f Fit) -> Self {
        let jacobian = engine.jacobian(&fit.model, &fit.noise, &fit.residual);
        let terms = engine.terms(&fit.noise, &fit.residual);
        let (normal, _) = normal_equations(&jacobian, &terms);
        Self { fit, jacobian, terms, known: normal.diagonal().iter().copied().collect() }
    }

    /// The model as the rows outside of a fold want it.
    fn refitted(&self, engine: &Engine, fold: usize) -> Model {
        let data = engine.data;
        let unseen = |of: u8| usize::from(of) == fold;
        let seen: Vec<Term> = self
            .terms
            .iter()
            .zip(&data.fold)
            .map(|(term, &of)| Term { weight: if unseen(of) { 0.0 } else { term.weight }, ..*term })
            .collect();
        let (normal, gradient) = normal_equations(&self.jacobian, &seen);
        let knows = |column: &usize| normal[(*column, *column)] > KNOWN * self.known[*column];
        let columns: Vec<usize> = (0..self.known.len()).filter(knows).collect();
        let (normal, gradient) =
            (normal.select_columns(&columns).select_rows(&columns), gradient.select_rows(&columns));

        let places: Vec<usize> = columns.iter().map(|&column| self.jacobian.places[column]).collect();
        let (mut points, bounds) = (self.fit.model.points(), self.fit.model.coordinates(data));
        if let Some(step) = damped_step(&normal, &gradient, 1e-6) {
            for (&place, step) in places.iter().zip(step.iter()) {
                points[place] = (points[place] + step).clamp(bounds[place].lowest, bounds[place].highest);
            }
        }
        let mut model = self.fit.model.clone();
        model.set_points(&points);
        let mut first = 0;
        model.blocks.retain(|(block, point)| {
            let own = first..first + point.len();
            first = own.end;
            block.searched(data) || places.iter().any(|place| own.contains(place))
        });
        model
    }
}
