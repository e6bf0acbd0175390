//! The out-of-model test set: laws that the diagnosis does not model, from the literature on piezoelectric and
//! electroactive actuators, amplifiers and converters.
//!
//! In: a form and a seed. Out: a [`LabelledRecord`](super::LabelledRecord) with that law in it. Before any diagnosis,
//! each form states the names that are correct for it: its cause, causes that are equally correct in its place
//! ([`Form::or`]), and causes that are true in addition ([`Form::also`]). Sizes are those of
//! [`full_size`](super::full_size); schedules and noise are those of the other parts of the campaign.
//!
//! | module | contents |
//! | --- | --- |
//! | [`form`] | one law with its names, and how a record of it is drawn |
//! | [`draw`] | random values of a law |
//! | [`chain`] | the spring as stages between command and reading, and a record of it |
//! | [`amplifier`] | forms of delay, limit, slew |
//! | [`static_response`] | forms of static nonlinearity, hysteresis |
//! | [`relaxation`], [`leakage`] | forms of share, time constants, creep; of leakage |
//! | [`drift_resonance`] | forms of drift, resonance |
//! | [`converter`], [`disturbance`] | forms of saturation, quantisation; of hum, offset, outliers |

pub mod amplifier;
pub mod chain;
pub mod converter;
pub mod disturbance;
pub mod draw;
pub mod drift_resonance;
pub mod form;
pub mod leakage;
pub mod relaxation;
pub mod static_response;

use self::form::Form;

/// All forms, in the order of [`Cause::ALL`](super::Cause::ALL).
pub fn all() -> Vec<Form> {
    let parts: [&[Form]; 7] = [
        &amplifier::FORMS,
        &static_response::FORMS,
        &relaxation::FORMS,
        &leakage::FORMS,
        &drift_resonance::FORMS,
        &converter::FORMS,
        &disturbance::FORMS,
    ];
    let mut forms = parts.concat();
    forms.sort_by_key(|form| form.cause);
    forms
}

#[cfg(test)]
mod tests {
    use super::form::STEPS;
    use super::*;
    use crate::spring::Spring;

    fn furthest(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn names_are_unique_and_every_form_exceeds_the_noise() {
        let forms = all();
        for (index, form) in forms.iter().enumerate() {
            assert!(forms[..index].iter().all(|other| other.name != form.name), "{}", form.name);
            assert!(form.is_named(form.cause.name()) && !form.or.contains(&form.cause));
            for seed in 50..52 {
                let hidden = form.draw(seed);
                let none = form.record(seed, None, STEPS);
                let shown = furthest(&hidden.readings.read, &none.readings.read);
                assert!((3.0..1500.0).contains(&shown), "{} shows {shown} V, seed {seed}", form.name);
                assert!(hidden.readings.read.iter().all(|y| y.is_finite()));
            }
        }
    }

    #[test]
    fn finer_time_steps_change_less_than_1_v() {
        for form in all() {
            let [coarse, fine] = [STEPS, 3 * STEPS].map(|steps| form.record(60, Some(form.build), steps));
            let apart = furthest(&coarse.readings.expected, &fine.readings.expected);
            assert!(apart < 1.0, "{}: {apart} V", form.name);
        }
    }

    #[test]
    fn chain_of_the_papers_stage_equals_the_papers_spring() {
        let hidden = all()[0].record(70, None, STEPS);
        let spring = Spring::default().run(&hidden.schedule, 20);
        assert!(furthest(&hidden.readings.expected, &spring) < 0.05);
    }
}
