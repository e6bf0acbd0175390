//! The records of [`plants`] without their plant file: gain, zero and linear dynamics are identified from the same record that is
//! diagnosed, as by `vsj diagnose --plant identify`.
//!
//! What a linear spring has is no error of one that was identified: of such a record `consistent` is right too.

use super::case::{Case, Expected};
use super::plants;
use super::subject::{Nominal, Subject};
use crate::ground_truth::Cause;

/// Causes that are values of every linear spring: they are identified, never named.
const VALUES: [Cause; 3] = [Cause::GainError, Cause::InstantaneousShare, Cause::TimeConstant];
/// Causes whose law is linear and constant in time: they are identified or named.
const LINEAR: [Cause; 5] =
    [Cause::SecondRelaxation, Cause::ChargeLeakage, Cause::Resonance, Cause::Delay, Cause::SeriesLag];

/// `count` records of each cause, and three times as many without an effect.
pub fn cases(first: u64, count: usize) -> Vec<Case> {
    plants::cases(first, count).into_iter().map(of).collect()
}

fn of(case: Case) -> Case {
    let Case { mut expected, draw, kinds, .. } = case;
    let is = |causes: &[Cause], name: &str| causes.iter().any(|cause| cause.name() == name);
    let (linear, first): (Vec<_>, Vec<_>) =
        expected.first.into_iter().partition(|name| is(&VALUES, name) || is(&LINEAR, name));
    expected.or_none |= !linear.is_empty();
    expected.also.extend(linear.into_iter().filter(|name| is(&LINEAR, name)));
    // The last kind is the number of time constants of the spring.
    if kinds.last().is_some_and(|lags| lags != "1") {
        expected.also.push(Cause::SecondRelaxation.name());
    }
    let expected = Expected { first, ..expected };
    let draw = Box::new(move |seed| Subject { nominal: Nominal::Identified, ..draw(seed) });
    Case { expected, kinds, draw, ..case }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_every_linear_spring_has_is_not_to_be_named() {
        let cases = cases(1, 1);
        let of = |group: &str| &cases.iter().find(|case| case.group == group).unwrap().expected;
        assert!(of("gain-error").first.is_empty() && of("gain-error").or_none);
        assert!(of("delay").first.is_empty() && of("delay").is_true("delay") && of("delay").or_none);
        assert!(of("hysteresis").first == ["hysteresis"] && !of("hysteresis").or_none);
        assert!(cases.iter().all(|case| (case.draw)(case.seed).nominal == Nominal::Identified));
    }
}
