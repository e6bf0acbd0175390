//! Random values of a law, scaled to the record that it is built for.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::chain::{Chain, paper};
use crate::schedule::Schedule;

/// Random source and scales of the record that a law is built for.
#[derive(Debug)]
pub struct Draw {
    /// Random source of the law's values.
    pub random: ChaCha8Rng,
    /// Size of the effect: 1 for full size, 0 for the paper's spring.
    pub size: f64,
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
    /// The source `random`, with the scales of a record of this schedule.
    pub fn new(schedule: &Schedule, random: ChaCha8Rng, size: f64) -> Self {
        // The paper's spring is exact in a single step per row.
        let top_v = Chain::of(paper()).stiffness(schedule, 1).into_iter().fold(0.0, f64::max);
        let (duration_s, every_s, full_v) = (schedule.duration_s(), schedule.every_s(), schedule.full_v());
        Self { random, size, duration_s, every_s, full_v, top_v }
    }

    /// A random number between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    /// A random number between `low` and `high`, even in its logarithm.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// A random number between `low` and `high` times the size of the effect.
    pub fn sized(&mut self, low: f64, high: f64) -> f64 {
        self.size * self.between(low, high)
    }

    /// A random number between `low` and `high` times the size of the effect, of random sign.
    pub fn signed(&mut self, low: f64, high: f64) -> f64 {
        self.sign() * self.sized(low, high)
    }

    /// 1 or -1 with equal probability.
    pub fn sign(&mut self) -> f64 {
        if self.random.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    /// A random source of its own for a stage that draws numbers while it runs.
    pub fn fork(&mut self) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(self.random.random_range(0..u64::MAX))
    }
}
