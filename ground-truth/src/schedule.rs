//! Commanded voltages: random schedules that start at rest, reach full scale and return.

use std::f64::consts::TAU;

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// Times and commanded voltages; each voltage is held until the next time.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// Times of the rows, in s, increasing.
    pub time_s: Vec<f64>,
    /// Commanded voltages, in V.
    pub voltage_v: Vec<f64>,
}

/// Kinds of schedules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Stairs up and down in 4 to 10 equal steps.
    UpDown,
    /// Random levels, each held for a random time.
    Random,
    /// Triangle waves or sines of rising frequency: slow changes only.
    Sweep,
    /// Eight levels in random order, each held for a short random time.
    MultiLevel,
    /// Eight sines of random phases, from 1 to 200 periods in the record.
    Multisine,
    /// A sine of a frequency that rises by a factor of 40, logarithmically.
    Chirp,
    /// Ramps of random rates between random levels, each held for a random time.
    Ramps,
}

/// Sampling of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Number of rows.
    pub rows: usize,
    /// Mean time between two rows, in s.
    pub every_s: f64,
    /// True: time steps vary by up to 50 %, and one row in ten is missing.
    pub uneven: bool,
}

impl Sampling {
    /// Rows 0.02 to 0.2 s apart, log-uniformly distributed.
    pub fn draw(random: &mut ChaCha8Rng, rows: usize, uneven: bool) -> Self {
        Self { rows, every_s: 0.02 * 10f64.powf(random.random_range(0.0..1.0)), uneven }
    }

    pub(super) fn times(&self, random: &mut ChaCha8Rng) -> Vec<f64> {
        let mut at = 0.0;
        (0..self.rows)
            .map(|_| {
                let now = at;
                let missing = if self.uneven && random.random_bool(0.1) { 2.0 } else { 1.0 };
                let jitter = if self.uneven { random.random_range(0.5..1.5) } else { 1.0 };
                // Rounded to 1 ns, because times in a file are decimal.
                at = ((now + missing * jitter * self.every_s) * 1e9).round() / 1e9;
                now
            })
            .collect()
    }
}

impl Schedule {
    /// Time in s and voltage in V, row by row.
    pub fn rows(&self) -> impl Iterator<Item = (f64, f64)> {
        self.time_s.iter().copied().zip(self.voltage_v.iter().copied())
    }

    /// Time from the first row to the last, in s.
    pub fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }

    /// Mean time between rows, in s.
    pub fn every_s(&self) -> f64 {
        self.duration_s() / (self.time_s.len() - 1) as f64
    }

    /// Largest voltage, in V.
    pub fn full_v(&self) -> f64 {
        self.voltage_v.iter().copied().fold(0.0, f64::max)
    }

    /// A random schedule of one of the kinds [`Kind::ALL`], but no sweep if `steps_only`; full scale is 500 V, in one of five 700 V.
    pub fn draw_any(random: &mut ChaCha8Rng, rows: usize, uneven: bool, steps_only: bool) -> Self {
        let sampling = Sampling::draw(random, rows, uneven);
        let full_v = if random.random_bool(0.2) { 700.0 } else { 500.0 };
        let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|&kind| !(steps_only && kind == Kind::Sweep)).collect();
        let kind = *kinds.choose(random).expect("three kinds are left");
        Self::draw(random, kind, sampling, full_v)
    }

    /// A random schedule between 0 V and `full_v`, in V.
    pub fn draw(random: &mut ChaCha8Rng, kind: Kind, sampling: Sampling, full_v: f64) -> Self {
        let time_s = sampling.times(random);
        let duration = time_s[time_s.len() - 1];
        // The first fiftieth of the record is at rest.
        let rest = duration / 50.0;
        let course = kind.course(random, duration - rest, full_v);
        let voltage_v = time_s.iter().map(|&t| if t < rest { 0.0 } else { course(t - rest) }).collect();
        Self { time_s, voltage_v }
    }
}

impl Kind {
    /// Kinds of most records.
    pub const ALL: [Self; 4] = [Self::UpDown, Self::Random, Self::Sweep, Self::MultiLevel];
    /// Kinds that the records of other plants have in addition.
    pub const SMOOTH: [Self; 3] = [Self::Multisine, Self::Chirp, Self::Ramps];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::UpDown => "stair",
            Self::Random => "random levels",
            Self::Sweep => "sweep",
            Self::MultiLevel => "eight levels",
            Self::Multisine => "multisine",
            Self::Chirp => "chirp",
            Self::Ramps => "ramps",
        }
    }

    /// Voltage in V as a function of time in s.
    fn course(self, random: &mut ChaCha8Rng, duration: f64, full_v: f64) -> Box<dyn Fn(f64) -> f64> {
        match self {
            Self::UpDown => {
                let (steps, loops) = (random.random_range(4..=10u32), random.random_range(1..=3u32));
                // Slightly longer, so that the last row is on the last step.
                let hold = 1.0001 * duration / f64::from(2 * steps * loops);
                let level = move |i: u32| f64::from(steps.abs_diff(i % (2 * steps))) / f64::from(steps);
                Box::new(move |t| full_v * (1.0 - level((t / hold) as u32 + 1)))
            }
            Self::Random => {
                let hold = (duration / random.random_range(20.0..50.0)).clamp(1.0, 20.0);
                stairs(
                    random,
                    duration,
                    0.4 * hold..1.6 * hold,
                    |random| full_v * random.random_range(0.0..=1.0),
                    full_v,
                )
            }
            Self::MultiLevel => {
                let hold = (duration / random.random_range(60.0..150.0)).clamp(0.4, 6.0);
                let level = |random: &mut ChaCha8Rng| full_v * f64::from(random.random_range(0..8u32)) / 7.0;
                stairs(random, duration, 0.4 * hold..1.6 * hold, level, full_v)
            }
            Self::Multisine => {
                let sines: Vec<(f64, f64)> = (0..8)
                    .map(|k| {
                        let periods = 200f64.powf((f64::from(k) + random.random_range(0.0..1.0)) / 8.0);
                        (TAU * periods / duration, random.random_range(0.0..TAU))
                    })
                    .collect();
                let sum = move |t: f64| sines.iter().map(|(omega, phase)| (omega * t + phase).sin()).sum::<f64>();
                let course: Vec<f64> = (0..4000).map(|k| sum(duration * f64::from(k) / 4000.0)).collect();
                let (low, high) = course.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
                Box::new(move |t| full_v * ((sum(t) - low) / (high - low)).clamp(0.0, 1.0))
            }
            Self::Chirp => {
                let (first, factor) = (random.random_range(1.0..4.0) / duration, 40f64);
                Box::new(move |t| {
                    let phase = first * duration * (factor.powf(t / duration) - 1.0) / factor.ln();
                    full_v * 0.5 * (1.0 - (TAU * phase).cos())
                })
            }
            Self::Ramps => {
                let mut points = vec![(0.0, 0.0)];
                let turns = random.random_range(8..30usize);
                let each = duration / turns as f64;
                for turn in 0..=turns {
                    let (t, _) = points[points.len() - 1];
                    let level = match turn {
                        1 => full_v,
                        3 => 0.0,
                        _ => full_v * random.random_range(0.0..=1.0),
                    };
                    let top = t + each * random.random_range(0.1..0.9);
                    points.extend([(top, level), (top + each * random.random_range(0.05..0.6), level)]);
                }
                Box::new(move |t| {
                    let next = points.partition_point(|&(at, _)| at <= t).clamp(1, points.len() - 1);
                    let ((t0, v0), (t1, v1)) = (points[next - 1], points[next]);
                    v0 + (v1 - v0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
                })
            }
            Self::Sweep => {
                let periods = random.random_range(3.0..8.0);
                if random.random_bool(0.5) {
                    Box::new(move |t| {
                        let phase = (periods * t / duration).fract();
                        full_v * (1.0 - (2.0 * phase - 1.0).abs())
                    })
                } else {
                    // The frequency rises fourfold.
                    Box::new(move |t| {
                        let part = t / duration;
                        let phase = periods * part * (0.4 + 0.6 * part);
                        full_v * 0.5 * (1.0 - (std::f64::consts::TAU * phase).cos())
                    })
                }
            }
        }
    }
}

/// Random levels, each held for a random time; full scale and 0 V are among the first five.
fn stairs(
    random: &mut ChaCha8Rng,
    duration: f64,
    hold: std::ops::Range<f64>,
    level: impl Fn(&mut ChaCha8Rng) -> f64,
    full_v: f64,
) -> Box<dyn Fn(f64) -> f64> {
    let (top, bottom) = (random.random_range(1..3usize), random.random_range(3..5usize));
    let mut levels: Vec<(f64, f64)> = Vec::new();
    let mut until = 0.0;
    while until < duration {
        until += random.random_range(hold.clone());
        let volts = level(random);
        let index = levels.len();
        levels.push((
            until,
            if index == top {
                full_v
            } else if index == bottom {
                0.0
            } else {
                volts
            },
        ));
    }
    Box::new(move |t| levels[levels.partition_point(|&(until, _)| until <= t).min(levels.len() - 1)].1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn every_schedule_starts_at_rest_reaches_full_scale_and_falls() {
        for seed in 0..40 {
            for kind in Kind::ALL.into_iter().chain(Kind::SMOOTH) {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let sampling = Sampling::draw(&mut random, 2401, seed % 2 == 1);
                let schedule = Schedule::draw(&mut random, kind, sampling, 500.0);
                assert_eq!(schedule.time_s.len(), 2401);
                assert!(schedule.time_s.is_sorted_by(|a, b| a < b));
                assert!(schedule.rows().all(|(_, v)| (0.0..=500.0).contains(&v)));
                assert!(schedule.full_v() > 495.0, "{kind:?} {seed}: {}", schedule.full_v());
                assert_eq!(schedule.voltage_v[0], 0.0);
                // A multisine may be at its lowest before it is at full scale.
                let high = if kind == Kind::Multisine { 100.0 } else { 495.0 };
                let top = schedule.voltage_v.iter().position(|&v| v > high).unwrap();
                assert!(schedule.voltage_v[top..].iter().any(|&v| v < 20.0), "{kind:?} {seed} does not fall");
            }
        }
    }
}
