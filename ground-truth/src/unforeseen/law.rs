//! One law of the set: its description, its true names, and how a record of it is drawn.

use std::fmt::{self, Debug};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use simulation::record::Record;

use crate::out_of_model::chain::{Chain, paper};
use crate::out_of_model::draw::Draw;
use crate::out_of_model::form::{ROWS, STEPS};
use crate::record::LabelledRecord;
use crate::schedule::Schedule;

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
pub(crate) const PLAIN: Law = Law {
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

impl Law {
    /// A record with this law alone in it, as simulated and as written, in 0.2 % white noise.
    pub fn draw(&self, seed: u64) -> (LabelledRecord, Record) {
        self.at(seed, 1.0, STEPS)
    }

    /// The record of [`draw`](Self::draw) with the effect at another size and with `steps` integration steps per row.
    pub(crate) fn at(&self, seed: u64, size: f64, steps: usize) -> (LabelledRecord, Record) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let schedule = self.schedule(&mut random);
        let mut draw = Draw::new(&schedule, random, size);
        let hidden = (self.build)(&mut draw).record(schedule, seed, steps);
        let mut written = hidden.record();
        if let Some(clock) = self.clock {
            let mut clock = clock(&mut draw);
            written.rows.iter_mut().for_each(|row| row.time_s = (clock(row.time_s) * 1e9).round() / 1e9);
        }
        (hidden, written)
    }

    fn schedule(&self, random: &mut ChaCha8Rng) -> Schedule {
        let mut schedule = Schedule::draw_any(random, ROWS, false, self.needs_steps);
        if self.bipolar {
            let rest = schedule.voltage_v.iter().take_while(|&&v| v == 0.0).count();
            let half_v = 0.5 * schedule.full_v();
            schedule.voltage_v[rest..].iter_mut().for_each(|v| *v -= half_v);
        }
        schedule
    }
}
