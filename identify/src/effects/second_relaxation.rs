//! A part of the response relaxes with a second, slower time constant (creep); the settled value does not change unless creep is
//! added to the response.
//!
//! | form | what relaxes |
//! | --- | --- |
//! | of the rest | `y = share_0 q + (1 - share_0 - creep) lag(tau; q) + creep lag(slow; q)` |
//! | of everything | `y = (1 - creep) (share_0 q + (1 - share_0) lag(tau; q)) + creep lag(slow; q)` |
//! | by decades | as of everything, in three equal parts: `slow / 10`, `slow`, `10 slow` (logarithmic creep) |
//! | spread | of the rest, in two equal parts, to both sides: `slow` and `tau^2 / slow` (a broad relaxation) |
//! | added | `y = share_0 q + (1 - share_0) lag(tau; q) + creep lag(slow; q)`; a flow for a `slow` beyond the record |
//! | added by decades | added, in three parts in the ratio `1 : r : r^2` at `slow / 10`, `slow`, `10 slow` (power-law creep) |

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::plant::relaxation::Part;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::stats::thresholds::empirical::FASTEST_CREEP;

pub(super) struct SecondRelaxation;

/// Slow time constants at initial points, in normalised s: 1.6 to 55 reference time constants.
const INITIAL_TIME_CONSTANTS_S: [f64; 7] = [9.0, 15.0, 25.0, 45.0, 80.0, 150.0, 300.0];

const OF_THE_REST: usize = 0;
const OF_EVERYTHING: usize = 1;
const BY_DECADES: usize = 2;
const SPREAD: usize = 3;
const ADDED: usize = 4;
const ADDED_BY_DECADES: usize = 5;
/// Part of a creep within the record from which on it is distinguished from a gain.
const LEAST_SEEN: f64 = 0.3;
/// Largest creep that is added within the record's duration, relative to the nominal response.
const MOST_ADDED: f64 = 3.0;
/// Smallest time constant of a creep that is added, relative to the response's, that is no gain error.
const LEAST_APART: f64 = 1.5;
/// Largest ratio of the parts of two decades.
const STEEPEST: f64 = 5.0;

/// Returns the part of a creep that is seen within the record's duration.
fn within(tau_s: f64, data: &Data) -> f64 {
    -(-data.duration_s() / tau_s).exp_m1()
}

/// Returns the settled value of the creep that is added, relative to the nominal response. The first coordinate is what is added within
/// the record's duration: of a flow that is known, the settled value is not.
fn added(point: &[f64], data: &Data) -> f64 {
    point[0] / within(point[1].exp(), data)
}

impl Effect for SecondRelaxation {
    fn cause(&self) -> &'static str {
        "second-relaxation"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    /// Of creep that is much slower than the record hardly anything is seen: what is missing of it is a gain.
    fn location_at(&self, form: usize, point: &[f64], data: &Data) -> Location {
        let within = |tau_s: f64| within(tau_s, data);
        let slow_s = point[1].exp();
        let seen = match form {
            OF_THE_REST | OF_EVERYTHING => within(slow_s),
            BY_DECADES => (within(0.1 * slow_s) + within(slow_s) + within(10.0 * slow_s)) / 3.0,
            _ => 1.0,
        };
        if seen < LEAST_SEEN { Location::Static } else { self.location() }
    }

    fn description(&self) -> &'static str {
        "part of the response creeps with a slower time constant"
    }

    fn isolating_experiment(&self) -> &'static str {
        "one step, held for minutes: creep goes on rising to the same settled value"
    }

    /// What is added also changes the settled value.
    fn affects(&self, form: usize) -> Affects {
        if matches!(form, ADDED | ADDED_BY_DECADES) { Affects::StaticResponse } else { Affects::Relaxation }
    }

    /// Creep that is added with about the time constant of the response changes its gain.
    fn is_another_cause(&self, form: usize, point: &[f64], _: &Data, _: f64) -> bool {
        form == ADDED && point[1].exp() < LEAST_APART * REFERENCE_TIME_CONSTANT_S
    }

    fn forms(&self) -> usize {
        6
    }

    fn common_forms(&self) -> usize {
        4
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let fastest = FASTEST_CREEP.get() * REFERENCE_TIME_CONSTANT_S;
        let most = if matches!(form, ADDED | ADDED_BY_DECADES) { MOST_ADDED } else { 0.9 };
        let slow = Coordinate::log(fastest, 10.0 * data.duration_s().max(fastest));
        let mut coordinates = vec![Coordinate::new(0.0, most), slow];
        coordinates.extend((form == ADDED_BY_DECADES).then(|| Coordinate::log(1.0 / STEEPEST, STEEPEST)));
        coordinates
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let start = |tau: f64| {
            let mut start = vec![0.1, tau.ln()];
            start.extend((form == ADDED_BY_DECADES).then_some(0.0));
            start
        };
        INITIAL_TIME_CONSTANTS_S.into_iter().filter(|&tau| tau < 3.0 * data.duration_s()).map(start).collect()
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let share = if matches!(form, ADDED | ADDED_BY_DECADES) { added(point, data) } else { point[0] };
        vec![Quantity::new("share", Dimension::Ratio, share), Quantity::new("tau_s", Dimension::Time, point[1].exp())]
    }

    /// Creep of everything with a gain that restores what it takes is creep that is added.
    fn with_gain(&self, form: usize, point: &[f64], gain: f64, data: &Data) -> Option<(usize, Vec<f64>)> {
        let (form, ratio) = match form {
            OF_THE_REST | OF_EVERYTHING => (ADDED, None),
            BY_DECADES => (ADDED_BY_DECADES, Some(0.0)),
            _ => return None,
        };
        let added = gain * point[0] * within(point[1].exp(), data);
        let point = [added, point[1]].into_iter().chain(ratio).collect();
        (0.0..MOST_ADDED).contains(&added).then_some((form, point))
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        let mut creep = point[0];
        if matches!(form, ADDED | ADDED_BY_DECADES) {
            let added = added(point, data);
            chain.law.push(move |voltage| voltage * (1.0 + added));
            // Relative to the settled value, which includes what is added.
            creep = added / (1.0 + added);
        }
        let slow_s = point[1].exp();
        let tau_s = chain.relaxation.tau_s;
        let lags = |lags: &[(f64, f64)]| {
            let sum: f64 = lags.iter().map(|(weight, _)| weight).sum();
            lags.iter().map(|&(weight, tau_s)| Part { part: creep * weight / sum, tau_s }).collect::<Vec<Part>>()
        };
        let lags = match form {
            OF_THE_REST | OF_EVERYTHING | ADDED => lags(&[(1.0, slow_s)]),
            BY_DECADES | ADDED_BY_DECADES => {
                let ratio = point.get(2).map_or(1.0, |ln_ratio| ln_ratio.exp());
                lags(&[(1.0, 0.1 * slow_s), (ratio, slow_s), (ratio * ratio, 10.0 * slow_s)])
            }
            _ => lags(&[(1.0, slow_s), (1.0, tau_s * tau_s / slow_s)]),
        };
        chain.relaxation.add_lags(&lags, matches!(form, OF_THE_REST | SPREAD));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::input::Input;
    use simulation::record::{Record, Row};

    /// Beside a hysteresis of another form, creep of 1.26 time constants was named instead of a gain error.
    #[test]
    fn creep_that_is_added_with_the_time_constant_of_the_response_is_a_gain_error() {
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: 0.0, measured: Some(0.0) };
        let data = Data::new(&Record { name: String::new(), rows: (0..200).map(row).collect() }, Input::Hold);
        let is_gain = |form: usize, times: f64| {
            SecondRelaxation.is_another_cause(form, &[0.2, (times * REFERENCE_TIME_CONSTANT_S).ln()], &data, 1.0)
        };
        assert!(is_gain(ADDED, 1.26) && !is_gain(ADDED, 1.6) && !is_gain(OF_EVERYTHING, 1.26));
    }
}
