use super::*;
use proptest::prelude::*;
use std::vec::Vec;

const BANK: Memory<'_> = Memory { direct: 0.5, thresholds_v: &[10.0, 40.0], weights: &[0.3, 0.2] };

fn sample_time() -> SampleTime {
    SampleTime::from_rate(1000.0).unwrap()
}

fn walk(memory: &Memory<'_>, voltages: &[f64]) -> f64 {
    let (config, mut state) = (memory.validate(sample_time()).unwrap().quantize(), State::default());
    let outputs = voltages.iter().map(|&voltage| config.run(&mut state, Signal::from_num(voltage)).to_num());
    outputs.last().unwrap_or(0.0)
}

#[test]
fn a_bank_follows_the_values_computed_by_hand_up_and_back() {
    for (voltages, expected) in [
        (&[100.0][..], 50.0 + 0.3 * 90.0 + 0.2 * 60.0),
        // A play stays while the voltage turns by less than twice its threshold.
        (&[100.0, 85.0], 42.5 + 0.3 * 90.0 + 0.2 * 60.0),
        (&[100.0, 50.0], 25.0 + 0.3 * 60.0 + 0.2 * 60.0),
        (&[100.0, 0.0], 0.3 * 10.0 + 0.2 * 40.0),
    ] {
        let got = walk(&BANK, voltages);
        assert!((got - expected).abs() < 1e-5, "{voltages:?}: {got} {expected}");
    }
}

proptest! {
    /// Only the turns of the voltage are remembered, and only until a larger loop passes them.
    #[test]
    fn a_closed_loop_leaves_no_trace(peak in 200.0..900.0f64, low in 0.0..150.0f64, inner in 150.0..200.0f64) {
        let straight = walk(&BANK, &[peak, low, peak]);
        let detour = walk(&BANK, &[peak / 3.0, peak, low, inner, low, 0.5 * (low + inner), peak]);
        prop_assert!((straight - detour).abs() < 1e-5, "{straight} {detour}");
    }
}

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let named = |direct, thresholds_v: &[f64], weights: &[f64]| {
        Memory { direct, thresholds_v, weights }.validate(sample_time()).unwrap_err().field
    };
    assert_eq!(named(f64::NAN, &[], &[]), "memory.direct");
    assert_eq!(named(1.0, &[-1.0], &[0.1]), "memory.thresholds_v");
    assert_eq!(named(1.0, &[1.0; 9], &[0.1; 9]), "memory.thresholds_v");
    assert_eq!(named(1.0, &[1.0], &[]), "memory.weights");
    // Each weight is allowed, but not all of them together.
    assert_eq!(named(4.0, &[1.0, 2.0], &[4.0, -4.0]), "memory.weights");
}

#[test]
fn the_slopes_are_those_after_a_turn_and_in_motion() {
    let memory = |direct, weights| Memory { direct, thresholds_v: &[10.0, 20.0], weights };
    let slopes = |memory: Memory<'_>| (memory.slope_at_turn(), memory.largest_slope());
    assert_eq!(slopes(memory(0.5, &[0.25, 0.25])), (0.5, 1.0));
    // At least a quarter of the slope in motion.
    assert_eq!(slopes(memory(0.0, &[0.75, 0.25])), (0.25, 1.0));
    assert_eq!(slopes(memory(-0.5, &[2.0, 0.5])), (0.5, 2.5));
    assert_eq!(slopes(memory(1.0, &[0.5, -0.5])), (1.0, 1.5));
}

#[test]
fn a_bank_can_be_inverted_if_it_rises_once_all_plays_move() {
    let error = |direct, weight| {
        Memory { direct, thresholds_v: &[10.0], weights: &[weight] }.check_inverse().map_err(|error| error.field)
    };
    assert_eq!(error(0.0, 0.011), Ok(()));
    assert_eq!(error(1.0, -0.98), Ok(()));
    assert_eq!(error(0.0, 0.009), Err("memory.direct"));
    assert_eq!(error(1.0, -1.0), Err("memory.direct"));
}

#[test]
fn up_to_eight_plays_of_up_to_1000_v_share_one_budget_of_weights() {
    let error = |direct, thresholds_v: &[f64], weights: &[f64]| {
        Memory { direct, thresholds_v, weights }.check(sample_time()).map_err(|error| error.field)
    };
    assert_eq!(error(2.0, &[1.0; 8], &[-1.0; 8]), Ok(()));
    assert_eq!(error(2.5, &[1.0; 8], &[-1.0; 8]), Err("memory.weights"));
    assert_eq!(error(-10.5, &[], &[]), Err("memory.direct"));
    assert_eq!(error(1.0, &[0.0, 1000.0], &[0.1, 0.1]), Ok(()));
    assert_eq!(error(1.0, &[1000.5], &[0.1]), Err("memory.thresholds_v"));
}

/// Voltage of one DAC code.
const CODE_V: f64 = 0.17;

/// Returns what a bank gives after the inverse was asked for `change` from the state that `voltages` leave, and the
/// voltage it asked for.
fn inverted(memory: &Memory<'_>, voltages: &[f64], change: f64) -> (f64, f64) {
    let (config, mut state) = (memory.validate(sample_time()).unwrap().quantize(), State::default());
    let mut last = (Signal::ZERO, Signal::ZERO);
    for &voltage in voltages {
        last = (signal(voltage), config.run(&mut state, signal(voltage)));
    }
    let inverse = Inverse::new(&config, CODE_V);
    let voltage = inverse.voltage(&config, &state, last.0, signal(change));
    let output = config.run(&mut state, voltage);
    ((output - last.1).to_num(), voltage.to_num())
}

proptest! {
    /// Banks whose every piece rises, after any voltages: the change that was asked for is the change that comes.
    #[test]
    fn the_inverse_of_a_rising_bank_is_exact(
        direct in 0.2..1.0f64,
        plays in prop::collection::vec((0.0..100.0f64, 0.0..0.3f64), 0..=8),
        voltages in prop::collection::vec(0.0..500.0f64, 1..12),
        change in -150.0..150.0f64,
    ) {
        let (thresholds_v, weights): (Vec<f64>, Vec<f64>) = plays.into_iter().unzip();
        let memory = Memory { direct, thresholds_v: &thresholds_v, weights: &weights };
        let (got, voltage) = inverted(&memory, &voltages, change);
        prop_assert!((got - change).abs() < 1e-4, "{got} {change}, {voltage} V");
    }
}

/// A bank without a direct part does not respond at first when the voltage turns.
#[test]
fn a_level_piece_is_crossed_for_more_than_a_code_and_not_for_less() {
    let play = Memory { direct: 0.0, thresholds_v: &[10.0], weights: &[2.0] };
    // One code where the bank is steepest is 2 * 0.17 V.
    for sign in [1.0, -1.0] {
        // The play still moves in this direction: there is no level piece.
        for change in [0.1, 0.3, 5.0] {
            let (got, voltage) = inverted(&play, &[100.0 - 50.0 * sign, 100.0], sign * change);
            assert!((got - sign * change).abs() < 1e-4, "{got} {change}");
            assert!((voltage - 100.0 - sign * change / 2.0).abs() < 1e-4, "{voltage} V");
        }
        // After a turn the voltage has 20 V to go before the play moves.
        let turned = |change: f64| inverted(&play, &[100.0 + 50.0 * sign, 100.0], sign * change);
        assert_eq!(turned(0.3).1, 100.0);
        let (got, voltage) = turned(0.36);
        assert!((got - sign * 0.36).abs() < 1e-4, "{got} V");
        assert!((voltage - 100.0 - sign * 20.18).abs() < 1e-4, "{voltage} V");
    }
}

/// Without order the inverse would take a play for resting that already moves.
#[test]
fn the_order_in_which_plays_are_listed_changes_neither_the_bank_nor_its_inverse() {
    let sorted = Memory { direct: 0.3, thresholds_v: &[5.0, 20.0, 60.0], weights: &[0.4, 0.1, 0.2] };
    let others = [
        Memory { direct: 0.3, thresholds_v: &[60.0, 20.0, 5.0], weights: &[0.2, 0.1, 0.4] },
        Memory { direct: 0.3, thresholds_v: &[20.0, 5.0, 60.0], weights: &[0.1, 0.4, 0.2] },
    ];
    let expected = sorted.validate(sample_time()).unwrap().quantize();
    for other in others {
        assert_eq!(other.validate(sample_time()).unwrap().quantize(), expected);
    }
}
