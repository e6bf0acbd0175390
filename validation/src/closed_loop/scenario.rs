//! One run of the loop: the fixed-point controller with the paper's model drives a spring with other properties.

use model::{Config, DacCode, Input, OutOfRange, Reading, ScaledStiffness, Sensor, Settings, State, Volts};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::stair;
use crate::ground_truth::{Cause, Effect, Live, Noise};

/// A spring with its effects and the noise of its sensor.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Effects of the spring and its sensor.
    pub effects: Vec<Effect>,
    /// Noise on the sensor's readings.
    pub noise: Noise,
    /// Seed of noise and outliers.
    pub seed: u64,
}

/// Values of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// True stiffness just after the voltage is applied, in V.
    pub truth: f64,
    /// Stiffness estimated by the controller, in V.
    pub estimate: f64,
    /// Correction of the model by the sensor, in V.
    pub correction: f64,
    /// Voltage before rounding to the DAC, in V.
    pub voltage: f64,
    /// DAC code of the applied voltage.
    pub code: DacCode,
    /// State of the sensor as the controller rates it; `None` without a sensor.
    pub sensor: Option<Sensor>,
}

impl Scenario {
    /// One effect of full size in its first form, in white noise of 0.2 % of 500 V.
    pub fn of(cause: Cause, seed: u64) -> Self {
        let noise = Noise::white(0.2);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let effect = Effect::draw(&mut random, cause, 0, &stair::schedule(), noise.sigma_v);
        Self { effects: vec![effect], noise, seed }
    }

    /// The paper's spring, in white noise of 0.2 % of 500 V.
    pub fn nothing(seed: u64) -> Self {
        Self { effects: Vec::new(), noise: Noise::white(0.2), seed }
    }

    /// Runs the stair from rest. `sense(k, reading)` maps the sensor's reading in tick `k`, in V, to the controller's
    /// input.
    ///
    /// # Errors
    /// The model rejects the settings.
    pub fn run(
        &self,
        settings: &Settings,
        sense: impl FnMut(usize, f64) -> Option<Reading>,
    ) -> Result<Vec<Sample>, OutOfRange> {
        self.run_watched(settings, 0, sense, |_, _| ())
    }

    /// Does what [`Scenario::run`] does after this number of ticks at rest, in which the sensor is rated as it is on the MCU before its
    /// output is enabled; calls `before` with the spring before each tick of the stair.
    ///
    /// # Errors
    /// The model rejects the settings.
    pub fn run_watched(
        &self,
        settings: &Settings,
        rest_ticks: usize,
        mut sense: impl FnMut(usize, f64) -> Option<Reading>,
        mut before: impl FnMut(usize, &Live),
    ) -> Result<Vec<Sample>, OutOfRange> {
        let config: Config = settings.validate()?.quantize();
        let mut state = State::default();
        let ticks = (stair::duration_s() * settings.rate_hz).round() as usize;
        let mut live = Live::new(&self.effects, self.noise, self.seed, 500.0, ticks);
        // The stair then begins with the same noise.
        let mut resting = live.clone();
        for _ in 0..rest_ticks {
            let measured = sense(0, resting.read().read);
            config.rest(&mut state, measured);
            resting.pass(1.0 / settings.rate_hz);
        }
        let tick = |k: usize| {
            before(k, &live);
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

/// A reading of the current tick, from a value in V.
pub fn fresh(read: f64) -> Option<Reading> {
    Volts::new(read.clamp(-2000.0, 2000.0)).ok().and_then(|volts| Reading::fresh(ScaledStiffness(volts.0)))
}
