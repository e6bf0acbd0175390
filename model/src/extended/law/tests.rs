use super::*;
use proptest::prelude::*;
use std::vec::Vec;

fn sample_time() -> SampleTime {
    SampleTime::from_rate(1000.0).unwrap()
}

fn at(law: &Law<'_>, input: f64) -> f64 {
    law.validate(sample_time()).unwrap().quantize().at(Signal::from_num(input)).to_num()
}

proptest! {
    /// The law is the curve that a sum of changes of slope gives.
    #[test]
    fn the_law_is_linear_between_its_points(
        lines in prop::collection::vec((1.0..100.0f64, -2.0..2.0f64), 1..=8),
        input in -500.0..1000.0f64,
    ) {
        let (mut voltage_v, mut stiffness) = (Vec::from([0.0]), Vec::from([0.0]));
        let (mut expected, mut before) = (0.0, 0.0);
        for (line, (width, slope)) in lines.into_iter().enumerate() {
            let start = voltage_v[line];
            let beyond = if line == 0 { input } else { (input - start).max(0.0) };
            expected += (slope - before) * beyond;
            before = slope;
            voltage_v.push(start + width);
            stiffness.push(stiffness[line] + slope * width);
        }
        let got = at(&Law { voltage_v: &voltage_v, stiffness: &stiffness }, input);
        let expected = expected.clamp(-2048.0, 2048.0);
        prop_assert!((got - expected).abs() < 1e-4, "{got} {expected}");
    }
}

#[test]
fn a_value_beyond_the_signal_range_saturates() {
    let steep = Law { voltage_v: &[0.0, 100.0], stiffness: &[0.0, 900.0] };
    assert_eq!(at(&steep, 2000.0), Signal::MAX.to_num::<f64>());
    assert_eq!(at(&steep, -2000.0), Signal::MIN.to_num::<f64>());
    assert!((at(&steep, -100.0) + 900.0).abs() < 1e-4);
}

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let named =
        |voltage_v: &[f64], stiffness: &[f64]| Law { voltage_v, stiffness }.validate(sample_time()).unwrap_err().field;
    assert_eq!(named(&[0.0], &[0.0]), "law.voltage_v");
    assert_eq!(named(&[0.0; 10], &[0.0; 10]), "law.voltage_v");
    assert_eq!(named(&[0.0, 1.0], &[0.0]), "law.stiffness");
    assert_eq!(named(&[0.0, 0.0], &[0.0, 1.0]), "law.voltage_v");
    assert_eq!(named(&[0.0, f64::NAN], &[0.0, 1.0]), "law.voltage_v");
    assert_eq!(named(&[0.0, 1.0], &[1.0, 2.0]), "law.stiffness");
    assert_eq!(named(&[0.0, 1.0], &[0.0, 11.0]), "law.stiffness");
    assert_eq!(named(&[0.0, 1.0], &[0.0, f64::NAN]), "law.stiffness");
}

/// Slopes of thirds, which no weight represents: only the line that starts at a point gives its exact value there.
#[test]
fn each_line_and_its_inverse_start_exactly_at_their_point() {
    let law = Law { voltage_v: &[0.0, 299.0, 997.0, 1000.0], stiffness: &[0.0, 100.0, 350.0, 370.0] };
    let config = law.validate(sample_time()).unwrap().quantize();
    let inverse = Inverse::new(&law);
    for (&voltage, &value) in law.voltage_v.iter().zip(law.stiffness).take(3) {
        let (voltage, value) = (signal(voltage), signal(value));
        assert_eq!(config.at(voltage), value);
        assert_eq!(inverse.at(&config, value), voltage);
    }
}

#[test]
fn the_slopes_are_those_of_the_flattest_and_the_steepest_line() {
    let law = Law { voltage_v: &[0.0, 100.0, 200.0, 250.0], stiffness: &[0.0, 50.0, 250.0, 275.0] };
    assert_eq!((law.smallest_slope(), law.largest_slope()), (0.5, 2.0));
    let falling = Law { voltage_v: &[0.0, 100.0], stiffness: &[0.0, -300.0] };
    assert_eq!((falling.smallest_slope(), falling.largest_slope()), (-3.0, 0.0));
}

#[test]
fn points_are_at_least_1_mv_apart_and_lines_at_most_as_steep_as_10() {
    let error = |voltage_v: &[f64], stiffness: &[f64]| {
        Law { voltage_v, stiffness }.check(sample_time()).map_err(|error| error.field)
    };
    assert_eq!(error(&[0.0, 1.0, 1.0011], &[0.0, 1.0, 1.0]), Ok(()));
    assert_eq!(error(&[0.0, 1.0, 1.0005], &[0.0, 1.0, 1.0]), Err("law.voltage_v"));
    assert_eq!(error(&[0.0, 500.0, 1000.5], &[0.0, 1.0, 1.0]), Err("law.voltage_v"));
    for sign in [1.0, -1.0] {
        assert_eq!(error(&[0.0, 100.0, 150.0], &[0.0, 10.0, 10.0 + sign * 499.0]), Ok(()));
        assert_eq!(error(&[0.0, 100.0, 150.0], &[0.0, 10.0, 10.0 + sign * 501.0]), Err("law.stiffness"));
        assert_eq!(error(&[0.0, 500.0], &[0.0, sign * 2000.0]), Ok(()));
        assert_eq!(error(&[0.0, 500.0], &[0.0, sign * 2001.0]), Err("law.stiffness"));
    }
}

#[test]
fn a_law_can_be_inverted_if_each_line_rises_by_at_least_a_hundredth() {
    let error = |voltage_v: &[f64], stiffness: &[f64]| {
        Law { voltage_v, stiffness }.check_inverse().map_err(|error| error.field)
    };
    for (rise, accepted) in [(1.1, true), (0.9, false), (0.0, false), (-1.0, false)] {
        let expected = if accepted { Ok(()) } else { Err("law.stiffness") };
        assert_eq!(error(&[0.0, 100.0], &[0.0, rise]), expected, "{rise} V over 100 V");
        assert_eq!(error(&[0.0, 300.0, 400.0], &[0.0, 300.0, 300.0 + rise]), expected, "{rise} V over 100 V");
    }
}
