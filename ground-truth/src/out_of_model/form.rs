//! One law of the out-of-model test set: its description, its names, and how a record of it is drawn.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::chain::{Chain, paper};
use super::draw::Draw;
use crate::cause::Cause;
use crate::record::LabelledRecord;
use crate::schedule::Schedule;

/// Integration steps per row.
pub(crate) const STEPS: usize = 60;
/// Number of rows of a record.
pub(crate) const ROWS: usize = 2401;

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

impl Form {
    /// True if the cause code `name` is correct as first finding.
    pub fn is_named(&self, name: &str) -> bool {
        self.cause.name() == name || self.or.iter().any(|cause| cause.name() == name)
    }

    /// True if the cause code `name` is correct at any place among the findings.
    pub fn is_true(&self, name: &str) -> bool {
        self.is_named(name) || self.also.iter().any(|cause| cause.name() == name)
    }

    /// A record with this law alone in it, in 0.2 % white noise.
    pub fn draw(&self, seed: u64) -> LabelledRecord {
        self.record(seed, Some(self.build), STEPS)
    }

    /// A record of the spring of `seed`, whose values are drawn for the schedule `first`, under another schedule, with 0.2 % white
    /// noise of its own seed.
    pub fn under(&self, seed: u64, first: &Schedule, schedule: &Schedule, noise_seed: u64) -> LabelledRecord {
        let mut chain = (self.build)(&mut Draw::new(first, ChaCha8Rng::seed_from_u64(seed), 1.0));
        chain.record(schedule.clone(), noise_seed, STEPS)
    }

    /// The record with the law `build`; `None` gives the paper's spring on the same schedule with the same noise.
    pub(super) fn record(&self, seed: u64, build: Option<fn(&mut Draw) -> Chain>, steps: usize) -> LabelledRecord {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let schedule = Schedule::draw_any(&mut random, ROWS, false, self.cause.facts().needs_steps);
        let mut chain = match build {
            Some(build) => build(&mut Draw::new(&schedule, random, 1.0)),
            None => Chain::of(paper()),
        };
        chain.record(schedule, seed, steps)
    }
}
