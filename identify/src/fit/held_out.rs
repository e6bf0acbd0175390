//! Cross-validation: how well a model predicts segments that its fit did not use.
//!
//! For each fold, the points are fitted without the fold's rows, and the prediction is compared with those rows. That
//! fit is one Newton step from the fit to all rows: without a few segments the log-likelihood is nearly the same
//! parabola, shifted by the gradient of those segments. The prediction is a simulation at the new points. The relaxation of a
//! nominal spring that was identified stays as all rows place it, like that spring itself. A block about
//! which the other segments hold no information is removed, because it could not be known without the fold. The choice
//! of blocks has used all rows; `cargo campaign rivals` learns it from the first 60 % of the record and evaluates it on
//! the rest.
//!
//! A run of shifted readings, which only a search finds, may lie within one segment, and no other segment predicts it.
//! So there are two measures. [`Engine::held_out_log_likelihood`] compares structures: it leaves such a run where all
//! rows place it, and the cost of the block accounts for the number of candidates. [`Engine::held_out_residual`] is
//! reported as the held-out error: it searches the run in the rows outside the fold.

use std::iter;

use crate::effects::model::{Block, Model};
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::{Jacobian, bounded_step, normal_equations};
use crate::noise::Term;
use crate::record::observed::Observed;
use crate::stats::scale::root_mean_square;
use crate::stats::thresholds::empirical::LEAST_INFORMATION;

impl Engine<'_> {
    /// Returns the log-likelihood of all rows, each predicted by a fit without its fold, minus the cost of the fit, in
    /// nats; searched coordinates stay.
    pub fn held_out_log_likelihood(&mut self, fit: &Fit) -> f64 {
        let whole = FullFit::new(self, fit);
        let mut log_likelihood = 0.0;
        for fold in 0..self.data.folds {
            let model = whole.refitted(self, |row| usize::from(self.data.fold[row]) != fold);
            let there = if model == fit.model { fit.residual.clone() } else { self.residual(&model) };
            let of_fold = |row: usize| usize::from(self.data.fold[row]) == fold;
            log_likelihood += fit.noise.log_likelihood_where(&there, self.observed, of_fold);
        }
        log_likelihood - fit.cost()
    }

    /// Returns true if the rows outside of every fold hold information on an effect of the fit, so that held-out segments can judge
    /// it.
    pub fn held_out_informs(&mut self, fit: &Fit, effect: usize) -> bool {
        let whole = FullFit::new(self, fit);
        let without = |fold| whole.refitted(self, |row| usize::from(self.data.fold[row]) != fold);
        !fit.model.searched(effect) && (0..self.data.folds).all(|fold| without(fold).has(effect))
    }

    /// Returns reading minus prediction of each row, in V, by a fit without the row's fold.
    pub fn held_out_residual(&mut self, fit: &Fit) -> Vec<f64> {
        self.held_out(fit, true)
    }

    /// Returns the same with searched coordinates where all rows place them: no other segment tells where readings are shifted.
    pub fn held_out_residual_in_place(&mut self, fit: &Fit) -> Vec<f64> {
        self.held_out(fit, false)
    }

    fn held_out(&mut self, fit: &Fit, searches: bool) -> Vec<f64> {
        let searches = searches && fit.model.blocks.iter().any(|(block, _)| block.searched());
        if let Some(known) = self.known_held_out.residual(&fit.model, &fit.noise, searches) {
            return known;
        }
        let unseen = self.fitted_without_each_fold(fit, searches);
        self.known_held_out.keep(&fit.model, &fit.noise, searches, &unseen);
        unseen
    }

    fn fitted_without_each_fold(&mut self, fit: &Fit, searches: bool) -> Vec<f64> {
        let whole = FullFit::new(self, fit);
        let data = self.data;
        let mut unseen = fit.residual.clone();
        for fold in 0..data.folds {
            let of_fold = |row: usize| usize::from(data.fold[row]) == fold;
            let mut model = whole.refitted(self, |row| !of_fold(row));
            if searches {
                model = self.refine_searched(model, |row| !of_fold(row));
            }
            let there = self.residual(&model);
            (0..unseen.len()).filter(|&row| of_fold(row)).for_each(|row| unseen[row] = there[row]);
        }
        unseen
    }

    /// Returns the errors of the rows from `rows` on, in V, by a fit to the rows before; searched coordinates stay, and a reading counts
    /// as far as `judged` knows it: at a bound only where the prediction is within it.
    pub fn extrapolation_residual(&mut self, fit: &Fit, judged: &Observed, rows: usize) -> Vec<f64> {
        let mut before = fit.clone();
        for _ in 0..EXTRAPOLATION_STEPS {
            let model = FullFit::new(self, &before).refitted(self, |row| row < rows);
            let residual = self.residual(&model);
            // A step that the rows before do not confirm is beyond the linearisation.
            let error = |residual: &[f64]| root_mean_square(&judged.errors(residual)[..rows]);
            let is_better = error(&residual) <= error(&before.residual);
            if !is_better || model == before.model {
                break;
            }
            before = Fit { model, residual, ..before };
        }
        judged.errors(&before.residual)[rows..].to_vec()
    }
}

/// Newton steps of a fit to the first rows.
const EXTRAPOLATION_STEPS: usize = 3;

/// A fit to all rows, prepared for fits without one fold.
struct FullFit<'f> {
    fit: &'f Fit,
    jacobian: Jacobian,
    terms: Vec<Term>,
    /// Information of all rows on each column: the diagonal of `J' W J`.
    known: Vec<f64>,
}

impl<'f> FullFit<'f> {
    fn new(engine: &mut Engine, fit: &'f Fit) -> Self {
        let (jacobian, terms) = engine.linearised_by_blocks(fit);
        let (normal, _) = normal_equations(&jacobian, &terms);
        Self { fit, jacobian, terms, known: normal.diagonal().iter().copied().collect() }
    }

    /// Returns the model fitted to the rows that `sees` selects.
    fn refitted(&self, engine: &Engine, sees: impl Fn(usize) -> bool) -> Model {
        let data = engine.data;
        let seen: Vec<Term> = self
            .terms
            .iter()
            .enumerate()
            .map(|(row, term)| Term { weight: if sees(row) { term.weight } else { 0.0 }, ..*term })
            .collect();
        let (normal, gradient) = normal_equations(&self.jacobian, &seen);
        let knows = |column: &usize| normal[(*column, *column)] > LEAST_INFORMATION.get() * self.known[*column];
        let columns: Vec<usize> = (0..self.known.len()).filter(knows).collect();
        let (normal, gradient) =
            (normal.select_columns(&columns).select_rows(&columns), gradient.select_rows(&columns));

        let places: Vec<usize> = columns.iter().map(|&column| self.jacobian.places[column]).collect();
        let (mut points, bounds) = (self.fit.model.points(), self.fit.model.coordinates(data));
        let owners: Vec<&Block> =
            self.fit.model.blocks.iter().flat_map(|(block, point)| iter::repeat_n(block, point.len())).collect();
        // A part of a row's delay and of a share are the same to the readings, so that a share follows a delay that ends at its bound.
        // Elsewhere a structure that only its bounds keep in place is not to gain from them.
        let range = |&place: &usize| match owners[place].cause() {
            "delay" => [bounds[place].lowest, bounds[place].highest].map(|end| end - points[place]),
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        };
        let ranges: Vec<[f64; 2]> = places.iter().map(range).collect();
        if let Some(step) = bounded_step(&normal, &gradient, &ranges, 1e-6) {
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
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 800;
    const GAIN: f64 = 1.1;
    const FOLD: usize = 2;

    /// Returns a record of a stair up and down, read from a spring with a gain of [`GAIN`], with the given error of
    /// each row, in V, as a function of row and unit noise.
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

    /// Returns the gain fitted to all rows, the gain fitted to the rows outside the fold, and the prediction of the
    /// fold, in V.
    fn gains(data: &Data) -> (f64, f64, Vec<f64>) {
        let (base, observed) = (Base::paper(), Observed::new(data));
        let mut engine = Engine::new(data, &observed, &base);
        let fit = engine.fit_twice(of("gain-error", vec![1.0]));
        let refitted = FullFit::new(&mut engine, &fit).refitted(&engine, |row| !unseen(data, row));
        let left = engine.held_out_residual(&fit);
        let rows = (0..ROWS).filter(|&row| unseen(data, row));
        (fit.model.points()[0], refitted.points()[0], rows.map(|row| data.reading[row] - left[row]).collect())
    }

    /// The noise of the fold has the same size, but is positive in one record and negative in the other.
    #[test]
    fn held_out_prediction_is_independent_of_the_fold() {
        let shape = data(|_, noise| noise);
        let to_side = |side: f64| data(|row, noise| if unseen(&shape, row) { side * noise.abs() } else { noise });
        let (seen_before, before, foretold_before) = gains(&to_side(1.0));
        let (seen_after, after, foretold_after) = gains(&to_side(-1.0));
        let (seen_moved, moved) = ((seen_after - seen_before).abs(), (after - before).abs());
        assert!(seen_moved > 1e-5 && moved < 0.02 * seen_moved, "{moved} {seen_moved}");
        let apart = foretold_before.iter().zip(&foretold_after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 0.02 * 500.0 * seen_moved, "{apart} V {seen_moved}");
    }

    /// The gain falls back to 1 where the first rows end; fitted to all rows it would be in between.
    #[test]
    fn an_extrapolation_knows_the_first_rows_only() {
        let rows = 480;
        let falls = |row: usize, noise: f64| noise - if row < rows { 0.0 } else { 1e3 };
        let (data, base) = (data(falls), Base::paper());
        let observed = Observed::new(&data);
        let mut engine = Engine::new(&data, &observed, &base);
        let [with, without] = [of("gain-error", vec![1.0]), Model::default()].map(|model| engine.fit_twice(model));
        let [with, without] = [with, without].map(|fit| engine.extrapolation_residual(&fit, engine.observed, rows));
        assert_eq!((with.len(), without.len()), (ROWS - rows, ROWS - rows));
        // With a gain of 1.1 the prediction is 1000 V too high, and by up to 50 V less without it.
        let mean = |left: &[f64]| left.iter().sum::<f64>() / left.len() as f64;
        assert!(
            (mean(&with) + 1e3).abs() < 3.0 && mean(&without) > mean(&with) + 10.0,
            "{} {}",
            mean(&with),
            mean(&without)
        );
    }

    #[test]
    fn run_is_searched_in_rows_outside_the_fold() {
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
        // The run ends where an excluded segment begins.
        assert!((480.0..=520.0).contains(&places[0][1]) && (620.0..=660.0).contains(&places[0][2]), "{places:?}");
    }
}
