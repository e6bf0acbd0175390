//! Recovery of the proportional-integral controller from a limit: the voltage leaves it in the first tick in which the
//! target lies on the other side of the estimate, however long and far it was limited. Built with overflow checks.

use model::{Amplifier, Compensation, Gains, Input, Settings, State, Volts};
use proptest::prelude::*;

/// Distance of the target from the estimate, in V: more than a tick at 100 Hz moves the estimate by, and more than the
/// rounding of the smallest gain.
const BEYOND_V: f64 = 10.0;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn the_voltage_leaves_a_limit_in_the_first_tick_in_which_the_error_reverses(
        proportional in 0.5..20.0f64,
        integral_per_s in 0.1..10.0f64,
        rate_hz in prop::sample::select(vec![100.0, 1000.0, 10_000.0]),
        slew in prop::option::of(100.0..100_000.0f64),
        // Targets beyond both ends of the range, each for some ticks.
        targets in prop::collection::vec((-900.0..1500.0f64, 1..20_000u32), 1..6),
        upwards: bool,
        long in 1..200_000u32,
    ) {
        let compensation = Compensation::ProportionalIntegral(Gains { proportional, integral_per_s });
        let amplifier = Amplifier { slew_v_per_s: slew, ..Amplifier::PAPER };
        let settings = Settings { rate_hz, compensation, amplifier, ..Settings::PAPER };
        // Some gains are rejected for some rates.
        let Ok(validated) = settings.validate() else { return Ok(()) };
        let config = validated.quantize();
        let mut state = State::default();
        let run = |state: &mut State, target_v: f64, ticks: u32| {
            let input = Input { target: Volts::new(target_v).unwrap(), ..Input::default() };
            (0..ticks).map(|_| config.tick(state, input)).last().unwrap()
        };
        for (target_v, ticks) in targets {
            run(&mut state, target_v, ticks);
        }
        // The last of `long` ticks in which the voltage is at the limit.
        let (limit, far) = if upwards { (amplifier.max_v, 2000.0) } else { (amplifier.min_v, -1000.0) };
        let mut limited = None;
        for _ in 0..long {
            let output = run(&mut state, far, 1);
            if output.voltage.to_f64() == limit {
                limited = Some((state, output.stiffness.to_f64()));
            } else if limited.is_some() {
                break;
            }
        }
        let Some((mut state, stiffness_v)) = limited else { return Err(TestCaseError::reject("never limited")) };
        let towards = if upwards { -BEYOND_V } else { BEYOND_V };
        let after = run(&mut state, stiffness_v + towards, 1).voltage.to_f64();
        prop_assert!(if upwards { after < limit } else { after > limit }, "{after} V after {limit} V");
    }
}
