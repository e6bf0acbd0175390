//! One law of the set: its description, its true names, and how a record of it is drawn.

use std::fmt::{self, Debug};

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simulation::record::Record;

use crate::noise::Noise;
use crate::out_of_model::chain::{Chain, paper};
use crate::record::LabelledRecord;
use crate::schedule::{Kind, Sampling, Schedule};
use crate::sensor::Readings;

/// Integration steps per row.
pub(super) const STEPS: usize = 60;
/// Number of rows of a record.
const ROWS: usize = 2401;

/// A clock that writes time stamps: from the true time of a row to the written one, both in s.
pub type Clock = Box<dyn FnMut(f64) -> f64>;

/// A law, with the cause codes that are true of it. They were fixed before the first diagnosis.
#[derive(Clone, Copy)]
pub struct Law {
    /// Name of the law.
    pub name: &'static str,
    /// Cause codes that are correct as first finding; without one the spring is the paper's and no finding is correct.
    pub first: &'static [&'static str],
    /// Cause codes that are true in addition to a correct first one.
    pub also: &'static [&'static str],
    /// True if `consistent` is correct too, because the law changes the noise only.
    pub or_none: bool,
    /// Equation of the law; x is the voltage over 500 V.
    pub law: &'static str,
    /// Literature source of the law.
    pub source: &'static str,
    /// True if the law is visible after voltage steps only, not in a slow sweep.
    pub needs_steps: bool,
    /// True if half of the full scale is subtracted from the commands after the initial rest, so that they have both signs.
    pub bipolar: bool,
    /// Builds the law with random values.
    pub build: fn(&mut Draw) -> Chain,
    /// Builds the clock of the time stamps, if it is not the true one.
    pub clock: Option<fn(&mut Draw) -> Clock>,
}

/// The paper's spring, read as it is: the values of a law that it does not state itself.
pub(super) const PLAIN: Law = Law {
    name: "",
    first: &[],
    also: &[],
    or_none: false,
    law: "",
    source: "",
    needs_steps: false,
    bipolar: false,
    build: |_| Chain::of(paper()),
    clock: None,
};

impl Debug for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

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
}

impl Draw {
    /// A random number between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    /// A random number between `low` and `high` times the size of the effect.
    pub fn sized(&mut self, low: f64, high: f64) -> f64 {
        self.size * self.between(low, high)
    }

    /// A random number between `low` and `high` times the size of the effect, with random sign.
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

impl Law {
    /// A record with this law alone in it, as simulated and as written, and 0.2 % white noise.
    ///
    /// Its list of effects is empty, because effects have other forms; its `expected` readings are those before the sensor.
    pub fn draw(&self, seed: u64) -> (LabelledRecord, Record) {
        self.at(seed, 1.0, STEPS)
    }

    /// The same record with the effect at another size and another number of integration steps per row.
    pub(super) fn at(&self, seed: u64, size: f64, steps: usize) -> (LabelledRecord, Record) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let schedule = self.schedule(&mut random);
        let noise = Noise::white(0.2);
        let mut of_noise = ChaCha8Rng::seed_from_u64(seed);
        of_noise.set_stream(1);
        let rows = noise.draw(&mut of_noise, ROWS);
        let (duration_s, every_s, full_v) = (schedule.duration_s(), schedule.every_s(), schedule.full_v());
        let mut draw = Draw { random, size, duration_s, every_s, full_v };
        let mut chain = (self.build)(&mut draw);
        let expected = chain.stiffness(&schedule, steps);
        let noisy = expected.iter().zip(&rows).map(|(y, noise)| y + noise);
        let read = chain.read(&schedule, noisy);
        let readings = Readings { read, expected, limit: None, outliers: 0 };
        let hidden = LabelledRecord { schedule, effects: Vec::new(), noise, seed, readings };
        let mut written = hidden.record();
        if let Some(clock) = self.clock {
            let mut clock = clock(&mut draw);
            written.rows.iter_mut().for_each(|row| row.time_s = (clock(row.time_s) * 1e9).round() / 1e9);
        }
        (hidden, written)
    }

    fn schedule(&self, random: &mut ChaCha8Rng) -> Schedule {
        let sampling = Sampling::draw(random, ROWS, false);
        let full_v = if random.random_bool(0.2) { 700.0 } else { 500.0 };
        let kinds: Vec<Kind> =
            Kind::ALL.into_iter().filter(|&kind| !(self.needs_steps && kind == Kind::Sweep)).collect();
        let kind = *kinds.choose(random).expect("at least three kinds are left");
        let mut schedule = Schedule::draw(random, kind, sampling, full_v);
        if self.bipolar {
            let rest = schedule.voltage_v.iter().take_while(|&&v| v == 0.0).count();
            schedule.voltage_v[rest..].iter_mut().for_each(|v| *v -= 0.5 * full_v);
        }
        schedule
    }
}
