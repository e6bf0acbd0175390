//! Suspects of a diagnosis that explains nothing: what it says for and against each, and what an experiment is predicted to show.
//!
//! A suspect is judged in its set of causes, one of the rivals. The odds today are those of the diagnosis:
//!
//! ```text
//! ln(odds) = -nats_short                  a suspect beside the best set
//! ln(odds) = ln(p / (1 - p))              a cause of the best set with a probability p below 0.5
//! ```

use crate::hypotheses::Rival;
use crate::plan::answer::Suspected;
use crate::plan::odds;
use crate::plan::request::{Basis, Suspect};
use crate::plan::separation::{Design, Evaluation};

/// Verdict of a diagnosis whose suspects are decided between.
pub(super) const UNEXPLAINED: &str = "unexplained";

impl Suspect {
    /// Returns the logarithm of the odds that the diagnosis gives the suspect, in nats.
    fn nats(&self) -> f64 {
        let of_probability = |p: f64| (p.max(f64::MIN_POSITIVE) / (1.0 - p).max(f64::MIN_POSITIVE)).ln();
        self.probability.map_or(-self.nats_short, of_probability)
    }

    /// Returns true if a set of causes is the one in which the suspect is judged.
    fn is_of(&self, causes: &[String]) -> bool {
        let others = |cause: &String| *cause == self.cause || self.with.contains(cause);
        causes.contains(&self.cause) && causes.len() == self.with.len() + 1 && causes.iter().all(others)
    }
}

/// Returns the suspects that a plan decides between.
pub(super) fn asked(basis: &Basis) -> &[Suspect] {
    if basis.verdict == UNEXPLAINED { &basis.suspects } else { &[] }
}

/// Returns the rivals with what the diagnosis says for them, in nats against the best set, the likeliest first: by their scores, and
/// where the best set has a cause that is probably none, by the odds of the likeliest rival without it.
pub(super) fn weighed(basis: &Basis) -> Vec<Rival> {
    let mut rivals = basis.rivals.clone();
    for suspect in asked(basis).iter().filter(|suspect| suspect.probability.is_some()) {
        let without = rivals.iter_mut().filter(|rival| !rival.causes.contains(&suspect.cause));
        if let Some(likeliest) = without.max_by(|a, b| a.nats.total_cmp(&b.nats)) {
            likeliest.nats = likeliest.nats.max(-suspect.nats());
        }
    }
    if basis.verdict == UNEXPLAINED {
        rivals.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    }
    rivals
}

/// Returns what an experiment is predicted to show of each suspect; a cause of one record's readings, which no voltage shows, is left
/// out.
pub(super) fn suspected(basis: &Basis, design: &Design, evaluation: &Evaluation) -> Vec<Suspected> {
    let nats: Vec<f64> = design.hypotheses.iter().map(|hypothesis| hypothesis.nats).collect();
    let of_suspect = |suspect: &Suspect| {
        // Findings in the readings alone, which are in no set, may stand beside a cause of the best set.
        let best = suspect.probability.and(basis.rivals.first());
        let set = best.or_else(|| basis.rivals.iter().find(|rival| suspect.is_of(&rival.causes)))?;
        let truth = design.hypotheses.iter().position(|hypothesis| hypothesis.causes == set.causes)?;
        let against = |rival: usize| !design.hypotheses[rival].claims(&suspect.cause);
        let pairs = evaluation.pairs.iter().filter(|pair| pair.truth == truth && against(pair.rival));
        let by_probability = pairs.map(|pair| (odds::of_pair(pair, &nats), pair.rival));
        let (probability, rival) = by_probability.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Suspected {
            cause: suspect.cause.clone(),
            causes: set.causes.clone(),
            nats: suspect.nats(),
            probability,
            rival: design.hypotheses[rival].causes.clone(),
        })
    };
    asked(basis).iter().filter_map(of_suspect).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rival(causes: &[&str], nats: f64) -> Rival {
        let causes = causes.iter().map(|&cause| cause.to_owned()).collect();
        Rival { causes, nats, parameters: Default::default(), blocks: Vec::new(), covariance: Vec::new() }
    }

    fn basis(verdict: &str, probability: Option<f64>) -> Basis {
        let suspect = Suspect { cause: "drift".into(), with: vec!["hysteresis".into()], nats_short: 0.0, probability };
        let rivals = vec![
            rival(&["hysteresis", "drift"], 0.0),
            rival(&["hysteresis", "delay"], -9.0),
            rival(&["hysteresis"], -6.0),
            rival(&["drift"], -7.0),
        ];
        Basis {
            schema: 1,
            verdict: verdict.into(),
            alternatives: Vec::new(),
            rivals,
            suspects: vec![suspect],
            experiment: None,
        }
    }

    #[test]
    fn odds_of_a_cause_that_is_probably_none_count_for_the_best_set_without_it() {
        let weighed = weighed(&basis(UNEXPLAINED, Some(0.2)));
        let nats: Vec<f64> = weighed.iter().map(|rival| rival.nats).collect();
        assert_eq!(weighed[0].causes, ["hysteresis"]);
        assert!((nats[0] - 4f64.ln()).abs() < 1e-12 && nats[1..] == [0.0, -7.0, -9.0], "{nats:?}");
    }

    #[test]
    fn scores_count_without_a_probability_and_in_other_verdicts() {
        for basis in [basis(UNEXPLAINED, None), basis("ambiguous", Some(0.2))] {
            let mut nats: Vec<f64> = weighed(&basis).iter().map(|rival| rival.nats).collect();
            nats.sort_by(f64::total_cmp);
            assert_eq!(nats, [-9.0, -7.0, -6.0, 0.0]);
        }
        assert!(asked(&basis("ambiguous", None)).is_empty());
    }

    #[test]
    fn a_set_is_that_of_a_suspect_in_any_order() {
        let suspect = &basis(UNEXPLAINED, None).suspects[0];
        let set = |causes: &[&str]| suspect.is_of(&rival(causes, 0.0).causes);
        assert!(set(&["drift", "hysteresis"]) && set(&["hysteresis", "drift"]));
        assert!(!set(&["drift"]) && !set(&["hysteresis", "delay"]) && !set(&["hysteresis", "drift", "delay"]));
    }
}
