//! The probability of a finding, so that of all findings with a probability `p` the part `p` is true, whatever the spring's law.
//!
//! The odds against the best rival presume that one of the sets of causes that were compared is right. A spring may also follow a
//! law that no cause describes; a second cause then corrects the form of the first, or follows what looks like noise. The more
//! error a finding removes, compared with what such a law may leave, the less likely that is:
//!
//! ```text
//! probability = 1 / (1 + exp(-odds)) * removed / (removed + min(UNKNOWN_FORM other, undetected left) + UNKNOWN_NOISE left)
//! ```
//!
//! with the mean square errors that the finding alone removes, that the largest other finding removes (0 for a hum and outliers,
//! which do not respond to the voltage and correct no law; nor do these count, or findings that exact equality of readings proves, as
//! the largest; nor does more than the mean square of the readings, since a gain that is far off removes more than any law leaves), and
//! that is left; the errors of other findings leave outliers out. A wrong form follows a law in part: where no structure is left that
//! shows, it can have removed no more than [`undetected`] times what is left, or times `left / removed` as much if less than is left was
//! removed. Where another finding is likely to be such a correction, some law is unknown, as in a record whose verdict is `unexplained`. There
//!
//! ```text
//! probability *= IF_UNEXPLAINED removed / (removed + structure)           structure: mean square of what is left beyond noise
//! ```
//!
//! and what is then less likely true than untrue is a suspect, no finding. In other records what is improbable beside a likely finding
//! is a suspect; what else is less likely true than untrue makes the record ambiguous: a law that no cause describes may be in its place.
//! So do causes that are each likely, if the product of their probabilities is below [`LIKELY_TOGETHER`].

use crate::answer::{Finding, Judge, Report, Suspect, Verdict};
use crate::effects::identified::LINEAR_DYNAMICS;
use crate::record::observed::Observed;
use crate::stats::thresholds::empirical::{
    IF_IDENTIFIED, IF_SPOILING, IF_UNEXPLAINED, ROWS_THAT_DETECT, UNKNOWN_FORM, UNKNOWN_NOISE,
};
use crate::verdict::extrapolation::Spoils;
use crate::verdict::finding::explained;

/// Probability below which nothing is a finding beside a likely one.
const IMPROBABLE: f64 = 0.1;

/// Probability that all causes are true, below which they do not explain a record: a wrong explanation is worse than one more question.
const LIKELY_TOGETHER: f64 = 0.7;

/// Causes that do not respond to the voltage, so that they correct no law, and no other cause corrects them.
const APART: [&str; 2] = ["hum", "outliers"];

/// Causes that a drift, or what an earlier voltage left behind, may be taken for.
const SLOW: [&str; 4] = ["drift", "charge-leakage", "second-relaxation", "series-lag"];

/// Returns the mean square error that a wrong form may remove of an unknown law without leaving structure that shows in these readings,
/// relative to the mean square that is left; infinite if structure shows, and if readings are intervals, in which errors do not.
pub(crate) fn undetected(observed: &Observed, is_structured: bool) -> f64 {
    let hides_all = is_structured || observed.intervals() > 0;
    if hides_all { f64::INFINITY } else { (ROWS_THAT_DETECT.get() / observed.kinds.len() as f64).max(1.0) }
}

/// Lowers probabilities by the chance that a law which no cause describes is behind a finding; `power` is the mean square of the readings
/// about their mean, in the squared unit of the findings' errors, and `undetected` that of [`undetected`].
pub(crate) fn with_unknown_laws(findings: &mut [Finding], power: f64, undetected: f64) {
    let removed: Vec<f64> = findings.iter().map(|finding| explained(finding).max(0.0)).collect();
    let largest_but = |index: usize| {
        // What equality of readings proves follows no law that another cause could correct.
        let corrected =
            |other: usize| other != index && !findings[other].proved && !APART.contains(&findings[other].cause);
        let others = removed.iter().enumerate().filter(|(other, _)| corrected(*other));
        others.map(|(_, removed)| *removed).fold(0.0, f64::max).min(power)
    };
    let own = |(index, finding): (usize, &Finding)| {
        let form = if APART.contains(&finding.cause) { 0.0 } else { UNKNOWN_FORM.get() * largest_but(index) };
        let left = finding.rmse_after.powi(2);
        // What removes less than is left is nearer to what any form of a law leaves; not the product of an infinity and 0.
        let most = if left > 0.0 { undetected * left * (left / removed[index]).max(1.0) } else { f64::INFINITY };
        let unknown = form.min(most) + UNKNOWN_NOISE.get() * left;
        if finding.proved { 1.0 } else { part(removed[index], unknown) }
    };
    let own: Vec<f64> = findings.iter().enumerate().map(own).collect();
    for (index, finding) in findings.iter_mut().enumerate() {
        let others_known: f64 =
            own.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, own)| own).product();
        lower(finding, own[index] * (1.0 - (1.0 - IF_UNEXPLAINED.get()) * (1.0 - others_known)));
    }
}

/// Lowers probabilities in a record with the verdict `unexplained`, in which `structure` is the mean square error beyond noise, in
/// the squared unit of the findings' errors.
pub(crate) fn in_unexplained(findings: &mut [Finding], structure: f64) {
    for finding in findings {
        let factor = IF_UNEXPLAINED.get() * part(explained(finding).max(0.0), structure.max(0.0));
        lower(finding, factor);
    }
}

/// Lowers probabilities of the slow causes where the readings decay without being driven: each may stand for another.
pub(crate) fn of_slow(findings: &mut [Finding]) {
    let slow = findings.iter_mut().filter(|finding| SLOW.contains(&finding.cause));
    slow.for_each(|finding| lower(finding, IF_UNEXPLAINED.get()));
}

/// Lowers probabilities of linear dynamics beside a nominal spring that was identified from the same readings: what it lacks of them
/// belongs to it.
pub(crate) fn of_identified(findings: &mut [Finding]) {
    let linear = findings.iter_mut().filter(|finding| LINEAR_DYNAMICS.contains(&finding.cause));
    linear.for_each(|finding| lower(finding, IF_IDENTIFIED.get()));
}

/// True if there are linear dynamics among the causes, and no likely cause beside them.
pub(crate) fn are_linear(findings: &[Finding]) -> bool {
    findings.iter().any(|finding| LINEAR_DYNAMICS.contains(&finding.cause)) && !findings.iter().any(is_likely_cause)
}

/// Lowers probabilities of causes that spoil an extrapolation.
pub(crate) fn of_spoiling(findings: &mut [Finding], spoiling: &[Spoils]) {
    let spoils = |finding: &&mut Finding| spoiling.iter().any(|spoils| spoils.is(finding));
    findings.iter_mut().filter(spoils).for_each(|finding| lower(finding, IF_SPOILING.get()));
}

/// Lowers the probability of a cause that an error of the simulation could not be distinguished from.
pub(crate) fn of_unconfirmed(finding: &mut Finding) {
    lower(finding, IF_SPOILING.get());
}

/// Returns true if readings are shifted to as many levels as are looked for, and lowers that probability: so many follow any law that no
/// cause describes, while a sensor is knocked a few times.
pub(crate) fn of_levels_without_end(findings: &mut [Finding]) -> bool {
    let is_endless =
        |finding: &&mut Finding| finding.parameters.iter().any(|(name, it)| name == "levels" && it.at_bound);
    let Some(endless) = findings.iter_mut().find(is_endless) else { return false };
    lower(endless, IF_SPOILING.get());
    true
}

/// True if there are causes, not proved by exact equality of readings, and each is less likely true than untrue.
pub(crate) fn are_unlikely(findings: &[Finding]) -> bool {
    findings.iter().any(|finding| !finding.proved) && !findings.iter().any(is_likely_cause)
}

/// The causes that are at least as likely true as untrue, where others are less likely than that, so that these may be all; empty if the
/// simulation may be right as it is given. Improbable causes beside a likely one leave nothing open: they will be suspects. Where all are
/// likely but not all together, all but the least likely. `None` elsewhere.
pub(crate) fn likely_alone(findings: &[Finding]) -> Option<Vec<&'static str>> {
    let beside_likely = findings.iter().any(is_likely_cause);
    let improbable = |finding: &&Finding| beside_likely && !finding.is_likely() && finding.probability < IMPROBABLE;
    let open: Vec<&Finding> = findings.iter().filter(|finding| !improbable(finding)).collect();
    let likely: Vec<&Finding> = open.iter().copied().filter(|finding| finding.is_likely()).collect();
    let causes = |findings: &[&Finding]| findings.iter().map(|finding| finding.cause).collect();
    if likely.len() < open.len() {
        return Some(causes(&likely));
    }
    let together: f64 = open.iter().map(|finding| finding.probability).product();
    let least = open.iter().min_by(|a, b| a.probability.total_cmp(&b.probability))?;
    let others: Vec<&Finding> = open.iter().copied().filter(|finding| finding.cause != least.cause).collect();
    (together < LIKELY_TOGETHER).then(|| causes(&others))
}

/// Makes suspects of findings: in a record with the verdict `unexplained` of those that are less likely true than untrue, in another of
/// the improbable ones beside a likely one, whose form they rather correct.
pub(crate) fn unlikely_to_suspects(report: &mut Report) {
    let unlikely = match report.verdict {
        Verdict::Unexplained => taken_out(&mut report.findings, |finding| !finding.is_likely()),
        _ if report.findings.iter().any(is_likely_cause) => {
            taken_out(&mut report.findings, |finding| finding.probability < IMPROBABLE)
        }
        _ => return,
    };
    report.suspects.splice(0..0, unlikely);
}

/// True for a cause, not proved by exact equality of readings, that is at least as likely true as untrue.
fn is_likely_cause(finding: &Finding) -> bool {
    !finding.proved && finding.is_likely()
}

/// Takes unlikely findings out; returns them as suspects, the likeliest first.
fn taken_out(findings: &mut Vec<Finding>, is_unlikely: impl Fn(&Finding) -> bool) -> Vec<Suspect> {
    let causes: Vec<&str> = findings.iter().map(|finding| finding.cause).collect();
    let mut unlikely: Vec<Finding> = findings.extract_if(.., |finding| is_unlikely(finding)).collect();
    unlikely.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let suspect = |Finding { cause, probability, parameters, rmse_before, rmse_after, .. }| Suspect {
        cause,
        with: causes.iter().copied().filter(|other| *other != cause).collect(),
        parameters,
        rmse_before,
        rmse_after,
        nats_short: 0.0,
        judge: Judge::Fit,
        probability: Some(probability),
    };
    unlikely.into_iter().map(suspect).collect()
}

/// Part of the sum that is `removed`; 1 if both are 0.
fn part(removed: f64, unknown: f64) -> f64 {
    if unknown > 0.0 { removed / (removed + unknown) } else { 1.0 }
}

fn lower(finding: &mut Finding, factor: f64) {
    if !finding.proved {
        finding.probability *= factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Parameter;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Kind;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// A finding that removes errors down to 1 V.
    fn finding(cause: &'static str, before: f64) -> Finding {
        let (parameters, evidence, proved) = (Vec::new(), String::new(), cause == "quantisation");
        Finding { cause, probability: 1.0, parameters, rmse_before: before, rmse_after: 1.0, evidence, proved }
    }

    fn probabilities(findings: &[Finding]) -> Vec<f64> {
        findings.iter().map(|finding| finding.probability).collect()
    }

    #[test]
    fn small_corrections_of_a_large_cause_are_less_likely_than_causes_of_their_own() {
        let mut findings = [finding("hysteresis", 20.0), finding("resonance", 1.3), finding("quantisation", 1.0)];
        with_unknown_laws(&mut findings, f64::MAX, f64::INFINITY);
        let [large, small, exact] = probabilities(&findings)[..] else { panic!() };
        // Some law is then unknown.
        assert!((0.9..0.95).contains(&large) && small < 0.3 && exact == 1.0, "{large} {small} {exact}");
        // A bound that the search found, in front of the noise, is proved by nothing.
        let mut findings = [finding("hysteresis", 20.0), finding("sensor-saturation", 1.3)];
        with_unknown_laws(&mut findings, f64::MAX, f64::INFINITY);
        assert!(probabilities(&findings)[1] < 0.3, "{findings:?}");
        let mut findings = [finding("hysteresis", 20.0), finding("resonance", 15.0), finding("hum", 4.0)];
        with_unknown_laws(&mut findings, f64::MAX, f64::INFINITY);
        assert!(probabilities(&findings).iter().all(|probability| *probability > 0.97), "{findings:?}");
        assert!(!are_unlikely(&findings) && !are_unlikely(&[]));
        let mut findings = [finding("resonance", 1.02), finding("quantisation", 1.0)];
        with_unknown_laws(&mut findings, f64::MAX, f64::INFINITY);
        assert!(are_unlikely(&findings), "{findings:?}");
    }

    #[test]
    fn small_corrections_that_leave_noise_alone_are_likely() {
        let second = |undetected: f64, before: f64| {
            let mut findings = [finding("amplifier-limit", 100.0), finding("amplifier-slew", before)];
            with_unknown_laws(&mut findings, f64::MAX, undetected);
            probabilities(&findings)[1]
        };
        assert!(second(f64::INFINITY, 3.0) < 0.1 && second(1.0, 3.0) > 0.85 && second(1.0, 1.1) < 0.2);
        // A few rows hide more, and structure is the sign of a form that is wrong.
        let observed = |rows: usize| {
            let row = |(line, noise)| Row { line, time_s: line as f64, voltage_v: 100.0, measured: Some(noise) };
            let rows = normals(rows).into_iter().enumerate().map(row).collect();
            Observed::new(&Data::new(&Record { name: String::new(), rows }, Input::Hold))
        };
        let cases = [(4000, false), (4000, true), (500, false)];
        assert_eq!(cases.map(|(rows, is)| undetected(&observed(rows), is)), [1.0, f64::INFINITY, 4.0]);
        assert!(second(undetected(&observed(100), false), 3.0) < 0.3);
        let reports = Observed { kinds: vec![Kind::Unreported(1.0); 4000], ..observed(4000) };
        assert_eq!(undetected(&reports, false), f64::INFINITY);
    }

    /// The simulation was 1000 times too large.
    #[test]
    fn a_gain_that_is_far_off_leaves_other_causes_as_likely_as_one_of_the_readings_size() {
        let mut findings = [finding("gain-error", 1e5), finding("time-constant", 5.0)];
        with_unknown_laws(&mut findings, 1e4, f64::INFINITY);
        let mut close = [finding("gain-error", 100.0), finding("time-constant", 5.0)];
        with_unknown_laws(&mut close, 1e4, f64::INFINITY);
        let [far, close] = [findings, close].map(|findings| probabilities(&findings)[1]);
        assert!((far - close).abs() < 0.01 && far > 0.1, "{far} {close}");
    }

    #[test]
    fn outliers_leave_other_causes_as_likely_as_they_are_without() {
        let likely = |findings: &mut [Finding]| {
            with_unknown_laws(findings, f64::MAX, f64::INFINITY);
            findings[0].probability
        };
        let alone = likely(&mut [finding("time-constant", 1.5)]);
        let beside = likely(&mut [finding("time-constant", 1.5), finding("outliers", 20.0)]);
        assert!((beside - alone).abs() < 0.01 && alone > 0.9, "{beside} {alone}");
    }

    #[test]
    fn causes_that_leave_structure_are_at_most_as_likely_as_what_they_remove_of_it() {
        let mut findings = [finding("hysteresis", 20.0), finding("drift", 1.2)];
        in_unexplained(&mut findings, 0.5);
        let [large, small] = probabilities(&findings)[..] else { panic!() };
        assert!((0.89..0.9).contains(&large) && small < 0.5, "{large} {small}");
    }

    #[test]
    fn linear_dynamics_beside_an_identified_spring_are_suspects() {
        let mut findings = [probable("hysteresis", 0.95), probable("series-lag", 0.9)];
        of_identified(&mut findings);
        assert!(findings[0].probability == 0.95 && findings[1].probability < IMPROBABLE, "{findings:?}");
        assert!(!are_linear(&findings), "the likely cause is none of them");
        assert_eq!(likely_alone(&findings), None, "nothing is left open");
        assert!(are_linear(&findings[1..]) && are_linear(&[probable("hysteresis", 0.3), probable("delay", 0.01)]));
        assert!(!are_linear(&[]) && !are_linear(&[probable("hysteresis", 0.3)]));
    }

    #[test]
    fn a_shift_to_as_many_levels_as_are_looked_for_explains_nothing() {
        let shifted = |at_bound| {
            let (value, dimension) = (16.0, crate::dimension::Dimension::Ratio);
            let unit = String::new();
            let levels =
                Parameter { value, low: value, high: value, unit, at_bound, extrapolated_from_v: None, dimension };
            Finding { parameters: vec![("levels".to_owned(), levels)], ..probable("reading-offset", 0.97) }
        };
        let mut findings = [probable("drift", 0.9), shifted(true)];
        assert!(of_levels_without_end(&mut findings) && probabilities(&findings) == [0.9, 0.97 * IF_SPOILING.get()]);
        let mut findings = [probable("drift", 0.9), shifted(false)];
        assert!(!of_levels_without_end(&mut findings) && probabilities(&findings) == [0.9, 0.97]);
    }

    fn probable(cause: &'static str, probability: f64) -> Finding {
        Finding { probability, ..finding(cause, 2.0) }
    }

    #[test]
    fn a_cause_less_likely_than_not_leaves_the_likely_ones_alone_as_an_alternative() {
        let open = [probable("hysteresis", 0.9), probable("quantisation", 1.0), probable("delay", 0.3)];
        assert_eq!(likely_alone(&open), Some(vec!["hysteresis", "quantisation"]));
        assert_eq!(likely_alone(&[probable("hysteresis", 0.9), probable("delay", 0.05)]), None, "a suspect");
        assert_eq!(likely_alone(&[probable("hysteresis", 0.95), probable("delay", 0.9)]), None);
        assert_eq!(likely_alone(&[probable("delay", 0.3), probable("quantisation", 1.0)]), Some(vec!["quantisation"]));
        let beside_proved = [probable("delay", 0.03), probable("quantisation", 1.0)];
        assert_eq!(likely_alone(&beside_proved), Some(vec!["quantisation"]), "no likely cause but what is proved");
        assert_eq!(likely_alone(&[probable("delay", 0.03)]), Some(Vec::new()));
        assert_eq!(likely_alone(&[]), None);
    }

    #[test]
    fn causes_that_are_likely_but_not_together_leave_all_but_the_least_likely_as_an_alternative() {
        let three = |least| [probable("hysteresis", 0.95), probable("delay", least), probable("drift", 0.9)];
        assert_eq!(likely_alone(&three(0.8)), Some(vec!["hysteresis", "drift"]));
        assert_eq!(likely_alone(&three(0.85)), None);
        assert_eq!(likely_alone(&[probable("hysteresis", 0.9), probable("delay", 0.6)]), Some(vec!["hysteresis"]));
        assert_eq!(likely_alone(&[probable("delay", 0.65)]), Some(Vec::new()));
        assert_eq!(likely_alone(&[probable("delay", 0.85), probable("quantisation", 1.0)]), None);
    }

    #[test]
    fn what_is_less_likely_than_not_is_a_suspect() {
        let mut findings = vec![probable("hum", 0.2), probable("drift", 0.6), probable("delay", 0.4)];
        let suspects = taken_out(&mut findings, |finding| !finding.is_likely());
        assert!(findings.len() == 1 && findings[0].cause == "drift");
        let suspects: Vec<_> = suspects.into_iter().map(|it| (it.cause, it.probability, it.with)).collect();
        let expected = [("delay", Some(0.4), vec!["hum", "drift"]), ("hum", Some(0.2), vec!["drift", "delay"])];
        assert_eq!(suspects, expected);
    }
}
