//! The equation of a record that no set of causes explains: a hypothesis that changes neither verdict nor causes.

use simulation::record::Record;

use crate::answer::Verdict;
use crate::equation::report::{Rivals, equation};
use crate::examine::options::Options;
use crate::fit::budget::{Budget, Effort};
use crate::nominal::BestLinear;
use crate::record::data::Data;
use crate::record::observed::Observed;
use crate::stats::thresholds::empirical::{LONG_RECORD_ROWS, ROWS_TO_SEARCH};
use crate::verdict::diagnosis::Diagnosis;

/// Adds the best equation to the diagnosis of a record that is `unexplained`, if one predicts better than the extended simulation
/// and the best linear model. It may do the work that the diagnosis has left; none with [`Effort::Quick`]. Of a long record it takes a
/// part of the rows.
pub(super) fn hypothesise(diagnosis: &mut Diagnosis, record: &Record, options: &Options, linear: Option<&BestLinear>) {
    let Some(linear) = linear else { return };
    let rows = diagnosis.data.rows();
    let asked = diagnosis.report.verdict == Verdict::Unexplained && options.effort != Effort::Quick;
    if !asked || options.stop.requested() || linear.held_out.len() != rows || diagnosis.held_out_in_place.len() != rows
    {
        return;
    }
    let every = if rows > LONG_RECORD_ROWS.count() { rows.div_ceil(ROWS_TO_SEARCH.count()) } else { 1 };
    let normalisation = diagnosis.data.normalisation.clone();
    let data = Data::thinned(&normalisation.record(record), options.input, every, &normalisation);
    let observed = match every {
        1 => diagnosis.observed.clone(),
        _ => Observed::new(&data).with_conclusions_of(&diagnosis.observed),
    };
    let normalised = |residual: &[f64]| -> Vec<f64> {
        residual.iter().step_by(every).map(|left| left / normalisation.scales.reading).collect()
    };
    let base = diagnosis.base.clone();
    let rivals = Rivals {
        nominal: base.file(),
        nominal_residual: &normalised(&diagnosis.held_out[0]),
        extended: &normalisation.plant(&diagnosis.plant),
        extended_residual: &normalised(&diagnosis.held_out_in_place),
        poles: &linear.poles,
        linear_residual: &normalised(&linear.held_out),
    };
    let spent = diagnosis.report.search.work;
    let budget = Budget::left(options.effort, rows, spent, data.rows(), options.stop.clone());
    let found = equation(&data, &observed, &rivals, &budget);
    diagnosis.report.complete &= !budget.is_stopped();
    let Some((fit, found)) = found else { return };
    diagnosis.report.equation = Some(found.text.clone());
    diagnosis.report.equation_details = Some(found);
    diagnosis.equation = Some(fit);
}
