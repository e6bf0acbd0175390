//! A spring with known effects and its sensor, step by step, for a controller in closed loop.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::effect::Effect;
use super::integrator::Integrator;
use super::noise::Noise;
use super::sensor::{Reading, Sensor};
use super::spring::Spring;

/// Longest integration step, in s: an eightieth of the period of the fastest resonance.
const STEP_S: f64 = 1e-3;

/// A spring with its amplifier and its sensor. The same arguments and calls give the same numbers, to the bit.
#[derive(Clone, Debug)]
pub struct Live {
    moving: Integrator,
    sensor: Sensor,
    noise: Vec<f64>,
    readings: usize,
    random: ChaCha8Rng,
}

impl Live {
    /// A spring at rest at 0 s and 0 V.
    ///
    /// `top_v` is the largest stiffness that the sensor will see, in V; the limit of a saturating sensor is a fraction
    /// of it. The noise is drawn for `readings` readings and repeats after them.
    pub fn new(effects: &[Effect], noise: Noise, seed: u64, top_v: f64, readings: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Random streams of their own: the noise does not depend on the effects.
        random.set_stream(1);
        let noise = noise.draw(&mut random, readings);
        random.set_stream(2);
        let moving = Integrator::new(Spring::with(effects), 0.0);
        Self { moving, sensor: Sensor::new(effects, top_v), noise, readings: 0, random }
    }

    /// Time since the start, in s.
    pub fn now_s(&self) -> f64 {
        self.moving.now_s()
    }

    /// Commands a voltage, in V, which the amplifier holds until the next command.
    pub fn command(&mut self, voltage_v: f64) {
        self.moving.command(voltage_v);
    }

    /// True stiffness at the current time, after the last command, in V.
    pub fn stiffness(&mut self) -> f64 {
        self.moving.stiffness()
    }

    /// The sensor's reading of the current stiffness; each call draws new noise.
    pub fn read(&mut self) -> Reading {
        let noise = self.noise.get(self.readings % self.noise.len().max(1)).copied().unwrap_or(0.0);
        self.readings += 1;
        let (stiffness, now) = (self.moving.stiffness(), self.moving.now_s());
        self.sensor.read(stiffness, now, noise, &mut self.random)
    }

    /// Integrates over `dt_s`, in s.
    pub fn pass(&mut self, dt_s: f64) {
        let until = self.moving.now_s() + dt_s;
        self.moving.go_to(until, STEP_S);
    }

    /// Commands a voltage, in V, and holds it for `dt_s`, in s; returns true stiffness and reading just after the
    /// command.
    pub fn hold(&mut self, voltage_v: f64, dt_s: f64) -> (f64, Reading) {
        self.command(voltage_v);
        let now = (self.stiffness(), self.read());
        self.pass(dt_s);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cause::Cause;
    use crate::record::Recipe;

    /// Equal but for the finer time steps, and a sensor that has to be given the largest stiffness in advance.
    #[test]
    fn stepping_through_a_schedule_gives_its_record() {
        for cause in Cause::ALL {
            let hidden = Recipe { rows: 600, ..Recipe::of(&[cause]) }.draw(11);
            let (rows, readings) = (hidden.schedule.time_s.len(), &hidden.readings);
            let stiffness = Spring::with(&hidden.effects).run(&hidden.schedule, 20);
            let top = stiffness.iter().copied().fold(0.0, f64::max);
            let mut live = Live::new(&hidden.effects, hidden.noise, hidden.seed, top, rows);
            let dt = hidden.schedule.time_s.windows(2).map(|pair| pair[1] - pair[0]).chain([0.0]);
            for (k, ((_, volts), dt)) in hidden.schedule.rows().zip(dt).enumerate() {
                let (truth, reading) = live.hold(volts, dt);
                assert!((truth - stiffness[k]).abs() < 0.02, "{cause}, row {k}: {truth} {}", stiffness[k]);
                // A reading near the threshold of a coarse step may be rounded to the other side.
                if cause != Cause::Quantisation {
                    assert!((reading.read - readings.read[k]).abs() < 0.02, "{cause}, row {k}");
                }
            }
        }
    }
}
