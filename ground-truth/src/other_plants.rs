//! Records of other instruments than the spring, in their own units: heaters, tanks, a dryer, a kilovolt actuator, a resonator.
//!
//! Each is a few differential equations, integrated by the fourth-order Runge-Kutta method in small steps, with the noise and
//! converter of an instrument of its kind. No number is taken from a measured record.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use simulation::record::{Record, Row};
use simulation::units::{Unit, Units};

/// A record of one instrument.
#[derive(Clone, Debug)]
pub struct OtherPlant {
    /// Name of the instrument.
    pub name: &'static str,
    /// What is in the record, in words.
    pub known: &'static str,
    /// The record: time in s, command in V or in its own unit, readings in their own unit.
    pub record: Record,
    /// Units of the instrument.
    pub units: Units,
}

/// States of an instrument; unused ones are 0.
type State = [f64; 4];

/// One instrument.
struct Instrument {
    name: &'static str,
    known: &'static str,
    /// Units of time, command and reading.
    units: [&'static str; 3],
    /// Time between rows, in s, and number of rows.
    sample_s: f64,
    rows: usize,
    /// Dead time of the command, in s.
    delay_s: f64,
    /// Command in its SI unit over row and random numbers.
    command: fn(usize, &mut ChaCha8Rng, f64) -> f64,
    start: State,
    /// Derivative of the state at a command.
    rates: fn(f64, State) -> State,
    /// Reading of the state and the command.
    reading: fn(f64, State) -> f64,
    /// Standard deviation of the noise, and correlation of the noise of neighbouring rows.
    noise: (f64, f64),
    /// Step of the converter; 0 for a fine one.
    step: f64,
    /// Highest reading.
    most: f64,
}

/// Integration steps between two rows.
const STEPS: usize = 20;

/// A level that is held for a random number of rows between `shortest` and `longest`, drawn from `low` to `high`.
fn held(random: &mut ChaCha8Rng, last: f64, shortest: usize, longest: usize, low: f64, high: f64) -> f64 {
    let mean = (shortest + longest) as f64 / 2.0;
    if last.is_nan() || random.random_range(0.0..1.0) < 1.0 / mean { random.random_range(low..high) } else { last }
}

/// A multisine with random phases, which depend on the harmonic alone, so that every row has the same.
fn multisine(row: usize, period: usize, harmonics: std::ops::Range<usize>) -> f64 {
    let count = harmonics.len() as f64;
    let phase = |k: usize| TAU * ((k * k) as f64 * 0.618_033_988_75).fract();
    harmonics.map(|k| (TAU * (k * row % period) as f64 / period as f64 + phase(k)).sin()).sum::<f64>()
        * (2.0 / count).sqrt()
}

const INSTRUMENTS: [Instrument; 6] = [
    Instrument {
        name: "heater",
        known: "two lags in series (150 s and 18 s), starts at ambient, converter steps of 0.25 degC",
        units: ["s", "%", "degC"],
        sample_s: 3.0,
        rows: 600,
        delay_s: 0.0,
        command: |_, random, last| held(random, last, 40, 120, 0.0, 80.0),
        start: [22.3, 22.3, 0.0, 0.0],
        rates: |u, [heater, sensor, ..]| [(22.3 + 0.62 * u - heater) / 150.0, (heater - sensor) / 18.0, 0.0, 0.0],
        reading: |_, [_, sensor, ..]| sensor,
        noise: (0.05, 0.0),
        step: 0.25,
        most: f64::MAX,
    },
    Instrument {
        name: "furnace",
        known: "negative gain, delay of 32 s, one lag of 40 s, coloured noise; the command changes at every row",
        units: ["s", "l/min", "%"],
        sample_s: 10.0,
        rows: 300,
        delay_s: 32.0,
        command: |row, random, last| {
            let noise: f64 = StandardNormal.sample(random);
            if row == 0 { 0.0 } else { 0.9 * last + 0.45 * noise }
        },
        start: [0.0; 4],
        rates: |u, [burnt, ..]| [(u - burnt) / 40.0, 0.0, 0.0, 0.0],
        reading: |_, [burnt, ..]| 53.0 - 1.8 * burnt,
        noise: (0.25, 0.8),
        step: 0.0,
        most: f64::MAX,
    },
    Instrument {
        name: "dryer",
        known: "delay of 0.22 s, lags of 0.3 s and 0.12 s in series, binary command, mean not 0",
        units: ["s", "V", "V"],
        sample_s: 0.08,
        rows: 1000,
        delay_s: 0.22,
        command: |_, random, last| {
            if last.is_nan() || random.random_range(0.0..1.0) < 0.2 {
                if random.random_range(0.0..1.0) < 0.5 { 3.0 } else { 6.0 }
            } else {
                last
            }
        },
        start: [4.5, 4.5, 0.0, 0.0],
        rates: |u, [air, wire, ..]| [(u - air) / 0.3, (air - wire) / 0.12, 0.0, 0.0],
        reading: |_, [_, wire, ..]| 1.1 + 0.9 * wire,
        noise: (0.03, 0.5),
        step: 0.0,
        most: f64::MAX,
    },
    Instrument {
        name: "tanks",
        known: "two tanks in series, outflow with the square root of the level, start filled, sensor stops at 9 V",
        units: ["s", "V", "V"],
        sample_s: 5.0,
        rows: 1000,
        delay_s: 0.0,
        command: |row, _, _| 3.0 + 1.1 * multisine(row, 1000, 1..12),
        start: [4.0, 5.0, 0.0, 0.0],
        rates: |u, [upper, lower, ..]| {
            let out = |level: f64| 0.045 * level.max(0.0).sqrt();
            [0.03 * u.max(0.0) - out(upper), out(upper) - out(lower), 0.0, 0.0]
        },
        reading: |_, [_, lower, ..]| lower,
        noise: (0.03, 0.0),
        step: 0.0,
        most: 9.0,
    },
    Instrument {
        name: "kilovolt actuator",
        known: "strain with the square of the voltage, whose sign alternates; part of it creeps with 0.9 s; lag of 12 ms",
        units: ["ms", "kV", "mm"],
        sample_s: 4e-3,
        rows: 2000,
        delay_s: 0.0,
        command: |row, _, _| {
            let height = [2.0, 5.0, 3.5, 6.0, 1.0][row / 100 % 5];
            if row % 100 < 50 { 1e3 * height * if row / 100 % 2 == 0 { 1.0 } else { -1.0 } } else { 0.0 }
        },
        start: [0.0; 4],
        rates: |u, [quick, slow, ..]| {
            let strain = (u * 1e-3) * (u * 1e-3);
            [(strain - quick) / 12e-3, (strain - slow) / 0.9, 0.0, 0.0]
        },
        reading: |_, [quick, slow, ..]| -3.2 + 0.06 * (0.8 * quick + 0.2 * slow),
        noise: (0.004, 0.0),
        step: 0.0,
        most: f64::MAX,
    },
    Instrument {
        name: "resonator",
        known: "resonance at 60 Hz with damping 0.04 and a hardening spring, multisine",
        units: ["s", "V", "V"],
        sample_s: 1.5e-3,
        rows: 2400,
        delay_s: 0.0,
        command: |row, _, _| 0.02 * multisine(row, 2400, 5..480),
        start: [0.0; 4],
        rates: |u, [x, v, ..]| {
            let omega = TAU * 60.0;
            [v, omega * omega * (u - x - 60.0 * x * x * x) - 2.0 * 0.04 * omega * v, 0.0, 0.0]
        },
        reading: |_, [x, ..]| x,
        noise: (2e-4, 0.0),
        step: 0.0,
        most: f64::MAX,
    },
];

/// All instruments, each with the noise and command of a seed.
pub fn all(seed: u64) -> Vec<OtherPlant> {
    INSTRUMENTS.iter().enumerate().map(|(index, instrument)| instrument.draw(seed + 1000 * index as u64)).collect()
}

impl Instrument {
    fn draw(&self, seed: u64) -> OtherPlant {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut last = f64::NAN;
        let commands: Vec<f64> = (0..self.rows)
            .map(|row| {
                last = (self.command)(row, &mut random, last);
                last
            })
            .collect();
        let at = |time_s: f64| commands[((time_s - self.delay_s) / self.sample_s + 1e-9).max(0.0) as usize];
        let (mut state, mut coloured, step_s) = (self.start, 0.0, self.sample_s / STEPS as f64);
        let mut rows = Vec::new();
        for (row, &voltage_v) in commands.iter().enumerate() {
            let time_s = self.sample_s * row as f64;
            let (sigma, memory) = self.noise;
            let white: f64 = StandardNormal.sample(&mut random);
            coloured = memory * coloured + (1.0 - memory * memory).sqrt() * white;
            let read = ((self.reading)(at(time_s), state) + sigma * coloured).min(self.most);
            let read = if self.step > 0.0 { (read / self.step).round() * self.step } else { read };
            rows.push(Row { line: row + 2, time_s, voltage_v, measured: Some(read) });
            for step in 0..STEPS {
                let u = at(time_s + (step as f64 + 0.5) * step_s);
                state = self.integrated(u, state, step_s);
            }
        }
        let [time, voltage, reading] = self.units;
        let units = Units {
            time: Unit::of_time(time).expect("a unit of time"),
            voltage: Unit::of_voltage(voltage),
            reading: reading.into(),
        };
        let record = Record { name: self.name.into(), rows };
        OtherPlant { name: self.name, known: self.known, record, units }
    }

    /// One Runge-Kutta step of `h` s at a constant command.
    fn integrated(&self, u: f64, x: State, h: f64) -> State {
        let along = |rates: State, h: f64| std::array::from_fn(|i| x[i] + h * rates[i]);
        let k1 = (self.rates)(u, x);
        let k2 = (self.rates)(u, along(k1, h / 2.0));
        let k3 = (self.rates)(u, along(k2, h / 2.0));
        let k4 = (self.rates)(u, along(k3, h));
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instrument_gives_a_record_that_moves_far_beyond_its_noise() {
        for (plant, instrument) in all(1).iter().zip(&INSTRUMENTS) {
            let read: Vec<f64> = plant.record.rows.iter().filter_map(|row| row.measured).collect();
            let mean = read.iter().sum::<f64>() / read.len() as f64;
            let spread = (read.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / read.len() as f64).sqrt();
            assert!(read.len() == instrument.rows && read.iter().all(|y| y.is_finite()), "{}", plant.name);
            assert!(spread > 5.0 * instrument.noise.0, "{}: {spread}", plant.name);
            assert_eq!(plant.record.rows, all(1).iter().find(|it| it.name == plant.name).unwrap().record.rows);
        }
    }
}
