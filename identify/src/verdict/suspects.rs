//! Suspects: the causes that come closest to a finding where the findings do not explain the record.
//!
//! Each is judged in the best set of causes that contains it: one that the search has evaluated, or the best set extended by it.
//!
//! ```text
//! nats short = score(best set) - score(set with the suspect)
//! ```
//!
//! Held-out segments are no fair judge of a cause that acts in a part of the record only, such as a shifted run of readings: the
//! other segments cannot know it. Its errors before and after are those of single readings instead, each predicted by a fit to all
//! others.

use crate::answer::{Judge, Suspect};
use crate::effects::EFFECTS;
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::parameters;
use crate::search::{Explored, Scored, Search, effects};
use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;
use crate::verdict::ranking::rms;

/// Largest number of suspects that are listed.
const MOST_SUSPECTS: usize = 5;

/// The suspects beside the findings of the set `best`, the closest first: causes whose 95 % interval excludes that they have no
/// effect.
pub(crate) fn suspects(engine: &mut Engine, best: &Scored, explored: Explored) -> Vec<Suspect> {
    let mut search = Search::resumed(engine, explored);
    let mut found: Vec<(Suspect, Fit, usize)> = Vec::new();
    for effect in (0..EFFECTS.len()).filter(|effect| !best.fit.model.has(*effect)) {
        let Some(set) = search.nearest(best, effect) else { continue };
        let without = search.left_out(&set, effect);
        if !is_seen(&without.fit, &set.fit) {
            continue;
        }
        let engine = search.evaluator();
        let judge = if engine.held_out_informs(&set.fit, effect) { Judge::HeldOut } else { Judge::LeaveOneOut };
        let [rmse_before, rmse_after] = [&without, &set].map(|scored| error(engine, &scored.fit, judge));
        let others = effects(&set.fit.model).into_iter().filter(|other| *other != effect);
        let suspect = Suspect {
            cause: EFFECTS[effect].cause(),
            with: others.map(|other| EFFECTS[other].cause()).collect(),
            parameters: Vec::new(),
            rmse_before,
            rmse_after,
            nats_short: (best.score - set.score).max(0.0),
            judge,
        };
        found.push((suspect, set.fit, effect));
    }
    found.sort_by(|(a, ..), (b, ..)| a.nats_short.total_cmp(&b.nats_short));
    found.truncate(MOST_SUSPECTS);
    let with_parameters = |(suspect, fit, effect): (Suspect, Fit, usize)| Suspect {
        parameters: parameters(search.evaluator(), &fit, effect),
        ..suspect
    };
    found.into_iter().map(with_parameters).collect()
}

/// True if a cause raises the likelihood by more than its absence may cost within its 95 % interval; under independent noise at
/// least, since the autocorrelation of the noise may hide what the cause explains.
fn is_seen(without: &Fit, with: &Fit) -> bool {
    let gain = with.log_likelihood - without.log_likelihood;
    gain.max(with.white_noise_log_likelihood - without.white_noise_log_likelihood) > NATS_WITHIN_INTERVAL
}

/// Root mean square error of a fit as a judge measures it, in V.
fn error(engine: &mut Engine, fit: &Fit, judge: Judge) -> f64 {
    let residual = match judge {
        Judge::HeldOut => engine.held_out_residual(fit),
        Judge::LeaveOneOut => engine.leave_one_out_residual(fit),
    };
    rms(engine.observed, &residual)
}
