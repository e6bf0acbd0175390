//! Runs of the tick with each kind of spring and each controller, on the host and on the target, for counting instructions and
//! comparing results bit for bit.

use firmware::control::{Stopwatch, whole_tick};
use model::estimator::{Estimator, Model};
use model::extended::{Law, Leakage, Memory, Relaxation};
use model::{Approach, Compensation, ExtendedPlant, Gains, Input, Margin, OutOfRange, Plant, Settings, State, Volts};
use random_numbers::Xorshift32;

use crate::digest::Digest;
use crate::target::volts;

/// Number of ticks of a run.
const TICKS: u32 = 10_000;
/// Number of ticks with the same target.
const TICKS_A_TARGET: u32 = 50;

/// The controllers with their names.
pub const CONTROLLERS: [(&str, Compensation); 4] = [
    ("none", Compensation::None),
    ("paper", Compensation::ProportionalIntegral(Gains::PAPER)),
    ("fast", Compensation::TimeOptimal(Approach { time_constant_s: 0.0 })),
    // With a fall back, which a share that is known exactly allows.
    (
        "robust",
        Compensation::Robust(Margin { time_constant: 0.05, share: 0.0, gain: 0.01, overshoot: 0.02, fall_back: 0.25 }),
    ),
];

/// The springs with their names. The first is the plain spring, which has a tick of its own. The others use the extended tick,
/// the first of them with the paper's relaxation only.
pub const SPRINGS: [(&str, Option<ExtendedPlant<'static>>); 9] = [
    ("plain", None),
    ("extended, one lag", Some(ONE_LAG)),
    ("+ memory, 8 plays", Some(ExtendedPlant { memory: Some(MEMORY), ..ONE_LAG })),
    ("+ law, 9 points", Some(ExtendedPlant { law: Some(LAW), ..ONE_LAG })),
    ("+ leakage", Some(ExtendedPlant { leakage: Some(LEAKAGE), ..ONE_LAG })),
    ("+ a varying time constant", Some(ExtendedPlant { relaxation: lags(1, Some(8.0)), ..ONE_LAG })),
    ("+ a second lag", Some(ExtendedPlant { relaxation: lags(2, None), ..ONE_LAG })),
    ("+ three more lags", Some(ExtendedPlant { relaxation: lags(4, None), ..ONE_LAG })),
    (
        "all of it",
        Some(ExtendedPlant {
            memory: Some(MEMORY),
            law: Some(LAW),
            leakage: Some(LEAKAGE),
            relaxation: lags(4, Some(8.0)),
        }),
    ),
];

const ONE_LAG: ExtendedPlant<'static> =
    ExtendedPlant { memory: None, law: None, leakage: None, relaxation: lags(1, None) };
const MEMORY: Memory<'static> =
    Memory { direct: 0.6, thresholds_v: &[5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0], weights: &[0.05; 8] };
const LAW: Law<'static> = Law {
    voltage_v: &[0.0, 80.0, 160.0, 240.0, 320.0, 400.0, 480.0, 560.0, 700.0],
    stiffness: &[0.0, 72.0, 150.0, 232.0, 316.0, 400.0, 486.0, 574.0, 720.0],
};
const LEAKAGE: Leakage = Leakage { share: 0.1, time_constant_s: 40.0 };

const fn lags(count: usize, time_constant_high_s: Option<f64>) -> Relaxation<'static> {
    let share = Plant::PAPER.share;
    let (time_constants_s, weights): (&'static [f64], &'static [f64]) = match count {
        1 => (&[5.5], &[1.0 - Plant::PAPER.share]),
        2 => (&[5.5, 40.0], &[0.8, 0.1]),
        _ => (&[5.5, 1.0, 15.0, 40.0], &[0.6, 0.1, 0.1, 0.1]),
    };
    Relaxation { share, time_constants_s, weights, time_constant_high_s }
}

/// The inputs of a run: random targets.
pub fn inputs() -> impl Iterator<Item = Input> {
    let (mut numbers, mut target) = (Xorshift32::new(1), Volts::ZERO);
    (0..TICKS).map(move |tick| {
        if tick.is_multiple_of(TICKS_A_TARGET) {
            target = volts(numbers.draw());
        }
        Input { target, ..Input::default() }
    })
}

/// Executes one run and returns the digest of its codes and estimates.
///
/// # Errors
/// [`OutOfRange`] if the settings are invalid, which does not occur for [`SPRINGS`] and [`CONTROLLERS`].
pub fn run(
    spring: Option<&ExtendedPlant<'static>>,
    compensation: Compensation,
    stopwatch: &mut impl Stopwatch,
) -> Result<u64, OutOfRange> {
    let Settings { rate_hz, plant, amplifier, feedback, .. } = Settings::PAPER;
    match spring {
        None => ticks(&Settings { rate_hz, plant, compensation, amplifier, feedback }, stopwatch),
        Some(&plant) => ticks(&Settings { rate_hz, plant, compensation, amplifier, feedback }, stopwatch),
    }
}

/// Not inlined: together, all variants exceed the range of a branch instruction.
#[inline(never)]
fn ticks<P: Model>(settings: &Settings<P>, stopwatch: &mut impl Stopwatch) -> Result<u64, OutOfRange> {
    let (config, mut state) = (settings.validate()?.quantize(), State::<<P::Config as Estimator>::State>::default());
    let mut digest = Digest::default();
    for input in inputs() {
        stopwatch.start();
        let output = whole_tick(&config, &mut state, input);
        stopwatch.stop();
        digest.add_output(&output);
    }
    Ok(digest.value())
}
