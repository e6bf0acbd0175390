use super::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn a_gain_rounds_down_by_at_most_one_step(gain in -100.0..100.0f64, volts in -20.0..20.0f64) {
        let signal = Signal::from_num(volts);
        let got = f64::from(Gain::new(gain).times(signal).to_bits());
        let exact = gain * f64::from(signal.to_bits());
        prop_assert!(got <= exact + 0.01 && got > exact - 1.01, "{got} {exact}");
    }

    #[test]
    fn a_wide_gain_is_exact_to_2e_9_or_saturates(exponent in -31.0..28.0f64, volts in -2000.0..2000.0f64) {
        let (factor, signal) = (libm::exp2(exponent), Signal::from_num(volts));
        let got = WideGain::new(factor).times(signal).to_num::<f64>();
        let exact = (factor * signal.to_num::<f64>()).clamp(-2048.0, Signal::MAX.to_num());
        prop_assert!((got - exact).abs() < exact.abs() * 2e-9 + 1e-6, "{got} {exact}");
    }

    #[test]
    fn a_rate_keeps_its_precision_over_eight_decades(exponent in -8.0..-0.302f64, volts in -1000.0..1000.0f64) {
        let (rate, lag) = (libm::pow(10.0, exponent), Signal::from_num(volts));
        let got = Rate::new(rate).step(lag).to_bits() as f64;
        let exact = rate * f64::from(lag.to_bits()) * TWO_TO_32;
        prop_assert!((got - exact).abs() <= exact.abs() * 1e-15 + 2.0, "{got} {exact}");
    }
}

#[test]
fn gains_of_and_near_one_half_are_exact() {
    for value in [0.0, 0.5, -0.5, 1.5, 0.499_999_999_99, 99.5, 1.0 - 1e-12] {
        let got = Gain::new(value).times(Signal::from_num(16)).to_num::<f64>();
        assert!((got - 16.0 * value).abs() < 2e-6, "{value} {got}");
    }
}

proptest! {
    /// The mantissa has 30 significant bits, so half of its last place is at most 2^-30 of the factor.
    #[test]
    fn a_wide_gain_is_the_nearest_of_its_format(exponent in -31.9..29.0f64) {
        let factor = libm::exp2(exponent);
        let WideGain { mantissa, shift } = WideGain::new(factor);
        let got = f64::from(mantissa) * libm::exp2(-f64::from(shift));
        prop_assert!((got / factor - 1.0).abs() <= 1.0 / f64::from(1 << 30), "{got} {factor}");
    }

    #[test]
    fn a_sum_is_exact_before_it_is_rounded_down(weights in prop::array::uniform4(-2.5..2.5f64), volts in -1000.0..1000.0f64) {
        let signal = Signal::from_num(volts);
        let weights = weights.map(Weight::new);
        let exact: f64 = weights.iter().map(|weight| weight.to_f64() * signal.to_num::<f64>()).sum();
        let got = weights.iter().fold(sum(Signal::ZERO), |sum, weight| sum + weight.times(signal));
        let expected = (exact * 1_048_576.0).floor().clamp(f64::from(i32::MIN), f64::from(i32::MAX));
        prop_assert_eq!(f64::from(saturated(got).to_bits()), expected);
        prop_assert_eq!(saturated(sum(signal)), signal);
    }
}

#[test]
fn a_wide_gain_saturates_at_the_ends_of_its_range() {
    let one = Signal::from_bits(1 << 20);
    for (factor, expected) in [(1e-30, 0), (2e9, i32::MAX), (1.0, 1 << 20), (0.5, 1 << 19), (3.0, 3 << 20)] {
        assert_eq!(WideGain::new(factor).times(one).to_bits(), expected, "{factor}");
    }
    assert_eq!(WideGain::new(1e-30), WideGain::new(1.0 / TWO_TO_32));
    assert_eq!(WideGain::new(1e30), WideGain::new(536_870_912.0));
}

#[test]
fn the_magnitudes_of_all_weights_in_a_sum_share_one_budget() {
    let spent = |budget, value| Weight::spend("weights", value, budget).map_err(|error| error.field);
    assert_eq!(spent(10.0, 4.0), Ok(6.0));
    assert_eq!(spent(10.0, -4.0), Ok(6.0));
    assert_eq!(spent(6.0, -6.0), Ok(0.0));
    assert_eq!(spent(6.0, 6.5), Err("weights"));
    assert_eq!(spent(6.0, -6.5), Err("weights"));
}

#[cfg(feature = "time-optimal")]
#[test]
fn a_signal_divided_by_a_weight_and_multiplied_again_is_the_signal() {
    for factor in [1.0, -2.5, 0.125, 10.0, 1.0 / 3.0] {
        for volts in [0.0, 1.0, -7.5, 100.0] {
            let (weight, signal) = (Weight::new(factor), Signal::from_num(volts));
            let quotient = weight.divide(signal);
            assert!((quotient.to_num::<f64>() - volts / weight.to_f64()).abs() < 2e-6, "{volts} / {factor}");
            assert!((saturated(weight.times(quotient)) - signal).abs() <= Signal::from_bits(11), "{volts} / {factor}");
        }
    }
    assert_eq!(Weight::new(0.001).divide(Signal::from_num(1000)), Signal::MAX);
    assert_eq!(Weight::new(0.001).divide(Signal::from_num(-1000)), Signal::MIN);
    assert_eq!(Weight::default().divide(Signal::ZERO), Signal::ZERO);
}
