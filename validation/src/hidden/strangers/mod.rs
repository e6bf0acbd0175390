//! Forms of the causes that `vsj diagnose` was not made with: other laws, from the literature on piezo and electroactive
//! actuators, amplifiers and converters.
//!
//! Each says before any diagnosis which names are right for it: its cause, names that would be as right in the cause's
//! place ([`Form::or`]), and names that are true beside it ([`Form::beside`]). Sizes are as plain as in
//! [`plain`](super::plain), schedules and noise are those of the other parts of the campaign.
//!
//! | module | forms of |
//! | --- | --- |
//! | [`amplifier`] | delay, limit, slew |
//! | [`settled`] | static nonlinearity, hysteresis |
//! | [`relaxing`], [`leaking`] | share, time constants, creep; leakage |
//! | [`response`] | drift, resonance |
//! | [`converter`], [`disturbed`] | saturation, quantisation; hum, offset, outliers |
//! | [`chain`] | the spring as stages between command and reading |

pub mod amplifier;
pub mod chain;
pub mod converter;
pub mod disturbed;
pub mod leaking;
pub mod relaxing;
pub mod response;
pub mod settled;

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use self::chain::{Chain, paper};
use super::cause::Cause;
use super::noise::Noise;
use super::reading::Readings;
use super::record::Hidden;
use super::schedule::{Kind, Sampling, Schedule};

/// Time steps a row.
const STEPS: usize = 60;
/// Rows of a record.
const ROWS: usize = 2401;

/// One way in which a cause may show.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// The name that is right.
    pub cause: Cause,
    /// Of the form.
    pub name: &'static str,
    /// Names that are as right.
    pub or: &'static [Cause],
    /// Names that are true of it as well, beside one of these.
    pub beside: &'static [Cause],
    /// Its equation; x is the voltage over 500 V.
    pub law: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// A random one.
    pub build: fn(&mut Draw) -> Chain,
}

/// What a form is drawn for.
#[derive(Debug)]
pub struct Draw {
    /// Of the form's values.
    pub random: ChaCha8Rng,
    /// Of the record, in s.
    pub duration_s: f64,
    /// Typical time between two rows, in s.
    pub every_s: f64,
    /// The highest voltage, in V.
    pub full_v: f64,
    /// The largest stiffness of the paper's spring in this record, in V.
    pub top_v: f64,
}

impl Draw {
    fn new(schedule: &Schedule, random: ChaCha8Rng) -> Self {
        let top_v = Chain::of(paper()).stiffness(schedule, STEPS).into_iter().fold(0.0, f64::max);
        let (duration_s, every_s, full_v) = (schedule.duration_s(), schedule.every_s(), schedule.full_v());
        Self { random, duration_s, every_s, full_v, top_v }
    }

    /// A number between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    /// The same with either sign.
    pub fn signed(&mut self, low: f64, high: f64) -> f64 {
        self.sign() * self.between(low, high)
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.random.random_bool(0.5) { 1.0 } else { -1.0 }
    }
}

/// All of them, in the order of [`Cause::ALL`].
pub fn all() -> Vec<Form> {
    let parts: [&[Form]; 7] = [
        &amplifier::FORMS,
        &settled::FORMS,
        &relaxing::FORMS,
        &leaking::FORMS,
        &response::FORMS,
        &converter::FORMS,
        &disturbed::FORMS,
    ];
    let mut forms = parts.concat();
    forms.sort_by_key(|form| form.cause);
    forms
}

impl Form {
    /// `name` is right for the first finding.
    pub fn is_named(&self, name: &str) -> bool {
        self.cause.name() == name || self.or.iter().any(|cause| cause.name() == name)
    }

    /// `name` is true of it, at any place among the findings.
    pub fn is_true(&self, name: &str) -> bool {
        self.is_named(name) || self.beside.iter().any(|cause| cause.name() == name)
    }

    /// A record with nothing but this in it, and 0.2 % white noise. Its list of effects is empty, for those have other forms,
    /// and its `expected` readings are as before the sensor.
    pub fn draw(&self, seed: u64) -> Hidden {
        self.record(seed, Some(self.build), STEPS)
    }

    /// `build`: none makes the record of the paper's spring, on the same schedule with the same noise.
    fn record(&self, seed: u64, build: Option<fn(&mut Draw) -> Chain>, steps: usize) -> Hidden {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sampling = Sampling::draw(&mut random, ROWS, false);
        let full_v = if random.random_bool(0.2) { 700.0 } else { 500.0 };
        let steps_only = self.cause.facts().needs_steps;
        let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|&kind| !(steps_only && kind == Kind::Sweep)).collect();
        let kind = *kinds.choose(&mut random).expect("three at least");
        let schedule = Schedule::draw(&mut random, kind, sampling, full_v);
        let noise = Noise::white(0.2);
        let mut of_noise = ChaCha8Rng::seed_from_u64(seed);
        of_noise.set_stream(1);
        let rows = noise.draw(&mut of_noise, ROWS);
        let mut chain = match build {
            Some(build) => build(&mut Draw::new(&schedule, random)),
            None => Chain::of(paper()),
        };
        let expected = chain.stiffness(&schedule, steps);
        let noisy = expected.iter().zip(&rows).map(|(y, noise)| y + noise);
        let read = chain.read(&schedule, noisy);
        let readings = Readings { read, expected, limit: None, outliers: 0 };
        Hidden { schedule, effects: Vec::new(), noise, seed, readings }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::spring::Spring;

    fn furthest(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn names_are_told_apart_and_every_form_shows() {
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
    fn finer_time_steps_change_little() {
        for form in all() {
            let [coarse, fine] = [STEPS, 3 * STEPS].map(|steps| form.record(60, Some(form.build), steps));
            let apart = furthest(&coarse.readings.expected, &fine.readings.expected);
            assert!(apart < 1.0, "{}: {apart} V", form.name);
        }
    }

    #[test]
    fn the_papers_chain_is_the_papers_spring() {
        let hidden = all()[0].record(70, None, STEPS);
        let spring = Spring::default().run(&hidden.schedule, 20);
        assert!(furthest(&hidden.readings.expected, &spring) < 0.05);
    }
}
