//! Random springs, pre-compensators and amplifiers up to the ends of their allowed ranges: no overflow, output in
//! range.

use model::estimator::{Estimator, Model};
use model::extended::{self, ExtendedPlant, Law, Leakage, Memory, Relaxation};
use model::{Amplifier, Approach, Compensation, Gains, Plant, Settings, State, Volts};
use proptest::prelude::*;

use super::{FAST, tick};

prop_compose! {
    /// Pre-compensators up to the ends of their allowed ranges.
    fn compensation()(
        kind in 0..4u8,
        approach in 0.0..=1.0f64,
        unknown in -1.0..=1.0f64,
        gain in -3.0..2.0f64,
        integral in -4.0..2.0f64,
    ) -> Compensation {
        match kind {
            0 => FAST,
            1 => Compensation::TimeOptimal(Approach { time_constant_s: approach }),
            #[cfg(feature = "robust")]
            2 => Compensation::Robust(model::Margin {
                time_constant: 0.25 * approach,
                // Known exactly in half of the draws: a fall back needs that.
                share: 0.25 * unknown.max(0.0),
                gain: 0.125 * gain.max(0.0),
                overshoot: 0.2 * (integral + 4.0) / 6.0,
                fall_back: 0.5 * unknown.abs(),
            }),
            _ => Compensation::ProportionalIntegral(Gains {
                proportional: 10f64.powf(gain),
                integral_per_s: 10f64.powf(integral),
            }),
        }
    }
}

prop_compose! {
    fn amplifier()(
        full_scale_v in 50.0..=1000.0f64,
        part in 0.3..=1.0f64,
        dac_bits in 8u32..=16,
        slew in prop::option::of(0.0..9.0f64),
    ) -> Amplifier {
        let max_v = (part * full_scale_v).max(10.0);
        let slew_v_per_s = slew.map(|decades| 10f64.powf(decades));
        Amplifier { max_v, slew_v_per_s, dac_bits, ..Amplifier::up_to(full_scale_v) }
    }
}

/// Runs the settings over all targets, from the state that other settings have left.
fn stays_in_range<P: Model>(
    settings: &Settings<P>,
    state: &mut State<<P::Config as Estimator>::State>,
    targets: &[f64],
) -> Result<(), TestCaseError> {
    let Ok(valid) = settings.validate() else { return Ok(()) };
    let config = valid.quantize();
    let (lowest, highest) = config.range();
    config.bumpless_transfer(state, Volts::new(targets[0]).unwrap());
    for &target in targets {
        for _ in 0..50 {
            let output = tick(&config, state, target);
            prop_assert!(output.applied >= lowest && output.applied <= highest);
            prop_assert!(output.voltage >= lowest && output.voltage <= highest);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_output_stays_in_range_with_a_plain_spring(
        rate in 2.0..=4.0f64,
        loops in prop::collection::vec((0.0..=0.9f64, -2.0..4.0f64, compensation(), amplifier()), 1..4),
        targets in prop::collection::vec(-2000.0..2000.0f64, 1..20),
    ) {
        let mut state = State::default();
        for (share, time_constant, compensation, amplifier) in loops {
            let plant = Plant { share, time_constant_s: 10f64.powf(time_constant) };
            let settings = Settings { rate_hz: 10f64.powf(rate), plant, compensation, amplifier, feedback: None };
            stays_in_range(&settings, &mut state, &targets)?;
        }
    }

    #[test]
    fn the_output_stays_in_range_with_an_extended_spring(
        rate in 2.0..=4.0f64,
        plays in prop::collection::vec((0.0..=1000.0f64, -0.5..=1.0f64), 0..=8),
        direct in -0.5..=2.0f64,
        lines in prop::collection::vec((0.001..125.0f64, 0.01..=10.0f64), 1..=8),
        (lost, leak_tau) in (0.0..=0.95f64, 1.0..1e5f64),
        share in 0.0..=5.0f64,
        lags in prop::collection::vec((-1.39..4.0f64, 0.0..=1.2f64), 1..=4),
        high in prop::option::of(-1.0..=1.0f64),
        compensation in compensation(),
        amplifier in amplifier(),
        targets in prop::collection::vec(-2000.0..2000.0f64, 1..20),
    ) {
        let (mut voltage_v, mut stiffness) = (vec![0.0], vec![0.0]);
        for (line, (width, slope)) in lines.into_iter().enumerate() {
            voltage_v.push(voltage_v[line] + width + 1e-3);
            stiffness.push(f64::min(stiffness[line] + 0.999 * slope * width, 2000.0));
        }
        let (thresholds_v, weights): (Vec<f64>, Vec<f64>) = plays.into_iter().unzip();
        let (tau, by): (Vec<f64>, Vec<f64>) = lags.into_iter().map(|(tau, weight)| (10f64.powf(tau), weight)).unzip();
        let plant = ExtendedPlant {
            memory: Some(Memory { direct, thresholds_v: &thresholds_v, weights: &weights }),
            law: Some(Law { voltage_v: &voltage_v, stiffness: &stiffness }),
            leakage: Some(Leakage { share: lost, time_constant_s: leak_tau }),
            relaxation: Relaxation {
                share,
                time_constants_s: &tau,
                weights: &by,
                time_constant_high_s: high.map(|decades| (tau[0] * 10f64.powf(decades)).clamp(0.041, 9000.0)),
            },
        };
        let mut state = State::<extended::State>::default();
        let settings = Settings { rate_hz: 10f64.powf(rate), plant, compensation, amplifier, feedback: None };
        stays_in_range(&settings, &mut state, &targets)?;
    }
}
