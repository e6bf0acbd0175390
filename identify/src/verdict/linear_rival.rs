//! Whether a linear model predicts held-out segments better than the extended simulation.
//!
//! A linear model has its own zero and free responses, which follow slow noise that no simulation knows. So a cubic of the time is
//! removed from both errors before they are compared, segment by segment ([`segments`](crate::stats::segments)).

use nalgebra::{DMatrix, DVector};

use crate::answer::Verdict;
use crate::dimension::Dimension;
use crate::nominal::BestLinear;
use crate::record::observed::Kind;
use crate::stats::scale::root_mean_square;
use crate::stats::segments::{SEGMENTS, is_worse};
use crate::stats::thresholds::empirical::{FINEST_V, WORSE_THAN_LINEAR};
use crate::verdict::credibility;
use crate::verdict::diagnosis::Diagnosis;

/// Error of a reading by the linear model, relative to that by the simulation, below which the reading is no outlier.
const CLOSER: f64 = 0.5;
/// Coefficients of the cubic.
const COEFFICIENTS: usize = 4;

/// Adds the best linear model to a diagnosis, which explains nothing if that predicts better.
pub(crate) fn compare(diagnosis: &mut Diagnosis, linear: Option<&BestLinear>) {
    let Some(linear) = linear else { return };
    let report = &mut diagnosis.report;
    report.linear = Some(linear.error);
    let judged = matches!(report.verdict, Verdict::Explained | Verdict::Consistent | Verdict::Ambiguous);
    let (ours, theirs) = (&diagnosis.held_out_in_place, &linear.held_out);
    if !judged || ours.len() != theirs.len() || ours.len() < SEGMENTS {
        return;
    }
    let kinds = diagnosis.observed.kinds.iter().zip(&diagnosis.regular.kinds);
    let pairs = kinds.zip(ours.iter().zip(theirs)).map(|((observed, regular), (ours, theirs))| {
        if judges(*observed, *regular, *ours, *theirs) { (*ours, *theirs) } else { (0.0, 0.0) }
    });
    let (ours, theirs): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let [ours_less, theirs_less] = [&ours, &theirs].map(|errors| without_cubic(errors, &diagnosis.data.time_s));
    let finest = diagnosis.data.scales().restored(Dimension::ReadingSize, FINEST_V.get());
    if root_mean_square(&ours) <= finest || !is_worse(&ours_less, &theirs_less, WORSE_THAN_LINEAR.get()) {
        return;
    }
    let shown = |errors: &[f64]| {
        diagnosis.data.normalisation.scales.four_digits(Dimension::ReadingSize, root_mean_square(errors))
    };
    let beyond = root_mean_square(&ours).powi(2) - root_mean_square(&theirs).powi(2);
    credibility::in_unexplained(&mut report.findings, beyond);
    report.leftover = Some(format!(
        "A linear model of order {} predicts held-out segments better than this simulation, with an error of {} instead of {}",
        linear.error.order,
        shown(&theirs),
        shown(&ours)
    ));
    diagnosis.conclude(Verdict::Unexplained);
}

/// True if a reading, known as `observed` and, where outliers say nothing, as `regular`, judges between the errors of both models. At a
/// bound of the sensor, or known up to an interval, it says little about either; an outlier says nothing, unless the linear model predicts
/// it much better.
fn judges(observed: Kind, regular: Kind, ours: f64, theirs: f64) -> bool {
    observed == Kind::Exact && (regular == Kind::Exact || theirs.abs() < CLOSER * ours.abs())
}

/// Errors less their best cubic of the time.
fn without_cubic(errors: &[f64], time_s: &[f64]) -> Vec<f64> {
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    let scale = (last - first).max(f64::MIN_POSITIVE);
    let powers = DMatrix::from_fn(errors.len(), COEFFICIENTS, |row, power| {
        (2.0 * (time_s[row] - first) / scale - 1.0).powi(power as i32)
    });
    let errors = DVector::from_row_slice(errors);
    let Some(factor) = powers.tr_mul(&powers).cholesky() else { return errors.as_slice().to_vec() };
    let cubic = &powers * factor.solve(&powers.tr_mul(&errors));
    (errors - cubic).as_slice().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    const ROWS: usize = 2000;

    fn time_s() -> Vec<f64> {
        (0..ROWS).map(|row| 0.1 * row as f64).collect()
    }

    /// True if errors of `times` the noise, with a sine of an amplitude over the whole record, are worse than the noise.
    fn worse(times: f64, slow: f64) -> bool {
        let noise = normals(2 * ROWS);
        let swing = |row: usize| slow * (2.0 * row as f64 / ROWS as f64).sin();
        let ours: Vec<f64> = (0..ROWS).map(|row| times * noise[row] + swing(row)).collect();
        let [ours, theirs] = [&ours, &noise[ROWS..].to_vec()].map(|errors| without_cubic(errors, &time_s()));
        is_worse(&ours, &theirs, WORSE_THAN_LINEAR.get())
    }

    #[test]
    fn an_outlier_judges_only_if_the_linear_model_predicts_it() {
        let ignored = Kind::Within(f64::NEG_INFINITY, f64::INFINITY);
        let outlier = |theirs: f64| judges(Kind::Exact, ignored, 30.0, theirs);
        assert!(outlier(1.0) && !outlier(29.0) && !outlier(-40.0));
        assert!(judges(Kind::Exact, Kind::Exact, 30.0, 29.0) && !judges(Kind::AtLeast, Kind::AtLeast, 30.0, 1.0));
    }

    #[test]
    fn a_larger_error_is_worse_beyond_chance_and_margin() {
        assert!(worse(1.2, 0.0) && !worse(1.0, 0.0) && !worse(1.03, 0.0));
    }

    /// The free responses of a linear model follow slow noise.
    #[test]
    fn slow_noise_does_not_make_a_linear_model_better() {
        assert!(!worse(1.0, 2.0));
    }
}
