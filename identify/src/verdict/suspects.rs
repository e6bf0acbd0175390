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
use crate::effects::{EFFECTS, contains};
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::parameters;
use crate::record::observed::Observed;
use crate::search::{Explored, Scored, Search, effects};
use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;

/// Largest number of suspects that are listed.
const MOST_SUSPECTS: usize = 5;
/// Share of the work that is left for fits that no search has made, the rest for errors and intervals.
const SHARE_OF_FITS: f64 = 0.4;

/// The suspects beside the findings of the set `best`, the closest first, each with its set: causes whose 95 % interval excludes
/// that they have no effect. Their errors are those of the `regular` readings. Sets that the search has evaluated are used; the best set
/// extended by each other effect is fitted once, as far as the work allows. `may` says which causes are considered.
pub(crate) fn suspects(
    engine: &mut Engine,
    best: &Scored,
    regular: &Observed,
    explored: Explored,
    may: impl Fn(&'static str) -> bool,
) -> Vec<(Suspect, Scored)> {
    let budget = engine.budget();
    let mut search = Search::resumed(engine, explored);
    let mut sets: Vec<(usize, Scored)> = Vec::new();
    budget.grant(SHARE_OF_FITS);
    let own = effects(&best.fit.model);
    let is_found = |effect: usize| own.iter().any(|&other| other == effect || contains(other, effect));
    for effect in (0..EFFECTS.len()).filter(|effect| !is_found(*effect) && may(EFFECTS[*effect].cause())) {
        if !budget.is_over() {
            search.evaluate_extension(best, effect);
        }
        sets.extend(search.best_with(effect).map(|set| (effect, set)));
    }
    budget.grant(1.0);
    sets.sort_by(|(_, a), (_, b)| b.score.total_cmp(&a.score));
    let mut suspects = Vec::new();
    for (effect, set) in sets {
        if suspects.len() == MOST_SUSPECTS || budget.is_over() {
            break;
        }
        suspects.extend(suspect(&mut search, best, regular, effect, &set).map(|suspect| (suspect, set)));
    }
    suspects
}

/// Reports an effect as a suspect in a set of causes; `None` if it explains too little.
fn suspect(
    search: &mut Search<Engine>,
    best: &Scored,
    regular: &Observed,
    effect: usize,
    set: &Scored,
) -> Option<Suspect> {
    let without = search.left_out(set, effect);
    if !is_seen(&without.fit, &set.fit) {
        return None;
    }
    let engine = search.evaluator();
    let informs = engine.held_out_informs(&set.fit, effect);
    // Of held-out segments or of single readings.
    let residual = if informs { Engine::held_out_residual } else { Engine::leave_one_out_residual };
    let [rmse_before, rmse_after] = [&without, set].map(|scored| regular.rms(&residual(engine, &scored.fit)));
    let others = effects(&set.fit.model).into_iter().filter(|other| *other != effect);
    Some(Suspect {
        cause: EFFECTS[effect].cause(),
        with: others.map(|other| EFFECTS[other].cause()).collect(),
        parameters: parameters(engine, &set.fit, effect),
        rmse_before,
        rmse_after,
        nats_short: (best.score - set.score).max(0.0),
        judge: if informs { Judge::HeldOut } else { Judge::LeaveOneOut },
        probability: None,
    })
}

/// True if a cause raises the likelihood by more than its absence may cost within its 95 % interval; under independent noise at
/// least, since the autocorrelation of the noise may hide what the cause explains.
fn is_seen(without: &Fit, with: &Fit) -> bool {
    let gain = with.log_likelihood - without.log_likelihood;
    gain.max(with.white_noise_log_likelihood - without.white_noise_log_likelihood) > NATS_WITHIN_INTERVAL
}
