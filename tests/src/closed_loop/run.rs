//! One run of the loop: the fixed-point tick leads a spring that is not the one it thinks.

use model::{Config, DacCode, Input, OutOfRange, Reading, ScaledStiffness, Sensor, Settings, State, Volts};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::stair;
use crate::hidden::{Cause, Effect, Live, Noise};

/// What is hidden, and in which noise.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The hidden effects.
    pub effects: Vec<Effect>,
    /// On the sensor's readings.
    pub noise: Noise,
    /// Where noise and outliers come from.
    pub seed: u64,
}

/// One tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The true stiffness just after the voltage, in V.
    pub truth: f64,
    /// What the controller says it is, in V.
    pub estimate: f64,
    /// What the sensor adds to the model, in V.
    pub correction: f64,
    /// Before rounding, in V.
    pub voltage: f64,
    /// What went out.
    pub code: DacCode,
    /// What the controller thinks of its sensor.
    pub sensor: Option<Sensor>,
}

impl Scene {
    /// One effect of plain size in its first form, white noise of 0.2 %.
    pub fn of(cause: Cause, seed: u64) -> Self {
        let noise = Noise::white(0.2);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let effect = Effect::draw(&mut random, cause, 0, &stair::schedule(), noise.sigma_v);
        Self { effects: vec![effect], noise, seed }
    }

    /// The paper's spring.
    pub fn nothing(seed: u64) -> Self {
        Self { effects: Vec::new(), noise: Noise::white(0.2), seed }
    }

    /// The stair, from rest. `sense` makes what the controller is told in tick `k` of what the sensor has just read.
    ///
    /// # Errors
    /// Settings that the model refuses.
    pub fn run(
        &self,
        settings: &Settings,
        mut sense: impl FnMut(usize, f64) -> Option<Reading>,
    ) -> Result<Vec<Sample>, OutOfRange> {
        let config: Config = settings.validate()?.quantize();
        let mut state = State::default();
        let ticks = (stair::duration_s() * settings.rate_hz).round() as usize;
        let mut live = Live::new(&self.effects, self.noise, self.seed, 500.0, ticks);
        let tick = |k: usize| {
            let target = Volts::new(stair::target_v(k as f64 / settings.rate_hz))?;
            let measured = sense(k, live.read().read);
            let output = config.tick(&mut state, Input { target, measured });
            live.command(output.applied.to_f64());
            let truth = live.stiffness();
            live.pass(1.0 / settings.rate_hz);
            Ok(Sample {
                truth,
                estimate: output.stiffness.to_f64(),
                correction: state.correction().to_f64(),
                voltage: output.voltage.to_f64(),
                code: output.code,
                sensor: output.sensor,
            })
        };
        (0..ticks).map(tick).collect()
    }
}

/// A reading of this tick.
pub fn fresh(read: f64) -> Option<Reading> {
    Volts::new(read.clamp(-2000.0, 2000.0)).ok().and_then(|volts| Reading::fresh(ScaledStiffness(volts.0)))
}
