//! The search for the best candidate: all schedules of the library, then random changes of the best, kept if they are better.

use std::collections::BTreeMap;

use crate::plan::candidate::Candidate;
use crate::plan::library::{Random, changed};
use crate::plan::separation::{Design, Evaluation};

/// Separation in nats beyond which a pair is decided almost surely, so that more of it counts little.
const DECIDED_NATS: f64 = 30.0;
/// Weight of separation beyond that, of the mean over the pairs, and of the breadth.
const BEYOND: f64 = 0.1;
const MEAN: f64 = 0.2;
const BREADTH: f64 = 0.3;
/// Candidates of the library that are changed, the changes of each, and those of the best of them.
const STARTS: usize = 4;
const CHANGES_OF_EACH: usize = 100;
const CHANGES_OF_BEST: usize = 200;

/// Returns the value of an evaluation; the larger, the better.
pub(super) fn objective(evaluation: &Evaluation) -> f64 {
    let value = |nats: f64| {
        let log = nats.max(1e-3).ln();
        log.min(DECIDED_NATS.ln()) + BEYOND * (log - DECIDED_NATS.ln()).max(0.0)
    };
    let of_pair: Vec<f64> = evaluation
        .pairs
        .iter()
        .map(|pair| pair.nats.iter().map(|&nats| value(nats)).sum::<f64>() / pair.nats.len() as f64)
        .collect();
    let breadth = BREADTH * evaluation.breadth;
    if of_pair.is_empty() {
        return breadth;
    }
    // A set that the diagnosis does not name may differ from a named one by a cause of no size, which nothing shows. The hardest rival
    // of each truth counts, so that a truth that no schedule confirms does not hide the others.
    let mut hardest = BTreeMap::new();
    for (pair, &value) in evaluation.pairs.iter().zip(&of_pair).filter(|(pair, _)| pair.named) {
        let least = hardest.entry(pair.truth).or_insert(value);
        *least = value.min(*least);
    }
    let of_truths = hardest.values().sum::<f64>() / hardest.len().max(1) as f64;
    of_truths + MEAN * of_pair.iter().sum::<f64>() / of_pair.len() as f64 + breadth
}

/// Returns the best candidate that is found.
pub(super) fn best(design: &Design, library: Vec<Candidate>, random: &mut Random) -> Candidate {
    let value = |candidate: &Candidate| objective(&design.evaluate(&candidate.commands(&design.frame), false));
    let mut ranked: Vec<(f64, Candidate)> = library.into_iter().map(|it| (value(&it), it)).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.truncate(STARTS);
    let climb = |mut best: (f64, Candidate), changes: usize, random: &mut Random| {
        for _ in 0..changes {
            let next = changed(&best.1, random);
            let there = value(&next);
            if there > best.0 {
                best = (there, next);
            }
        }
        best
    };
    let climbed = ranked.into_iter().map(|start| climb(start, CHANGES_OF_EACH, random));
    let climbed: Vec<(f64, Candidate)> = climbed.collect();
    let best = climbed.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("the library is not empty");
    climb(best, CHANGES_OF_BEST, random).1
}
