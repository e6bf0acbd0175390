use super::*;

/// Returns how often the gain is divided by four for a mismatch that changes its side every `half_s`, each time
/// with `ratio` of its previous amplitude.
fn reductions(half_s: f64, ratio: f64, sides: u32) -> u8 {
    let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
    let mut state = State::default();
    let target = Signal::from_num(300);
    // Long enough at rest for the envelope to close.
    (0..20_000).for_each(|_| config.track_target(&mut state, target));
    let mut amplitude = 200.0;
    for _ in 0..sides {
        for _ in 0..(half_s * 1e3) as u32 {
            config.track_target(&mut state, target);
            config.detect(&mut state, Signal::from_num(amplitude), Signal::from_num(6));
        }
        amplitude *= -ratio;
    }
    state.reductions
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn only_an_oscillation_that_is_fast_and_does_not_decay_reduces_the_gain() {
    let six = u32::from(SWINGS);
    assert_eq!(reductions(0.05, 1.0, six - 1), 0);
    // The mean has to settle first: the first amplitudes decay.
    assert_eq!(reductions(0.05, 1.0, six + 3), 1);
    assert_eq!(reductions(0.05, 1.05, six + 3), 1);
    assert_eq!(reductions(0.05, 1.0, 100), MAX_REDUCTIONS);
    assert_eq!(reductions(0.05, 0.8, 100), 0);
    assert_eq!(reductions(1.2 * PAUSE_S, 1.0, 100), 0);
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_crossing_counts_up_to_the_longest_pause_after_the_last_one() {
    assert!(reductions(PAUSE_S, 1.0, 60) > 0);
    assert_eq!(reductions(PAUSE_S + 0.001, 1.0, 60), 0);
}

#[test]
fn an_amplitude_that_shrinks_by_more_than_a_sixteenth_decays() {
    let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
    let step = Signal::from_bits(1);
    for (amplitude, counted) in [(Signal::from_num(150), 1), (Signal::from_num(150) - step, 0)] {
        let mut state = State { above: true, last_amplitude: Signal::from_num(160), ..State::default() };
        config.detect(&mut state, -amplitude, Signal::from_num(6));
        assert_eq!((state.crossings, state.above), (counted, false), "{amplitude}");
        assert_eq!((state.last_amplitude, state.amplitude), (amplitude, Signal::ZERO));
    }
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn only_crossings_of_more_than_the_gate_on_both_sides_count() {
    // The gate at rest is the noise passed in, 6 V; the mean stays within 0.2 V of zero.
    let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
    let crossings = |amplitude: f64| {
        let mut state = State::default();
        for tick in 0..400 {
            let side = if tick / 20 % 2 == 0 { 1.0 } else { -1.0 };
            config.detect(&mut state, Signal::from_num(side * amplitude), Signal::from_num(6));
        }
        (state.crossings, state.reductions)
    };
    assert_eq!(crossings(5.5), (0, 0));
    assert_ne!(crossings(6.5), (0, 0));
}

#[test]
fn each_reduction_divides_a_step_of_the_correction_by_four() {
    let step = Accumulator::from_num(64);
    for (reductions, left) in [(0, 64), (1, 16), (2, 4), (3, 1)] {
        let state = State { reductions, ..State::default() };
        assert_eq!(state.reduce(step), Accumulator::from_num(left));
        assert_eq!(state.reduce(-step), Accumulator::from_num(-left));
    }
}

#[test]
fn counters_stay_at_their_ends() {
    let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
    let reduced = State { crossings: u8::MAX, since: u32::MAX, reductions: MAX_REDUCTIONS, ..State::default() };
    let mut state = reduced;
    config.detect(&mut state, Signal::ZERO, Signal::from_num(6));
    assert_eq!((state.since, state.crossings), (u32::MAX, 0), "no crossing for that long");
    let mut state = State { since: 0, ..reduced };
    config.detect(&mut state, Signal::from_num(200), Signal::from_num(6));
    assert_eq!((state.crossings, state.reductions), (u8::MAX, MAX_REDUCTIONS));
}

/// The gate at rest is the noise, 6 V, on both sides.
#[test]
fn a_mismatch_crosses_beyond_the_gate_and_not_at_it() {
    let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
    let (gate, step) = (Signal::from_num(6), Signal::from_bits(1));
    for (above, mismatch, crossed) in [
        (false, gate, false),
        (false, gate + step, true),
        (true, Signal::ZERO, false),
        (true, -gate, false),
        (true, -gate - step, true),
    ] {
        let mut state = State { above, ..State::default() };
        config.detect(&mut state, mismatch, gate);
        assert_eq!(state.above != above, crossed, "{mismatch} V");
    }
}

/// A model that lacks a lag is wrong by what the target has moved.
#[test]
fn while_the_target_moves_the_gate_is_wider_by_twice_that() {
    let config = Config::new(1e-3, SampleTime::from_rate(1000.0).unwrap());
    for (moved, crossed) in [(0, true), (100, false)] {
        let mut state = State::default();
        config.track_target(&mut state, Signal::from_num(moved));
        config.detect(&mut state, Signal::from_num(200), Signal::from_num(6));
        assert_eq!(state.above, crossed, "{moved} V");
    }
}
