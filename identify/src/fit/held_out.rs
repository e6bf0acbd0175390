//! How well a model foretells stretches that its fit never saw.
//!
//! For each fold, the points are refitted without the fold's rows and judged on those rows alone. The refit is one
//! Newton step from the fit to all rows: the likelihood without a few stretches is nearly the same parabola, moved by
//! what those stretches had pulled. The prediction at the refitted points is a real run of the model. A block of which
//! the other stretches tell nothing is not there: nobody who has not seen the stretch could know of it. The choice of
//! blocks has seen all rows: the clean split, learnt from the first 60 % and judged on the rest, is `cargo campaign rivals`.
//!
//! What only a search can place, a run of shifted readings, may lie within one stretch, which no other stretch foretells.
//! So there are two judgements. [`Engine::held_out_log_likelihood`] chooses between structures: it leaves such a run where all rows
//! have put it, and the price of the block pays for the places that were looked at. [`Engine::held_out_residual`] is what is
//! reported as error on unseen stretches: it searches the run anew in the rows that are seen.

use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::{Jacobian, damped_step, normal_equations};
use crate::noise::Term;

/// A coordinate of which the seen rows hold less than this part of all information is not known.
const KNOWN: f64 = 0.01;

impl Engine<'_> {
    /// Log-likelihood of all rows, each unseen by its fit, places apart.
    pub fn held_out_log_likelihood(&mut self, fit: &Fit) -> f64 {
        let whole = FullFit::new(self, fit);
        let mut log_likelihood = 0.0;
        for fold in 0..self.data.folds {
            let model = whole.refitted(self, fold);
            let there = if model == fit.model { fit.residual.clone() } else { self.residual(&model) };
            let logs = fit.noise.row_log_likelihoods(&there, self.observed).zip(&self.data.fold);
            log_likelihood += logs.filter(|(_, of)| usize::from(**of) == fold).map(|(log, _)| log).sum::<f64>();
        }
        log_likelihood - fit.cost()
    }

    /// Readings less prediction for each row, in V, by a fit that has not seen the row.
    pub fn held_out_residual(&mut self, fit: &Fit) -> Vec<f64> {
        let whole = FullFit::new(self, fit);
        let data = self.data;
        let mut unseen = fit.residual.clone();
        for fold in 0..data.folds {
            let of_fold = |row: usize| usize::from(data.fold[row]) == fold;
            let model = whole.refitted(self, fold);
            let model = self.refine_searched(model, |row| !of_fold(row));
            let there = self.residual(&model);
            (0..unseen.len()).filter(|&row| of_fold(row)).for_each(|row| unseen[row] = there[row]);
        }
        unseen
    }
}

/// A fit to all rows, ready to be refitted to some.
struct FullFit<'f> {
    fit: &'f Fit,
    jacobian: Jacobian,
    terms: Vec<Term>,
    /// What all rows know of each column.
    known: Vec<f64>,
}

impl<'f> FullFit<'f> {
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
            block.searched() || places.iter().any(|place| own.contains(place))
        });
        model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::Block;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::data::{Data, Input};
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 800;
    const GAIN: f64 = 1.1;
    const FOLD: usize = 2;

    /// A stair up and down, read from a spring of another gain with this error, in V, of a row and its noise of 1 V.
    fn data(error: impl Fn(usize, f64) -> f64) -> Data {
        let volts = |row: usize| 100.0 * (5 - (row / 80).abs_diff(5)) as f64;
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: volts(row), measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..ROWS).map(row).collect() };
        let mut data = Data::new(&record, Input::Hold);
        let mut readings = Vec::new();
        Simulator::new(&data, &Base::paper()).run(&of("gain-error", vec![GAIN]), &mut readings);
        let errors = normals(ROWS).into_iter().enumerate().map(|(row, noise)| error(row, noise));
        data.reading = readings.into_iter().zip(errors).map(|(reading, error)| reading + error).collect();
        data
    }

    fn of(cause: &str, point: Vec<f64>) -> Model {
        Model::default().with(Block { effect: index_of(cause).unwrap(), form: 0 }, point)
    }

    fn unseen(data: &Data, row: usize) -> bool {
        usize::from(data.fold[row]) == FOLD
    }

    /// The gain that all rows want, the gain that the rows outside of the fold want, and what is foretold of the fold.
    fn gains(data: &Data) -> (f64, f64, Vec<f64>) {
        let (base, observed) = (Base::paper(), Observed::new(data));
        let mut engine = Engine::new(data, &observed, &base);
        let fit = engine.fit_twice(of("gain-error", vec![1.0]));
        let refitted = FullFit::new(&mut engine, &fit).refitted(&engine, FOLD);
        let left = engine.held_out_residual(&fit);
        let rows = (0..ROWS).filter(|&row| unseen(data, row));
        (fit.model.points()[0], refitted.points()[0], rows.map(|row| data.reading[row] - left[row]).collect())
    }

    /// As much noise in the fold, all of it on the one side and on the other.
    #[test]
    fn a_stretch_is_foretold_without_its_own_readings() {
        let shape = data(|_, noise| noise);
        let to_side = |side: f64| data(|row, noise| if unseen(&shape, row) { side * noise.abs() } else { noise });
        let (seen_before, before, foretold_before) = gains(&to_side(1.0));
        let (seen_after, after, foretold_after) = gains(&to_side(-1.0));
        let (seen_moved, moved) = ((seen_after - seen_before).abs(), (after - before).abs());
        assert!(seen_moved > 1e-5 && moved < 0.02 * seen_moved, "{moved} {seen_moved}");
        let apart = foretold_before.iter().zip(&foretold_after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 0.02 * 500.0 * seen_moved, "{apart} V {seen_moved}");
    }

    #[test]
    fn a_run_is_searched_in_rows_that_are_seen() {
        let shifted = |row: usize, noise: f64| noise + if (500..640).contains(&row) { 9.0 } else { 0.0 };
        let white_noise_log_likelihood = data(shifted);
        let wild = data(|row, noise| if unseen(&white_noise_log_likelihood, row) { 1e3 } else { shifted(row, noise) });
        let places = [&white_noise_log_likelihood, &wild].map(|data| {
            let (base, observed) = (Base::paper(), Observed::new(data));
            let mut engine = Engine::new(data, &observed, &base);
            let run = Block { effect: index_of("reading-offset").unwrap(), form: 0 };
            let model = of("gain-error", vec![GAIN]).with(run, vec![0.0; 3]);
            engine.refine_searched(model, |row| !unseen(data, row)).points()
        });
        assert_eq!(places[0], places[1]);
        // The run ends where a stretch that is not seen begins.
        assert!((480.0..=520.0).contains(&places[0][1]) && (620.0..=660.0).contains(&places[0][2]), "{places:?}");
    }
}
