//! The result of a finished search: the best structure, and the others that it is compared with.

use crate::adequacy::{self, Candidate, Unidentifiable, When};
use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::record::observed::Observed;
use crate::search::{Explored, Scored, Search, WarmStart, effects};
use crate::stats::thresholds::empirical::LARGEST_ERROR_RATIO;
use crate::verdict::alternatives::rivals;
use crate::verdict::cause::Cause;
use crate::verdict::fewer_lags::with_fewer_lags;
use crate::verdict::ranking;

/// Ratio of the held-out errors up to which the relaxation stays as it was identified.
const AS_GOOD: f64 = 1.02;

/// A finished search.
pub(crate) struct Found {
    /// The best structure.
    pub(crate) best: Scored,
    /// Each effect of the best structure, in the order of the chain.
    pub(crate) causes: Vec<Cause>,
    /// Sets of causes that the record cannot reject.
    pub(crate) rivals: Vec<Vec<&'static str>>,
    /// What is known of the readings without the outliers of the best structure.
    pub(crate) regular: Observed,
    /// Structures to rank, the best first.
    pub(crate) contenders: Vec<Scored>,
    /// From which a search under another reading of the same rows starts.
    pub(crate) warm_start: WarmStart,
    /// All that the search has evaluated.
    pub(crate) explored: Explored,
}

/// Searches for causes, from a warm start if there is one.
///
/// # Errors
/// The reason why the record identifies no spring.
pub(crate) fn search(
    engine: &mut Engine,
    baseline: &Fit,
    warm_start: Option<WarmStart>,
    progress: impl FnMut(&Scored),
) -> Result<Found, Unidentifiable> {
    let unsearched = Candidate::unpriced(baseline);
    if let Some(reason) = adequacy::unidentifiable(engine, &unsearched, When::BeforeSearch) {
        return Err(reason);
    }
    let mut search = Search::new(engine);
    let mut best = match warm_start {
        None => search.run(progress),
        Some(warm_start) => search.run_from(warm_start, progress),
    };
    search.evaluator().budget().close();
    let regular = adequacy::without_outliers(search.evaluator(), &best.fit);
    let error = |residual: &[f64]| regular.rms(residual);
    let most = LARGEST_ERROR_RATIO.get() * error(&baseline.residual);
    let is_larger = |fit: &Fit| error(&fit.residual) > most;
    let held_out = |engine: &mut Engine, fit: &Fit| error(&engine.held_out_residual(fit));
    if is_larger(&best.fit) || search.evaluator().budget().was_cut() {
        best = search.predicting(best, is_larger, held_out);
    }
    // An identified spring is the best without causes, stays as it is if the causes need no other, and causes under which it predicts
    // worse, or which are less likely than none, are none.
    if search.evaluator().data.normalisation.identified {
        let root = search.root();
        let engine = search.evaluator();
        let as_identified = engine.fit_twice(Model { relaxation: Vec::new(), ..best.fit.model.clone() });
        // No other segment tells where a cause that acts in a part of the record begins.
        let in_place = |engine: &mut Engine, fit: &Fit| error(&engine.held_out_residual_in_place(fit));
        let mut predicted = in_place(engine, &best.fit);
        let kept = in_place(engine, &as_identified);
        if kept <= AS_GOOD * predicted {
            (best.fit, predicted) = (as_identified, kept);
        }
        let is_unlikely = best.score < root.score;
        if best.fit.model.blocks.is_empty() || predicted > error(&baseline.residual) || is_unlikely {
            best = Scored { fit: baseline.clone(), ..root };
        }
    }
    let candidate = Candidate { fit: &best.fit, score: best.score };
    if let Some(reason) = adequacy::unidentifiable(search.evaluator(), &candidate, When::AfterSearch) {
        return Err(reason);
    }
    let (rivals, effects, left_out) = loop {
        // The rivals before further structures are evaluated for comparison, the contenders after.
        let rivals = rivals(&search, &best);
        let effects = effects(&best.fit.model);
        let left_out: Vec<Scored> = effects.iter().map(|&effect| search.left_out(&best, effect)).collect();
        // A search that was cut off has not compared all of them with the best. An effect that nothing needs would hide another one.
        let as_likely = left_out.iter().filter(|without| without.score >= best.score && effects.len() > 1);
        let likeliest = as_likely.max_by(|a, b| a.score.total_cmp(&b.score)).cloned();
        let error = |engine: &mut Engine, of: &Scored| held_out(engine, &of.fit);
        let Some(without) = likeliest
            .filter(|without| error(search.evaluator(), without) <= AS_GOOD * error(search.evaluator(), &best))
        else {
            break (rivals, effects, left_out);
        };
        best = without;
    };
    // The best without a cause is chosen after all were evaluated, so that sentence and ranking name the same.
    let cause = |(effect, left_out)| {
        let without = search.best_without(effect);
        let odds = search.compared(&best) - search.compared(&without);
        Cause { effect, without, odds, left_out }
    };
    let causes: Vec<Cause> = effects.into_iter().zip(left_out).map(cause).collect();
    let contenders = ranking::contenders(&search, &causes);
    // Last: what the causes are compared with keeps all lags.
    best.fit = with_fewer_lags(search.evaluator(), best.fit, held_out);
    let regular = adequacy::without_outliers(search.evaluator(), &best.fit);
    Ok(Found {
        causes,
        regular,
        rivals,
        contenders,
        warm_start: search.warm_start(),
        best,
        explored: search.into_explored(),
    })
}

impl Found {
    /// Adds sets of causes that were evaluated after the search to the contenders.
    pub(crate) fn add_contenders(&mut self, sets: Vec<Scored>) {
        for set in sets {
            if !self.contenders.iter().any(|known| effects(&known.fit.model) == effects(&set.fit.model)) {
                self.contenders.push(set);
            }
        }
        self.contenders.sort_by(|a, b| b.score.total_cmp(&a.score));
    }

    /// The model of the best structure.
    pub(crate) fn model(&self) -> &Model {
        &self.best.fit.model
    }
}
