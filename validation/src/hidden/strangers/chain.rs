//! The spring as stages in a row, each a function of what the stage before it puts out, and of time.
//!
//! A row's voltage is held until the next row; its stiffness is read just after it.

use std::fmt::{self, Debug};

use crate::hidden::physics::{SHARE, TAU_S};
use crate::hidden::schedule::Schedule;

/// When a stage is asked.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Since the first row, in s.
    pub t: f64,
    /// Since it was last asked, in s; 0 just after a command.
    pub dt: f64,
}

/// What is put in, in V, to what comes out, in V.
pub type Stage = Box<dyn FnMut(f64, Now) -> f64>;

/// From command to stiffness, and from stiffness to reading.
#[derive(Default)]
pub struct Chain {
    spring: Vec<Stage>,
    sensor: Vec<Stage>,
}

impl Chain {
    /// One stage is the whole spring.
    pub fn of(stage: Stage) -> Self {
        Self { spring: vec![stage], sensor: Vec::new() }
    }

    /// The paper's spring behind a stage of the amplifier, or of what the spring settles at.
    pub fn before(stage: Stage) -> Self {
        Self { spring: vec![stage, paper()], sensor: Vec::new() }
    }

    /// The paper's spring, then a stage that changes its response.
    pub fn after(stage: Stage) -> Self {
        Self { spring: vec![paper(), stage], sensor: Vec::new() }
    }

    /// The paper's spring, and beside it `part` of another response to the voltage.
    pub fn beside(part: f64, mut other: Spectrum) -> Self {
        let mut paper = paper();
        Self::of(Box::new(move |v, now| paper(v, now) + part * other.follow(v, now.dt)))
    }

    /// The paper's spring, its noisy readings changed by a stage.
    pub fn reading(stage: Stage) -> Self {
        Self { spring: vec![paper()], sensor: vec![stage] }
    }

    /// Just after every row's command, with `steps` time steps a row.
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

    /// What the sensor makes of a noisy stiffness, row by row.
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

/// y = s v + (1 - s) w, dw/dt = (v - w)/tau.
pub fn paper() -> Stage {
    let mut w = Spectrum::one(TAU_S);
    Box::new(move |v, now| SHARE * v + (1.0 - SHARE) * w.follow(v, now.dt))
}

/// One exponential that follows its input, which changes linearly during a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lag {
    /// Where it is.
    pub at: f64,
    last: f64,
}

impl Lag {
    /// After `dt` s with a time constant of `tau_s`.
    pub fn follow(&mut self, input: f64, tau_s: f64, dt: f64) -> f64 {
        let middle = 0.5 * (self.last + input);
        self.last = input;
        self.at += (middle - self.at) * -(-dt / tau_s).exp_m1();
        self.at
    }
}

/// Several exponentials side by side: sum weight_i (1 - exp(-t/tau_i)) after a step.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Weight, time constant in s.
    parts: Vec<(f64, f64, Lag)>,
}

impl Spectrum {
    /// A single one of weight 1.
    pub fn one(tau_s: f64) -> Self {
        Self::new([(1.0, tau_s)])
    }

    /// Of weights and time constants in s.
    pub fn new(parts: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { parts: parts.into_iter().map(|(weight, tau_s)| (weight, tau_s, Lag::default())).collect() }
    }

    /// Evenly over the logarithm of tau between two times, by `density` of tau: integral density(tau) d ln tau.
    pub fn over(low_s: f64, high_s: f64, density: impl Fn(f64) -> f64) -> Self {
        const PARTS: u32 = 60;
        let width = (high_s / low_s).ln() / f64::from(PARTS);
        let tau = |i: u32| low_s * (width * (f64::from(i) + 0.5)).exp();
        Self::new((0..PARTS).map(|i| (width * density(tau(i)), tau(i))))
    }

    /// With one more part.
    pub fn and(mut self, weight: f64, tau_s: f64) -> Self {
        self.parts.push((weight, tau_s, Lag::default()));
        self
    }

    /// Its weights add up to 1.
    pub fn normalised(mut self) -> Self {
        let sum: f64 = self.parts.iter().map(|part| part.0).sum();
        self.parts.iter_mut().for_each(|part| part.0 /= sum);
        self
    }

    /// After `dt` s more.
    pub fn follow(&mut self, input: f64, dt: f64) -> f64 {
        self.parts.iter_mut().map(|(weight, tau_s, lag)| *weight * lag.follow(input, *tau_s, dt)).sum()
    }
}
