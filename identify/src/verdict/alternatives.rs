//! Other explanations that a record leaves open, and the experiment that would decide.

use crate::adequacy::informative::Silent;
use crate::answer::{Finding, Verdict};
use crate::effects::{EFFECTS, contains, index_of};
use crate::record::data::Data;
use crate::search::{Judge, Scored, Search, effects};

/// Odds under which a rival set counts as possible, in nats.
pub(crate) const RIVAL: f64 = 3.0;
/// Rivals that are listed.
const MOST_RIVALS: usize = 3;

/// Sets of causes that are nearly as good, without being the best with more: with more causes, or with one that contains
/// the best's and so fits as well whatever the truth is.
pub(crate) fn rivals<J: Judge>(search: &Search<J>, best: &Scored) -> Vec<Vec<&'static str>> {
    let own = effects(&best.fit.model);
    search
        .ranked()
        .into_iter()
        .take_while(|other| other.score > best.score - RIVAL)
        .map(|other| effects(&other.fit.model))
        .filter(|set| !own.iter().all(|effect| set.iter().any(|other| other == effect || contains(*other, *effect))))
        .take(MOST_RIVALS)
        .map(|set| set.into_iter().map(|effect| EFFECTS[effect].cause()).collect())
        .collect()
}

/// On a record that only rises (or falls), memory and a law without memory are one.
pub(crate) fn twin(findings: &[Finding]) -> Option<Vec<&'static str>> {
    let swapped = |cause| match cause {
        "static-nonlinearity" => Some("hysteresis"),
        "hysteresis" => Some("static-nonlinearity"),
        _ => None,
    };
    let causes: Vec<&'static str> = findings.iter().map(|finding| finding.cause).collect();
    causes
        .iter()
        .any(|cause| swapped(*cause).is_some())
        .then(|| causes.iter().map(|&cause| swapped(cause).unwrap_or(cause)).collect())
}

/// True if the voltage never turns back by more than a fiftieth of its range.
pub(crate) fn never_reverses(data: &Data) -> bool {
    let mut extremes = (f64::MAX, f64::MIN);
    let (mut falls, mut rises) = (false, false);
    let slack = 0.02 * data.full_scale_v;
    for &voltage in &data.voltage_v {
        falls |= voltage < extremes.1 - slack;
        rises |= voltage > extremes.0 + slack;
        extremes = (extremes.0.min(voltage), extremes.1.max(voltage));
    }
    !(falls && rises)
}

pub(crate) fn next_experiment(
    verdict: Verdict,
    findings: &[Finding],
    alternatives: &[Vec<&'static str>],
    wanders: bool,
) -> Option<String> {
    match verdict {
        Verdict::Ambiguous => {
            let named: Vec<&str> = findings.iter().map(|finding| finding.cause).collect();
            let rival = alternatives.iter().flatten().find(|cause| !named.contains(cause));
            let ours = named.iter().find(|cause| !alternatives.iter().all(|set| set.contains(cause)));
            let cause = rival.or(ours)?;
            let experiment = EFFECTS[index_of(cause)?].isolating_experiment();
            Some(format!("run {experiment}"))
        }
        Verdict::Consistent if !wanders => None,
        Verdict::Unexplained | Verdict::Consistent => Some(
            "run the same schedule again: what comes back is the spring's, what does not is the readings'".to_owned(),
        ),
        Verdict::Insufficient => Some(Silent::Excitation.next_experiment().to_owned()),
        Verdict::Explained => None,
    }
}
