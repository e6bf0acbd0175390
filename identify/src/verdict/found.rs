//! The result of a finished search: the best structure, and the others that it is compared with.

use crate::adequacy::{self, Candidate, Unidentifiable, When};
use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::search::{Scored, Search, WarmStart, effects};
use crate::stats::scale::root_mean_square;
use crate::stats::thresholds::empirical::LARGEST_ERROR_RATIO;
use crate::verdict::alternatives::rivals;
use crate::verdict::ranking;

/// A finished search.
pub(crate) struct Found {
    /// The best structure.
    pub(crate) best: Scored,
    /// Each effect of the best structure, in the order of the chain.
    pub(crate) causes: Vec<Cause>,
    /// Sets of causes that the record cannot reject.
    pub(crate) rivals: Vec<Vec<&'static str>>,
    /// Structures to rank, the best first.
    pub(crate) contenders: Vec<Scored>,
    /// From which a search under another reading of the same rows starts.
    pub(crate) warm_start: WarmStart,
}

/// An effect of the best structure.
pub(crate) struct Cause {
    /// Index of the effect.
    pub(crate) effect: usize,
    /// The best of all structures without the effect.
    pub(crate) without: Scored,
    /// The best structure with the effect removed and nothing in its place.
    pub(crate) left_out: Scored,
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
    let observed = engine.observed;
    let mut search = Search::new(engine);
    let mut best = match warm_start {
        None => search.run(progress),
        Some(warm_start) => search.run_from(warm_start, progress),
    };
    search.evaluator().budget().close();
    let [before, after] = [baseline, &best.fit].map(|fit| root_mean_square(&observed.errors(&fit.residual)));
    if after > LARGEST_ERROR_RATIO.get() * before {
        best = search.root();
    }
    let candidate = Candidate { fit: &best.fit, score: best.score };
    if let Some(reason) = adequacy::unidentifiable(search.evaluator(), &candidate, When::AfterSearch) {
        return Err(reason);
    }
    // The rivals before further structures are evaluated for comparison, the contenders after.
    let rivals = rivals(&search, &best);
    let causes = effects(&best.fit.model).into_iter().map(|effect| {
        let left_out = search.left_out(&best, effect);
        Cause { effect, without: search.best_without(effect), left_out }
    });
    let causes = causes.collect();
    let contenders = ranking::contenders(&search, &best);
    Ok(Found { causes, rivals, contenders, warm_start: search.warm_start(), best })
}

impl Found {
    /// The model of the best structure.
    pub(crate) fn model(&self) -> &Model {
        &self.best.fit.model
    }
}
