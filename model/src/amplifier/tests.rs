use super::*;
use crate::units::TWO_TO_20;
use proptest::prelude::*;
use std::vec::Vec;

fn config(amplifier: &Amplifier, rate_hz: f64) -> Config {
    amplifier.validate(SampleTime::from_rate(rate_hz).unwrap()).unwrap().quantize()
}

fn volts(value: f64) -> Volts {
    Volts::new(value).unwrap()
}

proptest! {
    #[test]
    fn a_code_survives_conversion_to_volts(full_scale in 50.0..1000.0f64, bits in 8u32..=16, part: f64) {
        let config = config(&Amplifier { dac_bits: bits, ..Amplifier::up_to(full_scale) }, 1000.0);
        let code = DacCode((part.abs().fract() * f64::from((1u32 << bits) - 1)) as u16);
        prop_assert_eq!(config.code(config.volts(code)), code);
    }

    #[test]
    fn the_output_stays_in_range_and_is_rounded_to_the_nearest_code(
        full_scale in 50.0..1000.0f64,
        (low, high) in (0.0..0.5f64, 0.6..1.0f64),
        bits in 8u32..=16,
        wanted in -2000.0..2000.0f64,
    ) {
        let (min_v, max_v) = (low * (full_scale - 30.0), high * full_scale);
        let amplifier = Amplifier { min_v, max_v, dac_bits: bits, ..Amplifier::up_to(full_scale) };
        let config = config(&amplifier, 1000.0);
        let (lowest, highest) = config.range();
        let unit = amplifier.volts_per_code();
        let inward = 0.0..unit + 3e-4;
        prop_assert!(inward.contains(&(lowest.to_f64() - min_v + 1.5e-4)));
        prop_assert!(inward.contains(&(max_v - highest.to_f64() + 1.5e-4)));

        let drive = config.drive(&mut State::default(), volts(wanted), Limits::NONE);
        let out = drive.applied;
        prop_assert!(out >= lowest && out <= highest, "{out:?} outside {lowest:?}..{highest:?}");
        let ideal = wanted.clamp(lowest.to_f64(), highest.to_f64());
        // A volt per code has 29 fraction bits: the voltage of a code is too low by less than 2 nV for each code below it.
        let too_low = 2e-9 * f64::from(drive.code.0);
        prop_assert!((out.to_f64() - ideal).abs() <= 0.503 * unit + 2e-6 + too_low);
        prop_assert_eq!(drive.limits.intersects(Limits::UPPER), volts(wanted) > highest);
        prop_assert_eq!(drive.limits.intersects(Limits::LOWER), volts(wanted) < lowest);
        prop_assert!(!drive.limits.intersects(Limits::SLEW), "no slew limit is set");
    }

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn the_mean_slew_is_exact_even_below_one_code_per_tick(slew in 1.0..5000.0f64, rate in 100.0..10_000.0f64) {
        let config = config(&Amplifier { slew_v_per_s: Some(slew), ..Amplifier::PAPER }, rate);
        let mut state = State::default();
        let ticks = (rate / 20.0) as u32;
        let mut drive = config.drive(&mut state, volts(700.0), Limits::NONE);
        for _ in 1..ticks {
            drive = config.drive(&mut state, volts(700.0), Limits::NONE);
        }
        let expected = (slew / rate * f64::from(ticks)).min(700.0);
        prop_assert!((drive.voltage.to_f64() - expected).abs() < 5e-5);
        prop_assert_eq!(drive.limits.intersects(Limits::SLEW), expected < 700.0);
    }

    /// Beyond the slew is only the part of a step that is carried over, one bit of a signal. A voltage within the range is never moved by it.
    #[test]
    fn no_tick_changes_the_voltage_by_more_than_the_slew(
        slew in 1.0..500_000.0f64,
        rate in 100.0..10_000.0f64,
        (low, high) in (0.0..300.0f64, 400.0..700.0f64),
        wanted in proptest::collection::vec(-2000.0..2000.0f64, 40),
    ) {
        let config = config(&Amplifier { slew_v_per_s: Some(slew), min_v: low, max_v: high, ..Amplifier::PAPER }, rate);
        let mut state = State::default();
        let voltages: Vec<f64> =
            wanted.iter().map(|&wanted| config.drive(&mut state, volts(wanted), Limits::NONE).voltage.to_f64()).collect();
        for (tick, pair) in voltages.windows(2).enumerate() {
            let change = (pair[1] - pair[0]).abs();
            prop_assert!(change <= slew / rate + 1.0 / TWO_TO_20, "tick {}: {} V at {} V/s", tick + 1, change, slew);
        }
    }
}

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let sample_time = SampleTime::from_rate(1000.0).unwrap();
    let good = Amplifier::PAPER;
    for (field, wrong) in [
        ("full_scale_v", Amplifier { full_scale_v: 1500.0, ..good }),
        ("full_scale_v", Amplifier { full_scale_v: f64::NAN, ..good }),
        ("dac_bits", Amplifier { dac_bits: 24, ..good }),
        ("min_v", Amplifier { min_v: -5.0, ..good }),
        ("max_v", Amplifier { min_v: 500.0, max_v: 300.0, ..good }),
        ("max_v", Amplifier { max_v: 701.0, ..good }),
        ("slew_v_per_s", Amplifier { slew_v_per_s: Some(0.0), ..good }),
    ] {
        assert_eq!(wrong.validate(sample_time).unwrap_err().field, field, "{wrong:?}");
    }
}

proptest! {
    #[test]
    fn an_end_of_the_range_that_is_the_voltage_of_a_code_keeps_that_code(
        full_scale in 50.0..1000.0f64,
        bits in 8u32..=16,
        (low, high) in (0.0..0.4f64, 0.6..1.0f64),
    ) {
        let codes = (1u32 << bits) - 1;
        let whole = Amplifier { dac_bits: bits, ..Amplifier::up_to(full_scale) };
        // Computed here from the definition of a code, not with `volts_per_code`.
        let unit = full_scale / f64::from(codes);
        let [lowest, highest] = [low, high].map(|part| DacCode((part * f64::from(codes)) as u16));
        let [min_v, max_v] = [lowest, highest].map(|code| f64::from(code.0) * unit);
        prop_assume!(max_v - min_v >= 10.0 && min_v <= full_scale - 10.0);
        let config = config(&Amplifier { min_v, max_v, ..whole }, 1000.0);
        let (from, to) = config.range();
        prop_assert_eq!((config.code(from), config.code(to)), (lowest, highest));
    }
}

#[test]
fn the_highest_code_stands_for_the_full_scale() {
    for (full_scale, bits, highest) in [(50.0, 8, 255), (700.0, 12, 4095), (1000.0, 16, 65_535)] {
        let config = config(&Amplifier { dac_bits: bits, ..Amplifier::up_to(full_scale) }, 1000.0);
        let (lowest, end) = config.range();
        assert_eq!((config.code(lowest), config.code(end)), (DacCode(0), DacCode(highest)));
        assert!((end.to_f64() - full_scale).abs() < 2e-4, "{bits} bits: {end:?}");
    }
}

#[test]
fn limited_to_keeps_the_stricter_of_two_limits() {
    let own = Amplifier { max_v: 500.0, slew_v_per_s: Some(2000.0), ..Amplifier::PAPER };
    let limits = |amplifier: Amplifier| (amplifier.max_v, amplifier.slew_v_per_s);
    assert_eq!(limits(own.limited_to(None, None)), (500.0, Some(2000.0)));
    assert_eq!(limits(own.limited_to(Some(300.0), None)), (300.0, Some(2000.0)));
    assert_eq!(limits(own.limited_to(Some(600.0), Some(3000.0))), (500.0, Some(2000.0)));
    assert_eq!(limits(own.limited_to(None, Some(100.0))), (500.0, Some(100.0)));
    assert_eq!(limits(Amplifier::PAPER.limited_to(None, Some(100.0))), (700.0, Some(100.0)));
    // The other settings stay, and NaN is rejected later instead of being ignored here.
    let limited = own.limited_to(Some(f64::NAN), Some(f64::NAN));
    assert!(limited.max_v.is_nan() && limited.slew_v_per_s.is_some_and(f64::is_nan));
    assert_eq!((limited.full_scale_v, limited.min_v, limited.dac_bits), (700.0, 0.0, 12));
}

#[test]
fn the_ends_of_the_range_are_at_least_10_v_apart_and_below_full_scale() {
    let sample_time = SampleTime::from_rate(1000.0).unwrap();
    let named =
        |min_v, max_v| Amplifier { min_v, max_v, ..Amplifier::PAPER }.check(sample_time).map_err(|error| error.field);
    assert_eq!(named(690.0, 700.0), Ok(()));
    assert_eq!(named(690.5, 700.0), Err("min_v"));
    assert_eq!(named(300.0, 310.0), Ok(()));
    assert_eq!(named(300.0, 309.5), Err("max_v"));
}

/// With limits of whole codes, so that the ends are exact.
#[test]
fn a_limit_is_reported_only_when_it_holds_the_voltage_back() {
    let config = config(&Amplifier { min_v: 100.0, max_v: 400.0, ..Amplifier::up_to(511.875) }, 1000.0);
    let (lowest, highest) = config.range();
    assert_eq!((lowest.to_f64(), highest.to_f64()), (100.0, 400.0));
    let limits = |from: f64, to: Volts| {
        let mut state = State::default();
        config.drive(&mut state, volts(from), Limits::NONE);
        config.drive(&mut state, to, Limits::NONE).limits
    };
    let step = Signal::from_bits(1);
    assert_eq!(limits(250.0, highest), Limits::NONE);
    assert_eq!(limits(250.0, Volts(highest.0 + step)), Limits::UPPER);
    assert_eq!(limits(250.0, lowest), Limits::NONE);
    assert_eq!(limits(250.0, Volts(lowest.0 - step)), Limits::LOWER);
    assert_eq!(config.clamp_target(highest), (highest, Limits::NONE));
    assert_eq!(config.clamp_target(Volts(highest.0 + step)), (highest, Limits::TARGET));
    assert_eq!(config.clamp_target(Volts(lowest.0 - step)), (lowest, Limits::TARGET));
}

/// A slew that crosses the whole range in one tick is not a limit; the range alone is reported, in the same tick.
#[test]
fn a_jump_over_the_whole_range_is_held_by_its_end_and_not_by_the_slew() {
    // 0.125 V per code, 511.875 V in one tick.
    for slew_v_per_s in [None, Some(511_875.0), Some(1e6)] {
        let config = config(&Amplifier { slew_v_per_s, ..Amplifier::up_to(511.875) }, 1000.0);
        let mut state = State::default();
        let up = config.drive(&mut state, volts(2000.0), Limits::NONE);
        assert_eq!((up.code, up.limits), (DacCode(4095), Limits::UPPER), "{slew_v_per_s:?}");
        let down = config.drive(&mut state, volts(-2000.0), Limits::NONE);
        assert_eq!((down.code, down.limits), (DacCode(0), Limits::LOWER), "{slew_v_per_s:?}");
    }
    // Just slower: the slew holds the voltage back.
    let config = config(&Amplifier { slew_v_per_s: Some(511_000.0), ..Amplifier::up_to(511.875) }, 1000.0);
    let drive = config.drive(&mut State::default(), volts(511.875), Limits::NONE);
    assert_eq!((drive.voltage, drive.limits), (volts(511.0), Limits::SLEW));
}

#[test]
fn the_state_keeps_the_limited_voltage_and_its_code() {
    let config = config(&Amplifier::PAPER, 1000.0);
    let mut state = State::default();
    assert_eq!((state.voltage(), config.applied(&state)), (Volts::ZERO, Volts::ZERO));
    let drive = config.drive(&mut state, volts(123.4), Limits::NONE);
    assert_eq!((state.voltage(), config.applied(&state)), (volts(123.4), drive.applied));
}

#[test]
fn each_limit_has_its_own_bit_in_the_telemetry() {
    let named = [(Limits::UPPER, 1), (Limits::LOWER, 2), (Limits::SLEW, 4), (Limits::TARGET, 8)];
    for (limit, bit) in named {
        assert_eq!(limit.bits(), bit);
        for (other, _) in named {
            assert_eq!(limit.intersects(other), limit == other);
        }
    }
    let both = Limits::UPPER.with(Limits::SLEW);
    assert_eq!((both.bits(), both.intersects(Limits::SLEW), both.with(Limits::SLEW)), (5, true, both));
    assert!(!Limits::NONE.intersects(both));
}

#[test]
fn the_slew_is_the_same_in_both_directions() {
    let config = config(&Amplifier { slew_v_per_s: Some(1000.0), ..Amplifier::PAPER }, 1000.0);
    let mut state = State::default();
    let up: Vec<f64> =
        (0..300).map(|_| config.drive(&mut state, volts(300.0), Limits::NONE).voltage.to_f64()).collect();
    let down: Vec<f64> =
        (0..300).map(|_| config.drive(&mut state, volts(0.0), Limits::NONE).voltage.to_f64()).collect();
    for (tick, (up, down)) in up.into_iter().zip(down).enumerate() {
        assert_eq!((up, down), (tick as f64 + 1.0, 299.0 - tick as f64));
    }
}
