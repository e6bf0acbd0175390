//! The relaxation of an identified spring under its causes, without the lags and oscillations that only imitated them.
//!
//! A linear model of high order imitates what is not linear. With the cause in the model such a lag has next to no weight, so that its
//! time constant is arbitrary, and with it how far the record has settled.

use crate::effects::identified;
use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::nominal::WORTHWHILE;

/// Removes lags and oscillations of the relaxation as long as the held-out error, which `held_out` returns, stays within what a larger
/// model is worth, also if the search has done all of its work: they are few fits, of the model that is reported. Without causes, and
/// where it is not fitted, the relaxation stays as it is.
pub(super) fn with_fewer_lags(engine: &mut Engine, mut fit: Fit, held_out: impl Fn(&mut Engine, &Fit) -> f64) -> Fit {
    let mut least = None;
    while !fit.model.blocks.is_empty() && !engine.budget().is_stopped() {
        let without = identified::without_each(&engine.base().relaxation, &fit.model.relaxation);
        let refit = |relaxation| engine.fit_twice(Model { relaxation, ..fit.model.clone() });
        let fits = without.into_iter().map(refit).collect::<Vec<_>>().into_iter();
        let Some(smaller) = fits.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)) else { break };
        let before: f64 = *least.get_or_insert_with(|| held_out(engine, &fit));
        let after = held_out(engine, &smaller);
        if engine.budget().is_stopped() || after * (1.0 - WORTHWHILE) > before {
            break;
        }
        least = Some(before.min(after));
        fit = smaller;
    }
    fit
}
