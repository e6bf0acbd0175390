use super::*;

/// The slowest lag of 3000 s is integrated even at 10 kHz.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_step_response_is_the_exact_sum_of_exponentials_at_any_rate() {
    let relaxation = Relaxation {
        share: 0.1,
        time_constants_s: &[0.3, 2.0, 40.0, 3000.0],
        weights: &[0.5, 0.2, 0.15, 0.05],
        time_constant_high_s: None,
    };
    for rate_hz in [100.0, 10_000.0] {
        let config = relaxation.validate(SampleTime::from_rate(rate_hz).unwrap()).unwrap().quantize();
        let (mut state, input) = (State::default(), Signal::from_num(600));
        for tick in 0..(10.0 * rate_hz) as u32 {
            let time = f64::from(tick) / rate_hz;
            let lags = relaxation.lags().map(|(tau, weight)| weight * (1.0 - (-time / tau).exp()));
            let exact = 600.0 * (0.1 + lags.sum::<f64>());
            let got = config.stiffness(&state, input).to_num::<f64>();
            assert!((got - exact).abs() < 1e-4, "{rate_hz} Hz, {time} s: {got} {exact}");
            config.advance(&mut state, input, Signal::ZERO);
        }
    }
}

#[test]
fn a_single_lag_without_a_weight_has_what_the_share_leaves() {
    let relaxation = Relaxation { share: 0.25, time_constants_s: &[5.0], weights: &[], time_constant_high_s: None };
    assert!(relaxation.lags().eq([(5.0, 0.75)]));
}

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let named = |share, time_constants_s: &[f64], weights: &[f64], time_constant_high_s| {
        let relaxation = Relaxation { share, time_constants_s, weights, time_constant_high_s };
        relaxation.validate(SampleTime::from_rate(1000.0).unwrap()).unwrap_err().field
    };
    assert_eq!(named(-0.1, &[5.0], &[], None), "relaxation.share");
    assert_eq!(named(0.1, &[], &[], None), "relaxation.tau_s");
    assert_eq!(named(0.1, &[5.0; 5], &[0.1; 5], None), "relaxation.tau_s");
    assert_eq!(named(0.1, &[5.0, 0.001], &[0.4, 0.4], None), "relaxation.tau_s");
    assert_eq!(named(0.1, &[5.0, 9.0], &[], None), "relaxation.weights");
    assert_eq!(named(0.1, &[5.0, 9.0], &[0.4, 10.0], None), "relaxation.weights");
    assert_eq!(named(0.1, &[5.0], &[], Some(51.0)), "relaxation.tau_high_s");
    assert_eq!(named(0.1, &[0.003], &[], Some(0.005)), "relaxation.tau_s");
    assert_eq!(named(0.1, &[5.0], &[], Some(f64::NAN)), "relaxation.tau_high_s");
}

#[test]
fn each_bound_of_a_relaxation_is_where_it_is_documented() {
    let error = |share, time_constants_s: &[f64], weights: &[f64], time_constant_high_s| {
        let relaxation = Relaxation { share, time_constants_s, weights, time_constant_high_s };
        relaxation.check(SampleTime::from_rate(1000.0).unwrap()).map_err(|error| error.field)
    };
    // Shares and weights add up to at most 10, whatever their signs.
    assert_eq!(error(9.0, &[5.0], &[1.0], None), Ok(()));
    assert_eq!(error(9.5, &[5.0], &[1.0], None), Err("relaxation.weights"));
    assert_eq!(error(1.0, &[5.0, 6.0], &[-5.0, 4.0], None), Ok(()));
    assert_eq!(error(1.0, &[5.0, 6.0], &[-5.0, 4.5], None), Err("relaxation.weights"));
    // Two sample times; four for one that varies, at both ends, but not for the others.
    assert_eq!(error(0.1, &[0.002], &[], None), Ok(()));
    assert_eq!(error(0.1, &[0.0019], &[], None), Err("relaxation.tau_s"));
    assert_eq!(error(0.1, &[0.004, 0.002], &[0.1, 0.1], Some(0.004)), Ok(()));
    assert_eq!(error(0.1, &[0.0039], &[], Some(0.005)), Err("relaxation.tau_s"));
    assert_eq!(error(0.1, &[0.005], &[], Some(0.0039)), Err("relaxation.tau_high_s"));
    assert_eq!(error(0.1, &[0.004, 0.0019], &[0.1, 0.1], Some(0.004)), Err("relaxation.tau_s"));
    // A tenth to ten times the one at 0 V, and at most 10 000 s.
    for (high, accepted) in [(0.51, true), (0.49, false), (49.0, true), (51.0, false)] {
        let expected = if accepted { Ok(()) } else { Err("relaxation.tau_high_s") };
        assert_eq!(error(0.1, &[5.0], &[], Some(high)), expected, "{high} s");
    }
    assert_eq!(error(0.1, &[5000.0], &[], Some(10_000.0)), Ok(()));
    assert_eq!(error(0.1, &[5000.0], &[], Some(10_001.0)), Err("relaxation.tau_high_s"));
    assert_eq!(error(0.1, &[10_001.0], &[], None), Err("relaxation.tau_s"));
}

/// A time constant that depends on the voltage gives, at a constant voltage, the exponential of its value there; the
/// other lags are not affected.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_step_response_at_any_voltage_has_the_time_constant_of_that_voltage() {
    let sample_time = SampleTime::from_rate(1000.0).unwrap();
    for (high_s, volts) in [(8.0, 0.0), (8.0, 500.0), (8.0, 900.0), (2.5, 400.0), (2.5, 1000.0)] {
        let relaxation = Relaxation {
            share: 0.1,
            time_constants_s: &[5.0, 0.5],
            weights: &[0.6, 0.3],
            time_constant_high_s: Some(high_s),
        };
        let first_s = f64::max(5.0 + (high_s - 5.0) * volts / 500.0, 0.5 * f64::min(5.0, high_s));
        let (config, mut state) = (relaxation.validate(sample_time).unwrap().quantize(), State::default());
        let input = Signal::from_num(600);
        for tick in 0..3000 {
            let time = f64::from(tick) / 1000.0;
            let settled = |tau: f64| 1.0 - (-time / tau).exp();
            let exact = 600.0 * (0.1 + 0.6 * settled(first_s) + 0.3 * settled(0.5));
            let got = config.stiffness(&state, input).to_num::<f64>();
            assert!((got - exact).abs() < 2e-3, "{high_s} s at {volts} V, {time} s: {got} {exact}");
            config.advance(&mut state, input, Signal::from_num(volts));
        }
    }
}

/// The response of the lags to one volt for one tick, at every voltage from 0 to 1000 V.
#[test]
fn the_step_gains_are_the_smallest_and_the_largest_over_all_voltages() {
    let sample_time = SampleTime::from_rate(1000.0).unwrap();
    for (high_s, weights) in [
        (None, [0.5, 0.4]),
        (Some(0.3), [0.5, 0.4]),
        (Some(0.02), [0.5, 0.4]),
        (Some(0.3), [0.5, -0.4]),
        (Some(0.02), [0.5, -0.4]),
        (Some(0.02), [-0.5, 0.4]),
    ] {
        let relaxation =
            Relaxation { share: 0.2, time_constants_s: &[0.05, 0.01], weights: &weights, time_constant_high_s: high_s };
        let at = |volts: f64| relaxation.lags_at(volts).map(|(tau, weight)| (1.0 - (-0.001 / tau).exp(), weight));
        let voltages = || (0..=1000).map(f64::from);
        let extremes = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        let (slowest, fastest) = extremes(&mut voltages().flat_map(|volts| at(volts).map(|(part, _)| part)));
        let smallest = relaxation.smallest_step_gain(sample_time);
        let largest = relaxation.largest_step_gain(sample_time);
        assert_eq!((smallest.feedthrough, largest.feedthrough), (0.2, 0.2));
        let near = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-12, "{high_s:?}: {got} {expected}");
        near(smallest.relaxation, slowest);
        near(largest.relaxation, fastest);
        let rising = |volts: f64| at(volts).map(|(part, weight)| part * weight.max(0.0)).sum::<f64>();
        near(largest.in_one_tick, extremes(&mut voltages().map(rising)).1);
        // At the voltage of the longest time constant; for a rising spring that is the smallest over all voltages.
        if weights.iter().all(|&weight| weight >= 0.0) {
            near(smallest.in_one_tick, extremes(&mut voltages().map(rising)).0);
        }
    }
}
