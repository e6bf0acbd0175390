//! One law of the out-of-model test set: its description, its names, and how a record of it is drawn.

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::chain::{Chain, paper};
use crate::cause::Cause;
use crate::noise::Noise;
use crate::record::LabelledRecord;
use crate::schedule::{Kind, Sampling, Schedule};
use crate::sensor::Readings;

/// Integration steps per row.
pub(super) const STEPS: usize = 60;
/// Number of rows of a record.
const ROWS: usize = 2401;

/// One law by which a cause may appear.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Cause of the law: the correct first name.
    pub cause: Cause,
    /// Name of the form.
    pub name: &'static str,
    /// Causes that are equally correct as first name.
    pub or: &'static [Cause],
    /// Causes that are true in addition to a correct first name.
    pub also: &'static [Cause],
    /// Equation of the law; x is the voltage over 500 V.
    pub law: &'static str,
    /// Literature source of the law.
    pub source: &'static str,
    /// Builds the law with random values.
    pub build: fn(&mut Draw) -> Chain,
}

/// Random source and scales of the record that a form is built for.
#[derive(Debug)]
pub struct Draw {
    /// Random source of the form's values.
    pub random: ChaCha8Rng,
    /// Duration of the record, in s.
    pub duration_s: f64,
    /// Mean time between two rows, in s.
    pub every_s: f64,
    /// Largest voltage, in V.
    pub full_v: f64,
    /// Largest stiffness of the paper's spring in this record, in V.
    pub top_v: f64,
}

impl Draw {
    fn new(schedule: &Schedule, random: ChaCha8Rng) -> Self {
        let top_v = Chain::of(paper()).stiffness(schedule, STEPS).into_iter().fold(0.0, f64::max);
        let (duration_s, every_s, full_v) = (schedule.duration_s(), schedule.every_s(), schedule.full_v());
        Self { random, duration_s, every_s, full_v, top_v }
    }

    /// A random number between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    /// A random number between `low` and `high` with random sign.
    pub fn signed(&mut self, low: f64, high: f64) -> f64 {
        self.sign() * self.between(low, high)
    }

    /// 1 or -1 with equal probability.
    pub fn sign(&mut self) -> f64 {
        if self.random.random_bool(0.5) { 1.0 } else { -1.0 }
    }
}

impl Form {
    /// True if the cause code `name` is correct as first finding.
    pub fn is_named(&self, name: &str) -> bool {
        self.cause.name() == name || self.or.iter().any(|cause| cause.name() == name)
    }

    /// True if the cause code `name` is correct at any place among the findings.
    pub fn is_true(&self, name: &str) -> bool {
        self.is_named(name) || self.also.iter().any(|cause| cause.name() == name)
    }

    /// A record with this law alone in it and 0.2 % white noise. Its list of effects is empty, because effects have
    /// other forms; its `expected` readings are those before the sensor.
    pub fn draw(&self, seed: u64) -> LabelledRecord {
        self.record(seed, Some(self.build), STEPS)
    }

    /// A record of the spring of `seed`, whose values are drawn for the schedule `first`, under another schedule, with 0.2 % white
    /// noise of its own seed.
    pub fn under(&self, seed: u64, first: &Schedule, schedule: &Schedule, noise_seed: u64) -> LabelledRecord {
        let mut chain = (self.build)(&mut Draw::new(first, ChaCha8Rng::seed_from_u64(seed)));
        let noise = Noise::white(0.2);
        let mut of_noise = ChaCha8Rng::seed_from_u64(noise_seed);
        of_noise.set_stream(1);
        let rows = noise.draw(&mut of_noise, schedule.time_s.len());
        let expected = chain.stiffness(schedule, STEPS);
        let noisy = expected.iter().zip(&rows).map(|(y, noise)| y + noise);
        let read = chain.read(schedule, noisy);
        let readings = Readings { read, expected, limit: None, outliers: 0 };
        LabelledRecord { schedule: schedule.clone(), effects: Vec::new(), noise, seed: noise_seed, readings }
    }

    /// The record with the law `build`; `None` gives the paper's spring on the same schedule with the same noise.
    pub(super) fn record(&self, seed: u64, build: Option<fn(&mut Draw) -> Chain>, steps: usize) -> LabelledRecord {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sampling = Sampling::draw(&mut random, ROWS, false);
        let full_v = if random.random_bool(0.2) { 700.0 } else { 500.0 };
        let steps_only = self.cause.facts().needs_steps;
        let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|&kind| !(steps_only && kind == Kind::Sweep)).collect();
        let kind = *kinds.choose(&mut random).expect("at least three kinds are left");
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
        LabelledRecord { schedule, effects: Vec::new(), noise, seed, readings }
    }
}
