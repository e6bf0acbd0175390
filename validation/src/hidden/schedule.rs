//! What the amplifier is told: random schedules that start at rest, reach full scale and come back.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Times and commanded voltages; each voltage is held to the next time.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// In s, increasing.
    pub time_s: Vec<f64>,
    /// In V.
    pub voltage_v: Vec<f64>,
}

/// The kinds of schedules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Stairs up and down again, of 4 to 10 equal steps.
    UpDown,
    /// Any level after any other, for random times.
    Random,
    /// Triangles, or sines of rising frequency: nothing but slow changes.
    Sweep,
    /// Eight levels, switched at random after short times.
    MultiLevel,
}

/// How a record is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Number of rows.
    pub rows: usize,
    /// Between two rows on average, in s.
    pub every_s: f64,
    /// Steps differ by up to half, and one row in ten is missing.
    pub uneven: bool,
}

impl Sampling {
    /// As asked, 0.02 to 0.2 s apart, every time scale as likely.
    pub fn draw(random: &mut ChaCha8Rng, rows: usize, uneven: bool) -> Self {
        Self { rows, every_s: 0.02 * 10f64.powf(random.random_range(0.0..1.0)), uneven }
    }

    fn times(&self, random: &mut ChaCha8Rng) -> Vec<f64> {
        let mut at = 0.0;
        (0..self.rows)
            .map(|_| {
                let now = at;
                let missing = if self.uneven && random.random_bool(0.1) { 2.0 } else { 1.0 };
                let jitter = if self.uneven { random.random_range(0.5..1.5) } else { 1.0 };
                // To the ns: times of a file are decimal.
                at = ((now + missing * jitter * self.every_s) * 1e9).round() / 1e9;
                now
            })
            .collect()
    }
}

impl Schedule {
    /// Time and voltage, row by row.
    pub fn rows(&self) -> impl Iterator<Item = (f64, f64)> {
        self.time_s.iter().copied().zip(self.voltage_v.iter().copied())
    }

    /// From the first row to the last, in s.
    pub fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }

    /// Typical time between rows, in s.
    pub fn every_s(&self) -> f64 {
        self.duration_s() / (self.time_s.len() - 1) as f64
    }

    /// Highest voltage, in V.
    pub fn full_v(&self) -> f64 {
        self.voltage_v.iter().copied().fold(0.0, f64::max)
    }

    /// A random one up to `full_v`.
    pub fn draw(random: &mut ChaCha8Rng, kind: Kind, sampling: Sampling, full_v: f64) -> Self {
        let time_s = sampling.times(random);
        let duration = time_s[time_s.len() - 1];
        // The first fiftieth is rest.
        let rest = duration / 50.0;
        let course = kind.course(random, duration - rest, full_v);
        let voltage_v = time_s.iter().map(|&t| if t < rest { 0.0 } else { course(t - rest) }).collect();
        Self { time_s, voltage_v }
    }
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::UpDown, Self::Random, Self::Sweep, Self::MultiLevel];

    /// Voltage over time.
    fn course(self, random: &mut ChaCha8Rng, duration: f64, full_v: f64) -> Box<dyn Fn(f64) -> f64> {
        match self {
            Self::UpDown => {
                let (steps, loops) = (random.random_range(4..=10u32), random.random_range(1..=3u32));
                // A little longer, for the last row to be on the last step.
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
            Self::Sweep => {
                let periods = random.random_range(3.0..8.0);
                if random.random_bool(0.5) {
                    Box::new(move |t| {
                        let phase = (periods * t / duration).fract();
                        full_v * (1.0 - (2.0 * phase - 1.0).abs())
                    })
                } else {
                    // Its frequency rises fourfold.
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

/// Random levels for random times, full scale and 0 V among the first five.
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
    fn every_schedule_rests_rises_to_full_scale_and_falls() {
        for seed in 0..40 {
            for kind in Kind::ALL {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let sampling = Sampling::draw(&mut random, 2401, seed % 2 == 1);
                let schedule = Schedule::draw(&mut random, kind, sampling, 500.0);
                assert_eq!(schedule.time_s.len(), 2401);
                assert!(schedule.time_s.is_sorted_by(|a, b| a < b));
                assert!(schedule.rows().all(|(_, v)| (0.0..=500.0).contains(&v)));
                assert!(schedule.full_v() > 495.0, "{kind:?} {seed}: {}", schedule.full_v());
                assert_eq!(schedule.voltage_v[0], 0.0);
                let top = schedule.voltage_v.iter().position(|&v| v > 495.0).unwrap();
                assert!(schedule.voltage_v[top..].iter().any(|&v| v < 20.0), "{kind:?} {seed} never falls");
            }
        }
    }
}
