//! The probability that an experiment decides.
//!
//! The log-likelihood ratio of a truth against a rival with a separation of `D` nats is normal with mean `D` and variance `2 D`. The
//! experiment decides if it exceeds the odds that the diagnosis asks for, and what the first record said against the truth.

use crate::plan::separation::Pair;
use crate::stats::thresholds::probability::RIVAL_ODDS;

/// Returns the probability that a truth with a separation of `nats` wins against a rival that was `behind` nats behind it, or ahead if
/// negative.
pub(super) fn decides(nats: f64, behind: f64) -> f64 {
    if nats <= 0.0 {
        return 0.0;
    }
    // What the first record said for the truth is not counted twice.
    let z = (nats + behind.clamp(-RIVAL_ODDS, 0.0) - RIVAL_ODDS) / (2.0 * nats).sqrt();
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// Returns the weights of hypotheses from what the first record says for them, in nats: their probabilities, but none that an
/// experiment would ignore.
pub(super) fn weights(nats: &[f64]) -> Vec<f64> {
    let most = nats.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let likelihood: Vec<f64> = nats.iter().map(|nats| (nats - most).max(-RIVAL_ODDS).exp()).collect();
    let sum: f64 = likelihood.iter().sum();
    likelihood.into_iter().map(|likelihood| likelihood / sum).collect()
}

/// Returns the mean over the draws of the truth of the probability that a pair is decided.
pub(super) fn of_pair(pair: &Pair, nats: &[f64]) -> f64 {
    let behind = nats[pair.truth] - nats[pair.rival];
    pair.nats.iter().map(|&separation| decides(separation, behind)).sum::<f64>() / pair.nats.len() as f64
}

/// Returns the probability that the true one of the named hypotheses wins against every other one of them, by the hardest rival of each.
pub(super) fn of_all(pairs: &[Pair], nats: &[f64], named: &[usize]) -> f64 {
    let weights = weights(&named.iter().map(|&index| nats[index]).collect::<Vec<_>>());
    let of_truth = |truth: usize| {
        let own = pairs.iter().filter(|pair| pair.truth == truth && named.contains(&pair.rival));
        own.map(|pair| of_pair(pair, nats)).fold(1.0, f64::min)
    };
    named.iter().zip(weights).map(|(&truth, weight)| weight * of_truth(truth)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probability_grows_with_the_separation_and_falls_with_the_odds_against() {
        let by_nats = [0.0, 1.0, 3.0, 10.0, 30.0, 300.0].map(|nats| decides(nats, 0.0));
        assert!(by_nats.windows(2).all(|pair| pair[0] < pair[1] || pair[1] > 0.999_999), "{by_nats:?}");
        assert!((decides(RIVAL_ODDS, 0.0) - 0.5).abs() < 1e-12 && by_nats[0] == 0.0 && by_nats[5] > 0.999);
        assert!(decides(8.0, -2.0) < decides(8.0, 0.0) && decides(8.0, 5.0) == decides(8.0, 0.0));
    }
}
