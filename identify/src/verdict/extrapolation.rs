//! Which causes extrapolate: fitted to the first 60 % of a record, do they predict the rest better than the model without them?
//!
//! Held-out segments are interleaved with those that a fit has seen, so that a drift or a slow relaxation is only interpolated there.

use crate::answer::Finding;
use crate::dimension::Dimension;
use crate::effects::EFFECTS;
use crate::fit::engine::{Engine, Fit};
use crate::record::scales::Scales;
use crate::stats::scale::root_mean_square;
use crate::stats::segments::is_worse;
use crate::stats::thresholds::empirical::WORSE_THAN_WITHOUT;
use crate::verdict::found::Found;

/// Part of the rows to which a cause is fitted.
const FIRST_PART: f64 = 0.6;

/// A cause with which the rest of the record is predicted worse than without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spoils {
    pub(crate) cause: &'static str,
    /// Root mean square errors on the rest of the record, with the cause and without it, in V.
    errors: [f64; 2],
}

/// The causes that spoil the prediction of the last 40 % of a record; of several records, whole ones are held out anyway.
pub(crate) fn spoiling(engine: &mut Engine, found: &Found) -> Vec<Spoils> {
    if engine.data.is_joined() {
        return Vec::new();
    }
    let rows = (FIRST_PART * engine.data.rows() as f64).round() as usize;
    let mut rest = |fit: &Fit| engine.extrapolation_residual(fit, &found.regular, rows);
    let with = rest(&found.best.fit);
    let others = found.causes.iter().map(|cause| (EFFECTS[cause.effect].cause(), rest(&cause.left_out.fit)));
    others
        .filter(|(_, without)| is_worse(&with, without, WORSE_THAN_WITHOUT.get()))
        .map(|(cause, without)| Spoils { cause, errors: [root_mean_square(&with), root_mean_square(&without)] })
        .collect()
}

impl Spoils {
    /// The report's sentence on what the simulation leaves.
    pub(crate) fn sentence(&self, scales: &Scales) -> String {
        let [with, without] = self.errors.map(|error| scales.shown_in_four_digits(Dimension::ReadingSize, error));
        format!(
            "Fitted to the first 60 % of the record, the simulation predicts the rest worse with {} than without it, {with} \
             instead of {without}",
            self.cause
        )
    }

    /// True if a finding is this cause.
    pub(crate) fn is(&self, finding: &Finding) -> bool {
        finding.cause == self.cause
    }
}
