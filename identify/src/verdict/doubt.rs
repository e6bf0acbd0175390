//! Why findings do not explain a record, and how likely they still are.

use crate::adequacy::{self, UnmodelledDynamics};
use crate::answer::Finding;
use crate::dimension::Dimension;
use crate::fit::engine::{Engine, Fit};
use crate::record::scales::Scales;
use crate::stats::scale::variance;
use crate::stats::thresholds::empirical::SHARE_UNEXPLAINED;
use crate::verdict::credibility;
use crate::verdict::extrapolation::spoiling;
use crate::verdict::found::Found;
use crate::verdict::unconfirmed;

/// The sentence on a search that its budget ended.
const UNFINISHED: &str = "The search ended before it had tried all that it would, and the residual may hold structure: a larger effort may find more";

/// The sentence on causes that remove little of an autocorrelated error.
pub(crate) const UNEARNED: &str =
    "The residual is autocorrelated, slow noise or an error of the simulation, and no cause removes much of it";

/// The sentence on linear dynamics that an identified spring lacks.
const LACKING: &str = "Further linear dynamics explain part of the error, but the nominal spring was identified from these readings: they are part of it, or take the place of a cause that no model describes";

/// The sentence on readings that are shifted to more levels than are looked for.
const ENDLESS: &str =
    "The error steps more often than a shift of the readings does: it may follow a law that no cause describes";

/// Lowers the probabilities of findings by what speaks against them, and returns the first reason why they do not explain the record, in
/// one sentence; `None` if they do. `unmodelled` is the first structure that the residual shows.
pub(crate) fn weigh(
    engine: &mut Engine,
    found: &Found,
    unmodelled: Option<&UnmodelledDynamics>,
    findings: &mut [Finding],
) -> Option<String> {
    let (data, extended) = (engine.data, &found.best.fit);
    let (scales, of_record) = (data.scales(), &data.normalisation);
    let structure = unmodelled.filter(|found| found.share > SHARE_UNEXPLAINED.get());
    let spoiling = spoiling(engine, found);
    let is_unfinished = engine.budget().was_cut() && adequacy::doubts(engine, extended);
    let in_residual = structure
        .map(|found| sentence(found, extended, scales))
        .or_else(|| spoiling.first().map(|spoils| spoils.sentence(scales)))
        .or_else(|| is_unfinished.then(|| UNFINISHED.to_owned()));
    let undetected = credibility::undetected(engine.observed, in_residual.is_some());
    credibility::with_unknown_laws(findings, variance(&data.reading), undetected);
    if of_record.decays {
        credibility::of_slow(findings);
    }
    let is_unearned = is_unearned(findings, extended);
    if of_record.identified {
        credibility::of_identified(findings);
    }
    let is_lacking = of_record.identified && credibility::are_linear(findings);
    let is_endless = credibility::of_levels_without_end(findings);
    credibility::of_spoiling(findings, &spoiling);
    unconfirmed::weigh(engine, extended, findings);
    let in_findings = [(is_unearned, UNEARNED), (is_lacking, LACKING), (is_endless, ENDLESS)];
    let doubt = in_residual.or_else(|| in_findings.iter().find(|(is, _)| *is).map(|(_, of)| (*of).to_owned()))?;
    let share = unmodelled.map_or(0.0, |found| found.share);
    credibility::in_unexplained(findings, share * found.regular.rms(&extended.residual).powi(2));
    Some(doubt)
}

/// True if the residual is autocorrelated and no cause removes much of it: an autoregression follows errors of the model as well as slow
/// noise.
pub(crate) fn is_unearned(findings: &[Finding], extended: &Fit) -> bool {
    !extended.noise.autocorrelation.is_white() && credibility::are_unlikely(findings)
}

/// The sentence on unmodelled dynamics in the residual of a fit.
pub(crate) fn sentence(found: &UnmodelledDynamics, extended: &Fit, scales: &Scales) -> String {
    let UnmodelledDynamics { place, share, rms, whitened, .. } = found;
    let (of, rms) = match *whitened && !extended.noise.autocorrelation.is_white() {
        true => ("the one-step error", share.max(0.0).sqrt() * extended.noise.sigma),
        false => ("the residual", *rms),
    };
    let rms = scales.shown_in_four_digits(Dimension::ReadingSize, rms);
    format!("{:.1} % of {of} ({rms} RMS) is structure, not noise: it shows {place}", 100.0 * share)
}
