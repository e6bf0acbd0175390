//! Tests of what each pre-compensator asks for first, at rest.

use super::*;

#[test]
fn the_first_voltage_is_beyond_the_target_with_every_pre_compensator_and_the_target_without() {
    for (compensation, least_v) in [
        (Compensation::None, 50.0),
        (Compensation::ProportionalIntegral(Gains::PAPER), 140.0),
        (Compensation::TimeOptimal(Approach::DEAD_BEAT), 500.0),
        (Compensation::Robust(Margin::TYPICAL), 500.0),
    ] {
        let config = quantized(&Settings { compensation, ..Settings::PAPER });
        let (lowest, highest) = config.range();
        assert!(lowest == Volts::ZERO && (699.8..=700.0).contains(&highest.to_f64()), "{highest:?}");
        let first = config.tick(&mut State::default(), input(50.0)).voltage.to_f64();
        assert!((least_v..least_v + 60.0).contains(&first), "{compensation:?}: {first} V");
    }
}
