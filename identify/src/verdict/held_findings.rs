//! The finding that readings were held, which the repeated numbers prove.

use simulation::record::Record;
use simulation::units::Units;

use crate::answer::{Finding, Parameter, Verdict};
use crate::dimension::Dimension;
use crate::record::held::{Held, Reason};
use crate::record::input::Input;
use crate::stats::scale::root_mean_square;
use crate::stats::thresholds::probability::Z;
use crate::verdict::diagnosis::Diagnosis;
use crate::verdict::finding::explained;

/// Adds the finding to the report of a diagnosis, in the file's units, of `record` without its held readings unless they are reports of
/// changes.
pub(crate) fn add_held(diagnosis: &mut Diagnosis, record: &Record, held: &Held, input: Input, units: &Units) {
    let after = diagnosis.report.extended.quality.rmse;
    let before = match held.reason {
        // Beyond the last good reading there is no line to another one.
        Reason::Stuck => root_mean_square(&diagnosis.errors_on(record, input)),
        _ => after.hypot(held.error),
    };
    let report = &mut diagnosis.report;
    if held.reported_change().is_none() {
        report.rows += held.rows.len();
    }
    let parameter = |value, low, high, dimension: Dimension| Parameter {
        value,
        low,
        high,
        unit: dimension.unit(units),
        at_bound: false,
        extrapolated_from_v: None,
        dimension,
    };
    let percent = 100.0 * held.fraction;
    let (cause, parameters, why) = match held.reason {
        // What a sensor does as it should is no error of the simulation.
        Reason::SlowClock => return,
        Reason::ReportsChanges => {
            let [smallest, middle] = held.changes;
            let step = parameter(smallest, 0.0, middle, Dimension::ReadingSize);
            (
                "quantisation",
                vec![("step", step)],
                "they change by as much however long that takes: only changes are reported; in between, the response is near the last reading",
            )
        }
        Reason::Lost => {
            let [age_s, error_s] = held.age_s;
            let late = parameter(age_s, age_s - Z * error_s, age_s + Z * error_s, Dimension::Time);
            (
                "delay",
                vec![("delay_s", late)],
                "independently of the response: new readings are late or lost; the other readings alone are diagnosed",
            )
        }
        Reason::Stuck => {
            let [from_s, to_s] = held.longest_s.map(|time_s| parameter(time_s, time_s, time_s, Dimension::TimePoint));
            let fraction = parameter(held.fraction, held.fraction, held.fraction, Dimension::Ratio);
            (
                "stuck-sensor",
                vec![("from_s", from_s), ("to_s", to_s), ("fraction", fraction)],
                "in runs that are far longer than all others: the sensor was stuck; the other readings alone are diagnosed",
            )
        }
    };
    // What the readings that were sent say of the converter's step is less than what they say of the changes.
    report.findings.retain(|finding| finding.cause != cause || held.reported_change().is_none());
    if report.findings.iter().any(|finding| finding.cause == cause) {
        return;
    }
    report.findings.push(Finding {
        cause,
        probability: 1.0,
        parameters: parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
        rmse_before: before,
        rmse_after: after,
        evidence: format!("{percent:.0} % of the readings repeat the one before, to the last digit, and {why}"),
        proved: true,
    });
    report.findings.sort_by(|a, b| explained(b).total_cmp(&explained(a)));
    report.suspects.retain(|suspect| suspect.cause != cause);
    if matches!(report.verdict, Verdict::Consistent | Verdict::Insufficient) {
        diagnosis.conclude(Verdict::Explained);
    }
}
