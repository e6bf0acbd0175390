//! A spring with hidden effects and its sensor, step by step: what a controller closes its loop around.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::effect::Effect;
use super::moving::Moving;
use super::noise::Noise;
use super::reading::{Reading, Sensor};
use super::spring::Spring;

/// Longest time step in s: 80 of them make a period of the fastest resonance.
const STEP_S: f64 = 1e-3;

/// A spring behind its amplifier, and the sensor beside it. The same arguments and calls make the same numbers, to the
/// bit.
#[derive(Clone, Debug)]
pub struct Live {
    moving: Moving,
    sensor: Sensor,
    noise: Vec<f64>,
    readings: usize,
    random: ChaCha8Rng,
}

impl Live {
    /// At rest at 0 s, without voltage.
    ///
    /// `top_v` is the largest stiffness that the sensor is to see (its saturation is a part of that), in V. The noise is
    /// drawn for `readings` readings; after them it begins anew.
    pub fn new(effects: &[Effect], noise: Noise, seed: u64, top_v: f64, readings: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Streams of their own: noise is the same whatever is hidden.
        random.set_stream(1);
        let noise = noise.draw(&mut random, readings);
        random.set_stream(2);
        let moving = Moving::new(Spring::with(effects), 0.0);
        Self { moving, sensor: Sensor::new(effects, top_v), noise, readings: 0, random }
    }

    /// Since the start, in s.
    pub fn now_s(&self) -> f64 {
        self.moving.now_s()
    }

    /// The amplifier is told a voltage, which it holds until it is told another one.
    pub fn command(&mut self, voltage_v: f64) {
        self.moving.command(voltage_v);
    }

    /// The true stiffness now, with what was just commanded, in V.
    pub fn stiffness(&mut self) -> f64 {
        self.moving.stiffness()
    }

    /// What the sensor makes of it; each call is another reading.
    pub fn read(&mut self) -> Reading {
        let noise = self.noise.get(self.readings % self.noise.len().max(1)).copied().unwrap_or(0.0);
        self.readings += 1;
        let (stiffness, now) = (self.moving.stiffness(), self.moving.now_s());
        self.sensor.read(stiffness, now, noise, &mut self.random)
    }

    /// Lets `dt_s` pass.
    pub fn pass(&mut self, dt_s: f64) {
        let until = self.moving.now_s() + dt_s;
        self.moving.go_to(until, STEP_S);
    }

    /// Commands a voltage and holds it for `dt_s`: the true stiffness and the reading of its beginning.
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
    use crate::hidden::cause::Cause;
    use crate::hidden::record::Recipe;

    /// Held row by row, it is the record, but for its finer time steps and a sensor told of the largest stiffness before.
    #[test]
    fn step_by_step_is_the_record() {
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
                // A reading beside the edge of a coarse step may fall to its other side.
                if cause != Cause::Quantisation {
                    assert!((reading.read - readings.read[k]).abs() < 0.02, "{cause}, row {k}");
                }
            }
        }
    }
}
