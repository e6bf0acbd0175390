//! Which causes extrapolate: fitted to 60 % of a record, its beginning or its end, do they predict the rest better than the model
//! without them? Those that do not are taken out of the extended simulation.
//!
//! Held-out segments are interleaved with those that a fit has seen, so that a drift or a slow relaxation is only interpolated there,
//! and a cause that follows the error of an unknown law from segment to segment is not found out.

use std::ops::Range;

use crate::dimension::Dimension;
use crate::effects::EFFECTS;
use crate::fit::engine::Engine;
use crate::record::scales::Scales;
use crate::search::{Scored, Search, effects};
use crate::stats::scale::root_mean_square;
use crate::stats::segments::is_worse;
use crate::stats::thresholds::empirical::WORSE_THAN_WITHOUT;

/// Part of the rows to which a cause is fitted.
const FITTED_PART: f64 = 0.6;

/// A cause with which the rest of the record is predicted worse than without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spoils {
    pub(crate) cause: &'static str,
    /// True if the rest is the record's beginning.
    backwards: bool,
    /// Root mean square errors on the rest of the record, with the cause and without it, in V.
    errors: [f64; 2],
}

/// Takes the causes out of the best structure of a search that spoil the prediction of the rest of a record, the worst first; returns
/// the structure that is left, and these causes. Of several records, whole ones are held out anyway.
pub(crate) fn without_spoiling(search: &mut Search<Engine>, mut best: Scored) -> (Scored, Vec<Spoils>) {
    let mut taken_out = Vec::new();
    if search.evaluator().data.is_joined() {
        return (best, taken_out);
    }
    while let Some((spoils, without)) = worst(search, &best) {
        taken_out.push(spoils);
        best = without;
    }
    (best, taken_out)
}

/// The cause of a structure that spoils most, with the structure without it.
fn worst(search: &mut Search<Engine>, best: &Scored) -> Option<(Spoils, Scored)> {
    let rows = search.evaluator().data.rows();
    let part = (FITTED_PART * rows as f64).round() as usize;
    let sides: [Range<usize>; 2] = [0..part, rows - part..rows];
    let with = sides.clone().map(|side| search.evaluator().extrapolation_residual(&best.fit, &side));
    let mut spoiling = Vec::new();
    for effect in effects(&best.fit.model) {
        let left_out = search.left_out(best, effect);
        for (with, side) in with.iter().zip(&sides) {
            let without = search.evaluator().extrapolation_residual(&left_out.fit, side);
            if is_worse(with, &without, WORSE_THAN_WITHOUT.get()) {
                let errors = [root_mean_square(with), root_mean_square(&without)];
                let spoils = Spoils { cause: EFFECTS[effect].cause(), backwards: side.start > 0, errors };
                spoiling.push((spoils, left_out.clone()));
            }
        }
    }
    spoiling.into_iter().max_by(|(a, _), (b, _)| a.ratio().total_cmp(&b.ratio()))
}

impl Spoils {
    /// Error with the cause relative to that without it.
    fn ratio(&self) -> f64 {
        self.errors[0] / self.errors[1]
    }

    /// The report's sentence on what the simulation leaves.
    pub(crate) fn sentence(&self, scales: &Scales) -> String {
        let [with, without] = self.errors.map(|error| scales.shown(Dimension::ReadingSize, error, 3));
        let side = if self.backwards { "last" } else { "first" };
        format!(
            "Fitted to the {side} 60 % of the record, the simulation predicts the rest worse with {} than without it, {with} \
             instead of {without}",
            self.cause
        )
    }
}
