//! Random settings that the controller accepts: plain and extended springs, the three controllers, with and without slew
//! and sensor.

use firmware::control::Control;
use firmware::settings::SUPERVISION;
use link::WireModel;
use link::wire_model::WireMemory;
use model::{Amplifier, Approach, Compensation, Feedback, Gains, Margin, Plant, Settings};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A controller at rest, and the limits that it must keep.
pub(super) struct Setup {
    pub(super) control: Control,
    pub(super) limits: SetLimits,
}

/// What the settings promise.
#[derive(Clone, Copy, Debug)]
pub(super) struct SetLimits {
    pub(super) amplifier: Amplifier,
    pub(super) rate_hz: f64,
    /// The spring has no block that extends it: its stiffness stays between voltages that were applied.
    pub(super) plain: bool,
    pub(super) sensor: bool,
}

impl Setup {
    /// Random settings; the number of the run chooses the kind of spring and controller.
    pub(super) fn random(run: u64, random: &mut ChaCha8Rng) -> Self {
        let [extended, sensor] = [1, 2].map(|bit| run & bit != 0);
        loop {
            let settings = settings(run / 4 % 3, sensor, random);
            let Ok(mut control) = Control::new(&settings, &SUPERVISION, None) else { continue };
            let mut amplifier = settings.amplifier;
            if extended {
                let model = model(random);
                if control.use_model(&settings, &model).is_err() {
                    continue;
                }
                amplifier = model.behind(amplifier);
            }
            let limits = SetLimits { amplifier, rate_hz: settings.rate_hz, plain: !extended, sensor };
            return Self { control, limits };
        }
    }
}

/// A number between two positive ones, every decade as likely as another.
fn decades(random: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    from * (to / from).powf(random.random())
}

fn settings(controller: u64, sensor: bool, random: &mut ChaCha8Rng) -> Settings {
    let full_scale_v = random.random_range(50.0..=1000.0);
    let min_v = if random.random() { 0.0 } else { random.random_range(0.0..=full_scale_v - 10.0) };
    let amplifier = Amplifier {
        full_scale_v,
        min_v,
        max_v: random.random_range(min_v + 10.0..=full_scale_v),
        slew_v_per_s: random.random::<bool>().then(|| decades(random, 1.0, 1e6)),
        dac_bits: random.random_range(8..=16),
    };
    let compensation = match controller {
        0 => Compensation::TimeOptimal(Approach { time_constant_s: random.random_range(0.0..=1.0) }),
        1 => Compensation::Robust(Margin {
            time_constant: random.random_range(0.0..=0.25),
            share: random.random_range(0.0..=0.25),
            gain: random.random_range(0.0..=0.25),
            overshoot: random.random_range(0.0..=0.2),
            fall_back: random.random_range(0.0..=0.5),
        }),
        _ => Compensation::ProportionalIntegral(Gains {
            proportional: decades(random, 1e-3, 100.0),
            integral_per_s: decades(random, 1e-4, 100.0),
        }),
    };
    let feedback = sensor.then(|| Feedback {
        noise_v: decades(random, 0.01, 10.0),
        model_uncertainty: decades(random, 0.01, 100.0),
        fastest_s: random.random_range(0.0..=1.0),
        ..Feedback::TYPICAL
    });
    let rate_hz = decades(random, 100.0, 10_000.0);
    let plant = Plant { share: random.random_range(0.0..=0.9), time_constant_s: decades(random, 0.05, 1e4) };
    Settings { rate_hz, plant, compensation, amplifier, feedback }
}

/// A spring with random blocks, on the scale of a real one.
fn model(random: &mut ChaCha8Rng) -> WireModel {
    let plays = random.random_range(0..=8);
    let memory = (plays > 0).then(|| WireMemory {
        direct: random.random_range(0.2..=1.0),
        thresholds_v: (0..plays).map(|_| random.random_range(0.0..=200.0)).collect(),
        weights: (0..plays).map(|_| random.random_range(0.0..=0.2)).collect(),
    });
    let lags = random.random_range(1..=4);
    let (mut volts, mut values) = (0.0, 0.0);
    let (mut law_v, mut law) = (vec![0.0], vec![0.0]);
    for _ in 0..random.random_range(1..=8) {
        let width = random.random_range(1.0..=120.0);
        (volts, values) = (volts + width, values + width * random.random_range(0.1..=2.0));
        law_v.push(volts);
        law.push(values);
    }
    WireModel {
        memory,
        law: random.random::<bool>().then(|| (law_v.into_iter().collect(), law.into_iter().collect())),
        leakage: random.random::<bool>().then(|| (random.random_range(0.0..=0.9), decades(random, 1.0, 1e5))),
        share: random.random_range(0.01..=0.5),
        time_constants_s: (0..lags).map(|_| decades(random, 0.05, 1e3)).collect(),
        weights: (0..lags).map(|_| random.random_range(0.01..=0.5)).collect(),
        time_constant_high_s: None,
        limit_v: random.random::<bool>().then(|| random.random_range(50.0..=1000.0)),
        slew_v_per_s: random.random::<bool>().then(|| decades(random, 10.0, 1e6)),
    }
}
