//! Tests of the blocks together: the response to a step for one tick, and the way back from a change of the stiffness
//! to a voltage.

use super::*;
use crate::Validate;
use proptest::prelude::*;
use std::vec::Vec;

const CODE_V: f64 = 700.0 / 4095.0;

fn sample_time() -> SampleTime {
    SampleTime::from_rate(1000.0).unwrap()
}

fn volts(volts: f64) -> Volts {
    Volts::new(volts).unwrap()
}

const LAGS: Relaxation<'_> =
    Relaxation { share: 0.2, time_constants_s: &[0.05, 0.4], weights: &[0.5, 0.3], time_constant_high_s: None };
const PLAIN: ExtendedPlant<'_> = ExtendedPlant { memory: None, law: None, leakage: None, relaxation: LAGS };
const LEAKY: ExtendedPlant<'_> = ExtendedPlant { leakage: Some(Leakage { share: 0.8, time_constant_s: 0.1 }), ..PLAIN };

fn config(plant: &ExtendedPlant<'_>) -> Config {
    plant.validate(sample_time()).unwrap().quantize()
}

/// Returns the stiffness now and one tick later that 1000 V give a spring at rest, as parts of 1000 V.
fn response(plant: &ExtendedPlant<'_>) -> (f64, f64) {
    let (config, mut state) = (config(plant), State::default());
    [(); 2].map(|()| config.run(&mut state, volts(1000.0)).to_f64() / 1000.0).into()
}

#[test]
fn the_step_gain_is_the_response_of_the_spring_that_runs() {
    for plant in [PLAIN, LEAKY] {
        let (now, end) = response(&plant);
        let gain = plant.smallest_step_gain(sample_time());
        assert!((gain.feedthrough + gain.in_one_tick - end).abs() < 2e-6, "{gain:?}: {now} {end}");
    }
    // Without leakage the feedthrough is the instantaneous part; with it the largest gain is that of the first moment.
    let (now, end) = response(&PLAIN);
    let (small, large) = (PLAIN.smallest_step_gain(sample_time()), PLAIN.largest_step_gain(sample_time()));
    for gain in [small, large] {
        assert!((gain.feedthrough - now).abs() < 1e-6 && (gain.in_one_tick - (end - now)).abs() < 2e-6, "{gain:?}");
    }
    let large = LEAKY.largest_step_gain(sample_time());
    let (now, end) = response(&LEAKY);
    assert!((large.feedthrough - now).abs() < 1e-6 && large.feedthrough + large.in_one_tick > end, "{large:?}");
}

#[test]
fn another_share_changes_the_weights_but_not_the_settled_value() {
    Relaxation { time_constant_high_s: Some(0.06), ..LAGS }.times((1.5, 1.2), |changed| {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(changed.time_constant_high_s.is_some_and(|high_s| near(high_s, 0.09)), "{changed:?}");
        assert!(near(changed.share, 0.24), "{changed:?}");
        for (changed, expected) in changed.time_constants_s.iter().zip([0.075, 0.6]) {
            assert!(near(*changed, expected), "{changed}");
        }
        for (changed, expected) in changed.weights.iter().zip([0.475, 0.285]) {
            assert!(near(*changed, expected), "{changed}");
        }
    });
}

#[test]
fn a_differing_spring_has_the_multiplied_relaxation_and_is_checked_with_it() {
    let (valid, quick) = (PLAIN.validate(sample_time()).unwrap(), (0.5, 2.0));
    let relaxation = Relaxation {
        share: 0.4,
        time_constants_s: &[0.025, 0.2],
        weights: &[0.375, 0.225],
        time_constant_high_s: None,
    };
    let expected = config(&ExtendedPlant { relaxation, ..PLAIN });
    assert_eq!(ExtendedPlant::differing(valid, quick, CODE_V).estimator, expected);
    let checked = |factors| PLAIN.check_differing(factors, sample_time()).map_err(|error| error.field);
    assert_eq!(checked(quick), Ok(()));
    assert_eq!((checked((1.0, 60.0)), checked((0.01, 1.0))), (Err("relaxation.share"), Err("relaxation.tau_s")));
}

#[test]
fn memory_and_law_multiply_the_step_gain_by_their_slopes() {
    let memory = Some(Memory { direct: 0.5, thresholds_v: &[10.0], weights: &[1.5] });
    let law = Some(Law { voltage_v: &[0.0, 100.0, 200.0], stiffness: &[0.0, 50.0, 350.0] });
    let [small, large] = [PLAIN.smallest_step_gain(sample_time()), PLAIN.largest_step_gain(sample_time())];
    for (plant, least, most) in [
        (ExtendedPlant { memory, ..PLAIN }, 0.5, 2.0),
        (ExtendedPlant { law, ..PLAIN }, 0.5, 3.0),
        (ExtendedPlant { memory, law, ..PLAIN }, 0.25, 6.0),
    ] {
        for (gain, plain, slope) in [
            (plant.smallest_step_gain(sample_time()), small, least),
            (plant.largest_step_gain(sample_time()), large, most),
        ] {
            assert!((gain.feedthrough - slope * plain.feedthrough).abs() < 1e-12, "{gain:?}");
            assert!((gain.in_one_tick - slope * plain.in_one_tick).abs() < 1e-12, "{gain:?}");
            assert_eq!(gain.relaxation, plain.relaxation);
        }
    }
}

/// Applies `voltages`, and then what the inverse asks for to change the stiffness at the end of the next tick. Returns
/// the change that comes.
fn changed(plant: &ExtendedPlant<'_>, voltages: &[f64], change: f64) -> f64 {
    let valid = plant.validate(sample_time()).unwrap();
    let (config, mut state) = (config(plant), State::default());
    let mut last = Volts::ZERO;
    for &voltage in voltages {
        last = volts(voltage);
        config.run(&mut state, last);
    }
    let inverse = ExtendedPlant::inverse(valid, &config, CODE_V);
    let held = config.predict(&state, last);
    let voltage = config.voltage_for(&state, &inverse, last, Signal::from_num(change));
    config.run(&mut state, voltage);
    // With the same voltage the next tick begins with the stiffness at the end of this one.
    (config.run(&mut state, voltage).0 - held.end).to_num()
}

proptest! {
    #[test]
    fn the_inverse_of_the_whole_chain_gives_the_change_that_was_asked_for(
        leak in prop::option::of((0.0..=0.95f64, 0.1..10.0f64)),
        plays in prop::option::of((0.3..1.0f64, 1.0..60.0f64, 0.0..0.7f64)),
        curve in prop::option::of((0.4..2.0f64, 0.4..2.0f64)),
        share in 0.05..0.5f64,
        voltages in prop::collection::vec(0.0..400.0f64, 1..30),
        change in -20.0..20.0f64,
    ) {
        let leakage = leak.map(|(share, time_constant_s)| Leakage { share, time_constant_s });
        let (direct, threshold, weight) = plays.unwrap_or_default();
        let (thresholds_v, weights) = ([threshold], [weight]);
        let memory = plays.map(|_| Memory { direct, thresholds_v: &thresholds_v, weights: &weights });
        let (first, second) = curve.unwrap_or_default();
        let values = [0.0, 150.0 * first, 150.0 * first + 300.0 * second];
        let law = curve.map(|_| Law { voltage_v: &[0.0, 150.0, 450.0], stiffness: &values });
        let plant = ExtendedPlant { memory, law, leakage, relaxation: Relaxation { share, ..LAGS } };
        let got = changed(&plant, &voltages, change);
        prop_assert!((got - change).abs() < 1e-4 * change.abs() + 1e-4, "{got} {change}");
    }
}

/// Where the time constant depends on the voltage the gain is interpolated between 0 V and the end of its range, exact
/// at both; the voltage of the step itself moves the time constant, so the step has to be small.
#[test]
fn the_inverse_of_a_varying_time_constant_is_exact_at_both_ends() {
    for high_s in [0.1, 0.03] {
        let relaxation =
            Relaxation { share: 0.0, time_constants_s: &[0.05], weights: &[1.0], time_constant_high_s: Some(high_s) };
        let plant = ExtendedPlant { relaxation, ..PLAIN };
        let valid = plant.validate(sample_time()).unwrap();
        let config = config(&plant);
        let inverse = ExtendedPlant::inverse(valid, &config, CODE_V);
        let exact = |tau: f64| 1.0 / (1.0 - f64::exp(-0.001 / tau));
        let end_s = f64::max(0.05 + 2.0 * (high_s - 0.05), 0.5 * f64::min(0.05, high_s));
        for (at_v, tau) in [(-50.0, 0.05), (0.0, 0.05), (1000.0, end_s), (1500.0, end_s)] {
            let got = inverse.change_of_law(Signal::from_num(at_v), Signal::from_num(4)).to_num::<f64>() / 4.0;
            assert!((got / exact(tau) - 1.0).abs() < 1e-4, "{high_s} s at {at_v} V: {got} {}", exact(tau));
        }
        // In between it lies between its ends, and above the chord's lower end.
        let middle = inverse.change_of_law(Signal::from_num(500), Signal::from_num(4)).to_num::<f64>() / 4.0;
        let (low, high) = (exact(0.05).min(exact(end_s)), exact(0.05).max(exact(end_s)));
        assert!(low < middle && middle < high, "{low} {middle} {high}");
    }
}

#[test]
fn a_spring_that_cannot_be_inverted_is_rejected_by_name() {
    let error = |plant: ExtendedPlant<'_>| plant.check_inverse().map_err(|error| error.field);
    let lags = |share, weights| ExtendedPlant { relaxation: Relaxation { share, weights, ..LAGS }, ..PLAIN };
    assert_eq!(error(PLAIN), Ok(()));
    assert_eq!(error(lags(0.5, &[-0.1, 0.2])), Err("relaxation.weights"));
    assert_eq!(error(lags(0.0, &[0.004, 0.004])), Err("relaxation.weights"));
    assert_eq!(error(lags(0.0, &[0.006, 0.006])), Ok(()));
    assert_eq!(error(lags(0.011, &[0.0, 0.0])), Ok(()));
    let leakage = |share| ExtendedPlant { leakage: Some(Leakage { share, time_constant_s: 1.0 }), ..PLAIN };
    assert_eq!(error(leakage(0.95)), Ok(()));
    assert_eq!(error(leakage(0.96)), Err("leakage.share"));
    let law = Some(Law { voltage_v: &[0.0, 100.0], stiffness: &[0.0, 0.5] });
    assert_eq!(error(ExtendedPlant { law, ..PLAIN }), Err("law.stiffness"));
    let memory = Some(Memory { direct: -1.0, thresholds_v: &[10.0], weights: &[0.5] });
    assert_eq!(error(ExtendedPlant { memory, ..PLAIN }), Err("memory.direct"));
}

#[test]
fn a_setting_of_any_block_out_of_range_is_rejected_by_name() {
    let error = |plant: ExtendedPlant<'_>| plant.validate(sample_time()).err().map(|error| error.field);
    let memory = Some(Memory { direct: f64::NAN, thresholds_v: &[10.0], weights: &[0.5] });
    let law = Some(Law { voltage_v: &[0.0, 100.0], stiffness: &[0.0, f64::NAN] });
    let leakage = Some(Leakage { share: f64::NAN, time_constant_s: 1.0 });
    let relaxation = Relaxation { share: f64::NAN, ..LAGS };
    assert_eq!(error(PLAIN), None);
    assert_eq!(error(ExtendedPlant { memory, ..PLAIN }), Some("memory.direct"));
    assert_eq!(error(ExtendedPlant { law, ..PLAIN }), Some("law.stiffness"));
    assert_eq!(error(ExtendedPlant { leakage, ..PLAIN }), Some("leakage.share"));
    assert_eq!(error(ExtendedPlant { relaxation, ..PLAIN }), Some("relaxation.share"));
}

/// A spring is plain only if no block extends it.
#[test]
fn the_plain_spring_has_one_constant_time_constant_and_its_whole_weight() {
    let one = |weights, high_s| {
        let relaxation = Relaxation { share: 0.1, time_constants_s: &[5.0], weights, time_constant_high_s: high_s };
        ExtendedPlant { relaxation, ..PLAIN }.plain()
    };
    assert_eq!(one(&[], None), Some(crate::Plant { share: 0.1, time_constant_s: 5.0 }));
    assert_eq!((one(&[0.8], None), one(&[], Some(6.0)), PLAIN.plain()), (None, None, None));
}

/// The pre-compensator subtracts the stiffness of the operating point from a target of up to 1000 V.
#[test]
fn the_stiffness_of_an_operating_point_is_at_least_minus_1000_v() {
    let relaxation = Relaxation { share: 5.0, time_constants_s: &[5.0], weights: &[-4.0], time_constant_high_s: None };
    let config = config(&ExtendedPlant { relaxation, ..PLAIN });
    let points: Vec<f64> = [100.0, -100.0, -400.0]
        .map(|voltage| {
            let mut state = State::default();
            config.run(&mut state, volts(voltage));
            config.operating_point(&state).stiffness.to_num()
        })
        .into();
    assert!((points[0] - 500.0).abs() < 0.2 && (points[1] + 500.0).abs() < 0.2, "{points:?}");
    assert_eq!(points[2], -1000.0);
}
