//! Errors of a linear model on segments that its fit did not use.
//!
//! A single record is divided into the folds of the diagnosis. To predict a fold, the whole model is refitted with the fold's rows at
//! [`LEAST_INFORMATION`] of their weight: what the other rows know decides, and what only the fold can tell, such as the state in
//! which it starts, is taken from there. On a long record the refit is one Gauss-Newton step. With orthonormal derivatives `Q` at the
//! fit to all rows, the rows `F` of the fold, and their weight `w`, its residual is
//!
//! ```text
//! r_F - Q_F d,      (I - (1 - w) Q_F' Q_F) d = -(1 - w) Q_F' r_F
//! ```
//!
//! Of several records, each whole record is held out: poles, delay, gain and numerator come from the others, zero and start from the
//! record itself.

use nalgebra::{DMatrix, DVector};

use crate::linear::columns::Column;
use crate::linear::problem::{Fit, Problem};
use crate::stats::thresholds::empirical::LEAST_INFORMATION;

/// Records with more readings are held out by one step instead of a refit.
const ROWS_TO_REFIT: usize = 5_000;
/// Most steps of a refit, and the relative reduction of the cost below which it ends.
const STEPS: (usize, f64) = (6, 1e-6);

/// Returns reading minus prediction of each row by a fit without the row's fold. `fit` is linearised.
pub fn held_out_residual(problem: &Problem, fit: &Fit) -> Vec<f64> {
    if problem.series.len() > 1 || problem.rows() > ROWS_TO_REFIT {
        by_step(problem, fit)
    } else {
        by_refit(problem, fit)
    }
}

pub(super) fn by_refit(problem: &Problem, fit: &Fit) -> Vec<f64> {
    let mut left = fit.residual.clone();
    let fold = &problem.series[0].fold;
    for of in 0..=fold.iter().copied().max().unwrap_or(0) {
        let others = problem.with_less(LEAST_INFORMATION.get(), |row| fold[row] == of);
        let there = problem.residual(&others.refined(fit.poles.clone(), STEPS.0, STEPS.1));
        (0..left.len()).filter(|&row| fold[row] == of).for_each(|row| left[row] = there[row]);
    }
    left
}

pub(super) fn by_step(problem: &Problem, fit: &Fit) -> Vec<f64> {
    let several = problem.series.len() > 1;
    // Of several records, zero, its shifts and start come from the held-out record itself; all other columns are orthogonal to theirs.
    let first = if several { problem.columns_of_records(fit.poles.order()) } else { 0 };
    let columns: Vec<&Column> = fit.basis.q[first..].iter().filter(|column| !column.values.is_empty()).collect();
    let kept = 1.0 - LEAST_INFORMATION.get();
    let mut left = fit.residual.clone();
    for rows in folds(problem) {
        let part = DMatrix::from_fn(rows.len(), columns.len(), |row, column| {
            let Column { first, values } = columns[column];
            rows[row].checked_sub(*first).and_then(|row| values.get(row)).copied().unwrap_or(0.0)
        });
        let here = DVector::from_fn(rows.len(), |row, _| fit.residual[rows[row]]);
        let information = DMatrix::identity(columns.len(), columns.len()) - kept * part.tr_mul(&part);
        let Some(cholesky) = information.cholesky() else { continue };
        let step = cholesky.solve(&(-kept * part.tr_mul(&here)));
        let predicted = here - part * step;
        rows.iter().zip(predicted.iter()).for_each(|(&row, value)| left[row] = *value);
    }
    left
}

/// The rows of each fold.
fn folds(problem: &Problem) -> Vec<Vec<usize>> {
    let (starts, series) = (problem.starts(), &problem.series);
    if series.len() > 1 {
        return starts.iter().zip(series).map(|(&start, series)| (start..start + series.rows()).collect()).collect();
    }
    let fold = &series[0].fold;
    let last = fold.iter().copied().max().unwrap_or(0);
    (0..=last).map(|of| (0..fold.len()).filter(|&row| fold[row] == of).collect()).collect()
}
