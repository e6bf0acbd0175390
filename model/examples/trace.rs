//! Runs random configurations of the plain tick and writes what they put out, for `model/proof/differential.py`:
//! `cargo run --release -p vsj-model --example trace -- SEED CONFIGURATIONS TICKS` writes to stdout, for each configuration, a line with
//! its numbers, and then for each tick the target, code, applied voltage, voltage before rounding, stiffness and limits as six
//! little-endian numbers of 32 bits.

use std::io::{self, BufWriter, Write};

use model::{Amplifier, Compensation, Config, Gains, Input, Plant, Settings, State, Volts, units::Signal};
use random_numbers::Xorshift64;

/// Random settings and targets.
struct Random(Xorshift64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0.draw()
    }

    /// A number from 0 to 1, sometimes one of the ends.
    fn part(&mut self) -> f64 {
        match self.bits() % 16 {
            0 => 0.0,
            1 => 1.0,
            _ => self.0.uniform(),
        }
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        (low + self.part() * (high - low)).clamp(low, high)
    }

    /// A number whose logarithm is uniform.
    fn about(&mut self, low: f64, high: f64) -> f64 {
        (low * (high / low).powf(self.part())).clamp(low, high)
    }

    fn settings(&mut self) -> Settings {
        let rate_hz = self.about(100.0, 10_000.0);
        let full_scale_v = self.between(50.0, 1000.0);
        let min_v = self.between(0.0, full_scale_v - 10.0);
        let proportional = self.about(0.001, 100.0);
        let gains = Gains { proportional, integral_per_s: self.between(0.0, proportional * rate_hz / 10.0) };
        Settings {
            rate_hz,
            plant: Plant { share: self.between(0.0, 0.9), time_constant_s: self.about(2.0 / rate_hz, 1e4) },
            compensation: if self.bits().is_multiple_of(8) {
                Compensation::None
            } else {
                Compensation::ProportionalIntegral(gains)
            },
            amplifier: Amplifier {
                full_scale_v,
                min_v,
                max_v: self.between(min_v + 10.0, full_scale_v),
                slew_v_per_s: if self.bits().is_multiple_of(2) { None } else { Some(self.about(1.0, 1e9)) },
                dac_bits: 8 + (self.bits() % 9) as u32,
            },
            feedback: None,
        }
    }

    /// A target: often one that stays, sometimes any number of 32 bits.
    fn target(&mut self, last: Signal) -> Signal {
        match self.bits() % 64 {
            0 => Signal::from_bits(self.bits() as i32),
            1 => Signal::from_bits([i32::MIN, i32::MAX, 0][(self.bits() % 3) as usize]),
            2..8 => Signal::from_bits((self.bits() % (1000 << 20)) as i32),
            _ => last,
        }
    }
}

fn main() -> io::Result<()> {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<u64>().expect("a whole number"));
    let mut next = || arguments.next().expect("expected SEED CONFIGURATIONS TICKS");
    let (seed, configurations, ticks) = (next(), next(), next());
    let mut random = Random(Xorshift64::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1));
    let mut out = BufWriter::new(io::stdout().lock());
    for _ in 0..configurations {
        // The spring's dead-beat gain may be below the gain that was drawn.
        let config: Config = loop {
            if let Ok(valid) = random.settings().validate() {
                break valid.quantize();
            }
        };
        writeln!(out, "{config:?}")?;
        let (mut state, mut target) = (State::default(), Signal::ZERO);
        for _ in 0..ticks {
            target = random.target(target);
            let output = config.tick(&mut state, Input { target: Volts(target), measured: None });
            for number in [
                target.to_bits(),
                i32::from(output.code.0),
                output.applied.0.to_bits(),
                output.voltage.0.to_bits(),
                output.stiffness.0.to_bits(),
                i32::from(output.limits.bits()),
            ] {
                out.write_all(&number.to_le_bytes())?;
            }
        }
    }
    out.flush()
}
