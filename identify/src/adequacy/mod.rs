//! Whether a fit is adequate: whether the record identifies a spring, and whether the fit leaves nothing but noise.
//!
//! In comes a fit ([`Candidate`]), out come the findings of checks ([`Inadequacy`]), localised in time and voltage.
//!
//! | term | meaning |
//! | --- | --- |
//! | [`Check`] | one test of a fit; every file with a check in its table row is one |
//! | [`UnmodelledDynamics`] | structure in the residual that no effect of the model explains |
//! | [`Unidentifiable`] | why a record identifies no spring |
//! | whitened residual, innovations | residual less what the noise's autoregression predicts of it |
//! | false-alarm rate | fraction of records with an adequate model on which a check finds something |
//! | power | fraction of records with the stated departure on which a check finds something |
//!
//! [`CHECKS`] is the table of all checks in the order in which they are asked; `first_significant` and `doubts` ask them.

mod absorbed_by_noise;
mod check;
mod comparison;
mod excitation;
#[cfg(test)]
mod fixture;
mod free_run;
mod gain_and_time_constant;
mod in_step;
mod localisation;
mod no_response;
mod repetition;
mod residual_regression;
mod spikes;
mod standstill;
mod unidentifiable;
mod voltage_history;

pub use check::{Candidate, Check, Inadequacy, UnmodelledDynamics};
pub(crate) use gain_and_time_constant::{gain_and_time_constant, model_of_both};
pub(crate) use spikes::{far_off, spikes, without_outliers};
pub use unidentifiable::Unidentifiable;

use crate::fit::engine::{Engine, Fit};

/// When a check is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// Before the search, of the simulation as it is given.
    BeforeSearch,
    /// After the search, of the model that it found, whose score includes the price of its blocks.
    AfterSearch,
    /// For the report, of the model that it found.
    ForReport,
    /// During the search, of every model that may be extended, and for the report.
    DuringSearchAndForReport,
}

/// A check with what is known of it.
pub struct Entry {
    /// The check.
    pub check: &'static dyn Check,
    /// When it is asked.
    pub when: When,
    /// What it looks for.
    pub looks_for: &'static str,
    /// Fraction of records with an adequate model on which it finds something significant.
    pub false_alarm_rate: f64,
    /// The departure for which its power is stated.
    pub departure: &'static str,
    /// Fraction of records with that departure on which it finds something significant.
    pub power: f64,
}

/// All checks, in the order in which they are asked.
///
/// The false-alarm rates are upper and the powers lower bounds at 95 % confidence, over 200 simulated records of 2400 rows with
/// noise of 1 V, half of it independent and half autoregressive; `cargo run -p identify --example check_rates` prints the counts.
/// The design rates are smaller: `in_step`, `spikes` and `residual_regression` are significant by chance in one of ten thousand
/// records.
pub static CHECKS: [Entry; 9] = [
    Entry {
        check: &excitation::Excitation,
        when: When::BeforeSearch,
        looks_for: "a constant voltage, or readings that are all equal",
        false_alarm_rate: 0.015,
        departure: "a reading of 100 V in every row",
        power: 0.98,
    },
    Entry {
        check: &no_response::NoResponse,
        when: When::BeforeSearch,
        looks_for: "readings that depend neither on the command nor on the time, where the simulation does",
        false_alarm_rate: 0.015,
        departure: "a constant reading of 100 V with the noise",
        power: 0.98,
    },
    Entry {
        check: &standstill::Standstill,
        when: When::AfterSearch,
        looks_for: "readings that a constant predicts as well as the best spring",
        false_alarm_rate: 0.015,
        departure: "a constant reading of 100 V instead of the spring",
        power: 0.98,
    },
    Entry {
        check: &absorbed_by_noise::AbsorbedByNoise,
        when: When::DuringSearchAndForReport,
        looks_for: "swings, changing rhythms and lines that the noise's autocorrelation absorbs",
        false_alarm_rate: 0.015,
        departure: "half a period of a sine of 5 V over the record",
        power: 0.98,
    },
    Entry {
        check: &in_step::InStep,
        when: When::ForReport,
        looks_for: "errors that change when the stiffness does",
        false_alarm_rate: 0.015,
        departure: "a time constant of 11 s instead of 5.5 s",
        power: 0.81,
    },
    Entry {
        check: &spikes::Spikes,
        when: When::ForReport,
        looks_for: "far readings just after changes of the command, or in runs of one sign",
        false_alarm_rate: 0.015,
        departure: "an error of 30 V in the first two rows of every other step",
        power: 0.98,
    },
    Entry {
        check: &free_run::FreeRun,
        when: When::ForReport,
        looks_for: "a free-running error that earlier voltages predict",
        false_alarm_rate: 0.015,
        departure: "a time constant of 8 s instead of 5.5 s",
        power: 0.98,
    },
    Entry {
        check: &repetition::Repetition,
        when: When::ForReport,
        looks_for: "errors that repeat with the period of the voltage",
        false_alarm_rate: 0.015,
        departure: "a time constant of 8 s instead of 5.5 s",
        power: 0.98,
    },
    Entry {
        check: &residual_regression::ResidualRegression,
        when: When::DuringSearchAndForReport,
        looks_for: "dependence of the whitened residual on the command or the time, and spectral lines",
        false_alarm_rate: 0.015,
        departure: "a time constant of 6 s instead of 5.5 s",
        power: 0.71,
    },
];

/// Reason why the record identifies no spring, of the first check of [`CHECKS`] asked at `when` that finds one.
pub(crate) fn unidentifiable(engine: &mut Engine, candidate: &Candidate, when: When) -> Option<Unidentifiable> {
    let mut asked = CHECKS.iter().filter(|entry| entry.when == when);
    asked.find_map(|entry| match entry.check.test(engine, candidate) {
        Some(Inadequacy::Unidentifiable(reason)) => Some(reason),
        _ => None,
    })
}

/// Significant structure in a fit's residual, of the first check of [`CHECKS`] asked for the report that finds some.
pub(crate) fn first_significant(engine: &mut Engine, fit: &Fit) -> Option<UnmodelledDynamics> {
    let for_report = [When::ForReport, When::DuringSearchAndForReport];
    unmodelled(engine, fit, &for_report, |found| found.significant)
}

/// True if a check of [`CHECKS`] asked during the search doubts that a fit leaves nothing but noise.
pub(crate) fn doubts(engine: &mut Engine, fit: &Fit) -> bool {
    unmodelled(engine, fit, &[When::DuringSearchAndForReport], |found| found.doubtful).is_some()
}

/// Structure that `counts`, of the first check of [`CHECKS`] asked at one of the times `when` that finds such.
fn unmodelled(
    engine: &mut Engine,
    fit: &Fit,
    when: &[When],
    counts: fn(&UnmodelledDynamics) -> bool,
) -> Option<UnmodelledDynamics> {
    let mut asked = CHECKS.iter().filter(|entry| when.contains(&entry.when));
    asked.find_map(|entry| match entry.check.test(engine, &Candidate::unpriced(fit)) {
        Some(Inadequacy::Unmodelled(found)) if counts(&found) => Some(found),
        _ => None,
    })
}
