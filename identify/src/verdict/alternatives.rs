//! Sets of causes that a record cannot reject, and the experiment that would decide between them.

use crate::adequacy::Unidentifiable;
use crate::answer::{Finding, Verdict};
use crate::effects::effect::Location;
use crate::effects::{EFFECTS, contains, index_of};
use crate::record::data::Data;
use crate::search::{Evaluator, Scored, Search, effects};
use crate::stats::thresholds::empirical::REVERSAL_OF_FULL_SCALE;
use crate::stats::thresholds::probability::RIVAL_ODDS;

/// The experiment that separates errors of the spring from those of the readings.
const REPEAT: &str = "run the same schedule again: errors that repeat belong to the spring, the others to the readings";
/// Words that follow an experiment which can be computed.
const PLAN: &str = "; `vsj plan DIAGNOSIS.json` computes the schedule that shows most";
/// Largest number of rivals that are listed.
const MOST_RIVALS: usize = 3;

/// Sets of causes with nearly the best score. Left out are supersets of the best set, and sets in which a cause that contains
/// one of the best's as a special case replaces it: they fit as well whatever the truth is.
pub(crate) fn rivals<E: Evaluator>(search: &Search<E>, best: &Scored) -> Vec<Vec<&'static str>> {
    let own = effects(&best.fit.model);
    search
        .near(best, RIVAL_ODDS)
        .into_iter()
        .map(|other| effects(&other.fit.model))
        .filter(|set| !own.iter().all(|effect| set.iter().any(|other| other == effect || contains(*other, *effect))))
        .take(MOST_RIVALS)
        .map(|set| set.into_iter().map(|effect| EFFECTS[effect].cause()).collect())
        .collect()
}

/// The findings with hysteresis and static nonlinearity exchanged, which a monotone voltage cannot distinguish; `None` if
/// neither was found.
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

/// True if the voltage is monotone, up to changes of [`REVERSAL_OF_FULL_SCALE`].
pub(crate) fn never_reverses(data: &Data) -> bool {
    let mut extremes = (f64::MAX, f64::MIN);
    let (mut falls, mut rises) = (false, false);
    let slack = REVERSAL_OF_FULL_SCALE.get() * data.full_scale_v;
    for &voltage in &data.voltage_v {
        falls |= voltage < extremes.1 - slack;
        rises |= voltage > extremes.0 + slack;
        extremes = (extremes.0.min(voltage), extremes.1.max(voltage));
    }
    !(falls && rises)
}

/// The report's sentence on the experiment that would decide or show more; `None` if none is needed. `wanders` says that the
/// noise's autocorrelation predicts nearly all of the residual.
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
            let effect = EFFECTS[index_of(cause)?];
            // No voltage decides on a cause of the readings alone.
            let computed = if effect.location() == Location::Reading { "" } else { PLAN };
            Some(format!("run {}{computed}", effect.isolating_experiment()))
        }
        Verdict::Consistent if !wanders => None,
        Verdict::Consistent => Some(REPEAT.to_owned()),
        Verdict::Unexplained => Some(format!("{REPEAT}{PLAN}")),
        Verdict::Insufficient => Some(format!("{}{PLAN}", Unidentifiable::Excitation.next_experiment())),
        Verdict::Explained => None,
    }
}
