//! Compares the fixed-point tick of the extended spring with a double-precision loop of the same rate, over random
//! springs in the range of identified ones: each block alone and all together, up a stair and down again, at 100 Hz, 1
//! kHz and 10 kHz.
//!
//! Each spring is run twice: with the double-precision loop following the DAC codes of 12 bits, which leaves the errors
//! of the arithmetic and of the interpolated time constant; and on its own, with 16 bits. With 12 bits the loop without
//! controller would differ by up to half a code, 0.085 V.
//!
//! `cargo test -p simulation --test extended -- --nocapture` prints the worst cases.

mod springs;

use model::{Amplifier, Compensation, ExtendedPlant, Input, Settings, State, Volts};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use simulation::plant_file::PlantFile;
use simulation::sampled::SampledLoop;

use springs::{ALL, SETS, plant};

/// Largest difference allowed for the tick and for `vsj stair`, in V.
const ALLOWED_V: f64 = 0.05;
/// Levels in V, 6 s each, connected by the report's ramps of 0.1 s.
const STAIR: [f64; 9] = [100.0, 200.0, 300.0, 400.0, 500.0, 250.0, 50.0, 350.0, 0.0];

/// Largest differences of the stiffness, in V.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    /// With the double-precision loop following the DAC codes.
    same_codes: f64,
    /// With the double-precision loop on its own.
    alone: f64,
    /// With the double-precision loop on its own, without pre-compensator.
    uncontrolled: f64,
}

impl Worst {
    fn of_both(self, other: Self) -> Self {
        Self {
            same_codes: self.same_codes.max(other.same_codes),
            alone: self.alone.max(other.alone),
            uncontrolled: self.uncontrolled.max(other.uncontrolled),
        }
    }
}

/// Largest differences over the stair.
fn disagreement(file: &PlantFile, rate_hz: f64) -> Worst {
    let of = |compensation, dac_bits, same_codes| {
        let amplifier = Amplifier { dac_bits, ..Amplifier::PAPER };
        of_loop(&Settings { rate_hz, plant: file.extended(), compensation, amplifier, feedback: None }, same_codes)
    };
    let paper = Settings::PAPER.compensation;
    Worst {
        same_codes: f64::max(of(paper, 12, true), of(Compensation::None, 12, true)),
        alone: of(paper, 16, false),
        uncontrolled: of(Compensation::None, 16, false),
    }
}

/// Largest difference of one loop; `same_codes` makes the double-precision loop follow the DAC codes.
fn of_loop(settings: &Settings<ExtendedPlant<'_>>, same_codes: bool) -> f64 {
    let config = settings.validate().expect("a spring such as identification finds").quantize();
    let double = SampledLoop::from(settings);
    let (mut fixed, mut state) = (State::default(), double.at_rest());
    let (mut off, mut from) = (0.0f64, 0.0);
    for to in STAIR {
        for tick in 0..(6.0 * settings.rate_hz) as u32 {
            let target = from + (to - from) * (f64::from(tick) / (0.1 * settings.rate_hz)).min(1.0);
            let output = config.tick(&mut fixed, Input { target: Volts::new(target).unwrap(), ..Input::default() });
            let voltage = double.drive(&mut state, target);
            let stiffness = double.apply(&mut state, if same_codes { output.applied.to_f64() } else { voltage });
            off = off.max((output.stiffness.to_f64() - stiffness).abs());
        }
        from = to;
    }
    off
}

/// The random springs are the same in every run.
#[test]
fn each_block_alone_and_all_together_at_three_rates() {
    println!("worst difference to double precision [V]   same codes   with controller   without");
    for (name, blocks) in SETS {
        for (rate_hz, springs) in [(100.0, 60), (1000.0, 20), (10_000.0, 2)] {
            let mut runner = TestRunner::deterministic();
            let mut worst = Worst::default();
            for _ in 0..springs {
                let file = plant(blocks).new_tree(&mut runner).expect("no filters").current();
                worst = worst.of_both(disagreement(&file, rate_hz));
            }
            let Worst { same_codes, alone, uncontrolled } = worst;
            println!("{name:12} {rate_hz:5} Hz, {springs:3} springs {same_codes:22.6} {alone:17.6} {uncontrolled:9.6}");
            assert!(same_codes < ALLOWED_V && alone < ALLOWED_V && uncontrolled < ALLOWED_V, "{name} {rate_hz}");
            // Exact agreement would mean that both run the same code.
            assert!(same_codes > 0.0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_random_spring_agrees_at_1_khz(file in plant(ALL)) {
        let worst = disagreement(&file, 1000.0);
        prop_assert!(worst.same_codes < ALLOWED_V && worst.alone < ALLOWED_V && worst.uncontrolled < ALLOWED_V, "{worst:?}");
    }
}
