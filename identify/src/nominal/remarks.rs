//! What records cannot tell about a spring, in sentences.

use std::f64::consts::TAU;

use simulation::units::Units;

use crate::dimension::significant;
use crate::linear::{Fit, LARGEST_ORDER, Problem, Section, fewest_readings};
use crate::nominal::models::STRUCTURED;
use crate::nominal::report::{AtBound, FarReading, InputLaw, Report, ZeroShift};

/// A time constant with a larger ratio of its bounds is hardly known.
const HARDLY_KNOWN: f64 = 4.0;

/// A model with a smaller held-out error, relative to that of gain and zero alone, shows a response.
const RESPONDS: f64 = 0.8;
/// Readings whose times a remark lists.
const LISTED: usize = 5;

/// The remark on readings that were left out.
pub(super) fn left_out(readings: &[FarReading], units: &Units) -> String {
    // Ten digits, without the trailing zeros.
    let shown = |time: f64| format!("{time:.9e}").parse().unwrap_or(time).to_string();
    let times: Vec<String> = readings.iter().take(LISTED).map(|far| shown(far.time_s / units.time.si)).collect();
    let (verb, noun) = if readings.len() == 1 { ("is", "reading") } else { ("are", "readings") };
    format!(
        "{} {noun} far from all around {verb} left out of the model and of its errors (at {}{} {}); `vsj diagnose` judges all readings.",
        readings.len(),
        times.join(", "),
        if readings.len() > LISTED { ", ..." } else { "" },
        units.time.name
    )
}

/// The remark on a number of readings that were held.
pub(super) fn held(readings: usize) -> String {
    format!(
        "{readings} readings repeat the one before, to the last digit, because no new one was taken or sent, or the sensor was stuck; they are \
         left out of the model and of its errors."
    )
}

/// The remark on shifts of the sensor's zero, each with its record if there are `several`.
pub(super) fn zero_shifts(shifts: &[ZeroShift], several: bool, units: &Units) -> String {
    let shown = |ZeroShift { from_s, by, record }: &ZeroShift| {
        let time = significant(from_s / units.time.si, 6);
        let of = if several { format!(" in {record}") } else { String::new() };
        format!("by {} {} from {time} {} on{of}", significant(*by, 4), units.reading, units.time.name)
    };
    let all: Vec<String> = shifts.iter().map(shown).collect();
    format!(
        "The readings are shifted {}, abruptly and not by the voltage: the shift was fitted together with the model; `vsj diagnose` judges \
         all readings.",
        all.join(", ")
    )
}

/// The remark on readings that stopped at a bound of the sensor.
pub(super) fn at_bounds(stopped: &[AtBound], units: &Units) -> String {
    let readings: usize = stopped.iter().map(|at| at.readings).sum();
    let mut limits: Vec<String> =
        stopped.iter().map(|at| format!("{} {}", significant(at.limit, 6), units.reading)).collect();
    limits.dedup();
    format!(
        "{readings} readings at {}, where the sensor saturates, are left out of the model and of its errors; `vsj diagnose` judges all \
         readings.",
        limits.join(" and ")
    )
}

/// What an identified spring leaves in doubt: whether its gain, its time constants and what the readings show are properties of the
/// spring at all.
pub(super) fn doubts(report: &Report, problem: &Problem, fit: &Fit, units: &Units) -> Vec<String> {
    let nominal = &report.nominal;
    let mut remarks = Vec::new();
    if nominal.gain.low <= 0.0 && nominal.gain.high >= 0.0 {
        remarks.push(if report.held_out_rmse < RESPONDS * report.static_held_out_rmse {
            "The records show a response but not where it settles: the interval of the gain contains 0. The spring settles in \
             a longer time than the records last, or integrates the voltage."
                .into()
        } else {
            "The records show no static response: the interval of the gain contains 0.".into()
        });
    }
    let undriven = fit.poles.undriven.iter().map(|&place| match fit.poles.sections[place] {
        Section::First { tau } => format!("a change over {} that fades", shown(tau, units)),
        Section::Second { frequency, .. } => format!("an oscillation of {} Hz", significant(frequency / TAU, 4)),
    });
    let undriven: Vec<String> = undriven.collect();
    if !undriven.is_empty() {
        remarks.push(format!(
            "The readings show {}, which the voltage does not drive: a drift or a hum, or noise that looks like one; the model of the \
             spring is without it.",
            undriven.join(" and ")
        ));
    }
    for bound in problem.on_bounds(&fit.poles) {
        remarks
            .push(format!("A parameter is on its bound, {bound} that is searched; its interval is not to be trusted."));
    }
    let duration = duration(problem);
    for lag in nominal.tau_s.iter().filter(|lag| lag.tau.value > duration) {
        remarks.push(format!(
            "The time constant {} is longer than the record ({}), so that it may be a drift.",
            shown(lag.tau.value, units),
            shown(duration, units)
        ));
    }
    remarks
}

/// Returns the duration of the longest record, in s.
fn duration(problem: &Problem) -> f64 {
    problem.series.iter().map(|series| series.duration()).fold(0.0, f64::max)
}

/// Returns a time in the user's unit.
fn shown(seconds: f64, units: &Units) -> String {
    format!("{} {}", significant(seconds / units.time.si, 4), units.time.name)
}

/// The remarks on an identification, whose order was asked for `in_place_of` the one that would have been chosen.
pub(super) fn remarks(
    report: &Report,
    in_place_of: Option<usize>,
    problem: &Problem,
    fit: &Fit,
    units: &Units,
) -> Vec<String> {
    let nominal = &report.nominal;
    let mut remarks = Vec::new();
    if let Some(other) = in_place_of {
        remarks
            .push(format!("Order {} was asked for; the held-out errors are in favour of order {other}.", report.order));
    }
    if report.input_law == InputLaw::Square {
        let full_scale = problem.series.iter().map(|series| series.full_scale()).fold(0.0, f64::max);
        remarks.push(format!(
            "The gain is that at {} {}: the reading follows the square of the voltage.",
            significant(full_scale / units.voltage.si, 4),
            units.voltage.name
        ));
    }
    remarks.extend(doubts(report, problem, fit, units));
    if (nominal.share.high < 0.0 || nominal.share.low > 1.0) && report.order > 0 {
        remarks.push(format!(
            "The instantaneous share {} is outside of 0 to 1: the first response goes {}.",
            significant(nominal.share.value, 4),
            if nominal.share.value < 0.0 { "the other way" } else { "beyond the settled one" }
        ));
    }
    let duration = duration(problem);
    for lag in &nominal.tau_s {
        if lag.tau.value <= duration && lag.tau.high > HARDLY_KNOWN * lag.tau.low {
            remarks.push(format!("The record hardly tells the time constant {}.", shown(lag.tau.value, units)));
        }
    }
    let delay = [nominal.delay_s.low, nominal.delay_s.high].map(|seconds| shown(seconds, units));
    if problem.bounds.held && nominal.delay_s.value > 0.0 && report.order > 0 && delay[0] != delay[1] {
        let readings = match problem.bounds.whole_rows {
            true => format!("Readings every {}", shown(problem.spacing, units)),
            false => "The times of the readings".into(),
        };
        remarks.push(format!(
            "{readings} cannot tell a part of this delay from a part of the instantaneous share: the delay is {} to {}.",
            delay[0], delay[1]
        ));
    }
    if report.last_40_percent_rmse > STRUCTURED * report.held_out_rmse {
        remarks.push(format!(
            "A fit to the first 60 % does not predict the rest (error {} {} instead of {} {}): a part of the model may describe a \
             disturbance of this record, or the record ends in another state than it began.",
            significant(report.last_40_percent_rmse, 4),
            report.unit,
            significant(report.held_out_rmse, 4),
            report.unit
        ));
    }
    if report.rmse > STRUCTURED * report.noise.scatter && report.noise.scatter > 0.0 {
        let order = report.linear.len();
        let why = if let Some(larger) = in_place_of.filter(|other| *other > report.order) {
            format!("a model of order {larger} describes more of the response")
        } else if order < LARGEST_ORDER {
            let fewest = fewest_readings(problem, order + 1);
            format!("a model of order {} is not tried with fewer than {fewest} readings", order + 1)
        } else {
            "the noise is slow, or no linear model of order 4 or less describes all of the response; `vsj diagnose` decides".into()
        };
        remarks.push(format!(
            "The errors ({} {}) exceed their scatter from row to row ({} {}): {why}.",
            significant(report.rmse, 4),
            report.unit,
            significant(report.noise.scatter, 4),
            report.unit
        ));
    }
    remarks
}
