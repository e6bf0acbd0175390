//! Prediction of each reading by a fit to all others: a fair judge of causes that act on a part of the record, of which other
//! parts hold no information.
//!
//! As in [`held_out`](crate::fit::held_out), the fit without a reading is one Newton step from the fit to all of them. With the
//! whitened derivatives `x`, the weight `w` and the whitened residual `e` of the row,
//!
//! ```text
//! step = -N^-1 x w e / (1 - h),      N = J' W J,      h = w x' N^-1 x      (leverage)
//! ```
//!
//! Coordinates that only a search finds, such as the ends of a shifted run, stay where all readings place them.

use nalgebra::DVector;

use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::normal_equations;
use crate::noise::Noise;

/// Largest leverage of a reading; one that alone decides a coordinate would be infinitely far from its prediction.
const MOST_LEVERAGE: f64 = 0.999;
/// Information that is added to each coordinate, relative to what all readings hold, so that two equivalent coordinates have
/// a solution.
const RIDGE: f64 = 1e-9;

impl Engine<'_> {
    /// Returns reading minus prediction of each row, in V, by a fit without the row.
    pub fn leave_one_out_residual(&mut self, fit: &Fit) -> Vec<f64> {
        let (whitened, terms) = self.linearised(fit);
        let plain = self.jacobian(&fit.model, &Noise::default_robust(), &fit.residual);
        let (mut normal, _) = normal_equations(&whitened, &terms);
        for place in 0..normal.nrows() {
            normal[(place, place)] += (RIDGE * normal[(place, place)]).max(f64::MIN_POSITIVE);
        }
        let mut left = fit.residual.clone();
        let Some(cholesky) = normal.cholesky() else { return left };
        let row_of =
            |columns: &[Vec<f64>], row: usize| DVector::from_iterator(columns.len(), columns.iter().map(|of| of[row]));
        for (row, term) in terms.iter().enumerate() {
            let own = row_of(&whitened.columns, row);
            let direction = cholesky.solve(&own);
            let leverage = (term.weight * own.dot(&direction)).clamp(0.0, MOST_LEVERAGE);
            let step = direction * (term.weight * term.residual / (1.0 - leverage));
            left[row] += row_of(&plain.columns, row).dot(&step);
        }
        left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// The gain of 60 readings at one voltage, each of which is left out once: the fit without it is made anew.
    #[test]
    fn prediction_of_a_reading_is_that_of_a_fit_without_it() {
        let noise = normals(60);
        let reading = |row: usize| 105.0 + 3.0 * noise[row];
        let row = |row: usize, measured| Row { line: row, time_s: row as f64, voltage_v: 100.0, measured };
        let fitted = |without: Option<usize>| {
            let measured = |at: usize| (Some(at) != without).then(|| reading(at));
            let record = Record { name: String::new(), rows: (0..60).map(|at| row(at, measured(at))).collect() };
            let data = Data { initial_state_unknown: false, ..Data::new(&record, Input::Hold) };
            let (observed, base) = (Observed::new(&data), Base::paper());
            let mut engine = Engine::new(&data, &observed, &base);
            let block = Block { effect: index_of("gain-error").unwrap(), form: 0 };
            let fit = engine.fit_twice(Model::default().with(block, vec![1.0]));
            (engine.leave_one_out_residual(&fit), fit)
        };
        let (one_out, fit) = fitted(None);
        for row in [0, 3, 40, 59] {
            let (_, without) = fitted(Some(row));
            let gain = without.model.points()[0] / fit.model.points()[0];
            let expected = reading(row) - gain * (reading(row) - fit.residual[row]);
            let moved = (expected - fit.residual[row]).abs();
            assert!(
                (one_out[row] - expected).abs() < 0.05 * moved,
                "{} {expected} {}",
                one_out[row],
                fit.residual[row]
            );
        }
    }
}
