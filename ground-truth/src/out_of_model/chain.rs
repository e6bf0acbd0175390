//! The spring as a series of stages, each a function of the preceding stage's output and of time.
//!
//! A row's voltage is held until the next row; its stiffness is read just after the command.

use std::fmt::{self, Debug};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::noise::Noise;
use crate::physics::{SHARE, TAU_S};
use crate::record::LabelledRecord;
use crate::schedule::Schedule;
use crate::sensor::Readings;

/// Time at which a stage is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Time since the first row, in s.
    pub t: f64,
    /// Time since the last evaluation, in s; 0 just after a command.
    pub dt: f64,
}

/// A stage with its state: from input to output, both in V.
pub type Stage = Box<dyn FnMut(f64, Now) -> f64>;

/// Stages from command to stiffness, and from stiffness to reading.
#[derive(Default)]
pub struct Chain {
    spring: Vec<Stage>,
    sensor: Vec<Stage>,
}

impl Chain {
    /// A spring of a single stage, from command to stiffness.
    pub fn of(stage: Stage) -> Self {
        Self { spring: vec![stage], sensor: Vec::new() }
    }

    /// The paper's spring after a stage of the amplifier or of the static response.
    pub fn before(stage: Stage) -> Self {
        Self { spring: vec![stage, paper()], sensor: Vec::new() }
    }

    /// The paper's spring followed by a stage that changes its response.
    pub fn after(stage: Stage) -> Self {
        Self { spring: vec![paper(), stage], sensor: Vec::new() }
    }

    /// The paper's spring in parallel with `part` times another response to the voltage.
    pub fn parallel(part: f64, mut other: Spectrum) -> Self {
        let mut paper = paper();
        Self::of(Box::new(move |v, now| paper(v, now) + part * other.follow(v, now.dt)))
    }

    /// The paper's spring with a stage that changes its noisy readings.
    pub fn reading(stage: Stage) -> Self {
        Self { spring: vec![paper()], sensor: vec![stage] }
    }

    /// Stiffness of every row, in V, just after the row's command; each row is integrated in `steps` time steps.
    pub fn stiffness(&mut self, schedule: &Schedule, steps: usize) -> Vec<f64> {
        let (mut before, mut command) = (0.0, 0.0);
        let start = schedule.time_s[0];
        let row = |(time, voltage)| {
            let t: f64 = time - start;
            let dt = (t - before) / steps as f64;
            for step in 1..=steps {
                through(&mut self.spring, command, Now { t: before + step as f64 * dt, dt });
            }
            (before, command) = (t, voltage);
            through(&mut self.spring, voltage, Now { t, dt: 0.0 })
        };
        schedule.rows().map(row).collect()
    }

    /// Record of this chain in 0.2 % white noise of the seed `seed`. It has no effects; its `expected` readings are those before the
    /// sensor.
    pub fn record(&mut self, schedule: Schedule, seed: u64, steps: usize) -> LabelledRecord {
        let noise = Noise::white(0.2);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(1);
        let rows = noise.draw(&mut random, schedule.time_s.len());
        let expected = self.stiffness(&schedule, steps);
        let noisy = expected.iter().zip(&rows).map(|(y, noise)| y + noise);
        let read = self.read(&schedule, noisy);
        let readings = Readings { read, expected, limit: None, outliers: 0 };
        LabelledRecord { schedule, effects: Vec::new(), noise, seed, readings }
    }

    /// Readings of a noisy stiffness, row by row, in V.
    pub fn read(&mut self, schedule: &Schedule, noisy: impl Iterator<Item = f64>) -> Vec<f64> {
        let (start, dt) = (schedule.time_s[0], schedule.every_s());
        let row = |(y, time)| through(&mut self.sensor, y, Now { t: time - start, dt });
        noisy.zip(&schedule.time_s).map(row).collect()
    }
}

impl Debug for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Chain of {} and {} stages", self.spring.len(), self.sensor.len())
    }
}

fn through(stages: &mut [Stage], value: f64, now: Now) -> f64 {
    stages.iter_mut().fold(value, |value, stage| stage(value, now))
}

/// The paper's spring as a stage: y = s v + (1 - s) w, dw/dt = (v - w)/tau.
pub fn paper() -> Stage {
    let mut w = Spectrum::one(TAU_S);
    Box::new(move |v, now| SHARE * v + (1.0 - SHARE) * w.follow(v, now.dt))
}

/// First-order lag; its input changes linearly during a time step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lag {
    /// Current output.
    pub at: f64,
    last: f64,
}

impl Lag {
    /// Output after `dt` s with the time constant `tau_s`, in s.
    pub fn follow(&mut self, input: f64, tau_s: f64, dt: f64) -> f64 {
        let middle = 0.5 * (self.last + input);
        self.last = input;
        self.at += (middle - self.at) * -(-dt / tau_s).exp_m1();
        self.at
    }
}

/// First-order lags in parallel; the step response is sum weight_i (1 - exp(-t/tau_i)).
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Weight, time constant in s and state of each lag.
    parts: Vec<(f64, f64, Lag)>,
}

impl Spectrum {
    /// A single lag of weight 1 with the time constant `tau_s`, in s.
    pub fn one(tau_s: f64) -> Self {
        Self::new([(1.0, tau_s)])
    }

    /// Lags with these weights and time constants in s.
    pub fn new(parts: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { parts: parts.into_iter().map(|(weight, tau_s)| (weight, tau_s, Lag::default())).collect() }
    }

    /// Lags with the spectrum `density` over ln tau between two times in s: integral density(tau) d ln tau.
    pub fn over(low_s: f64, high_s: f64, density: impl Fn(f64) -> f64) -> Self {
        const PARTS: u32 = 60;
        let width = (high_s / low_s).ln() / f64::from(PARTS);
        let tau = |i: u32| low_s * (width * (f64::from(i) + 0.5)).exp();
        Self::new((0..PARTS).map(|i| (width * density(tau(i)), tau(i))))
    }

    /// Adds one lag.
    pub fn and(mut self, weight: f64, tau_s: f64) -> Self {
        self.parts.push((weight, tau_s, Lag::default()));
        self
    }

    /// Scales the weights so that they add up to 1.
    pub fn normalised(mut self) -> Self {
        let sum: f64 = self.parts.iter().map(|part| part.0).sum();
        self.parts.iter_mut().for_each(|part| part.0 /= sum);
        self
    }

    /// Output after `dt` s more.
    pub fn follow(&mut self, input: f64, dt: f64) -> f64 {
        self.parts.iter_mut().map(|(weight, tau_s, lag)| *weight * lag.follow(input, *tau_s, dt)).sum()
    }
}
