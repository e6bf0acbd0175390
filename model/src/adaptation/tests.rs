use super::*;
use crate::amplifier::Limits;
use crate::controller::{self, Compensation, Input};
use crate::feedback::{self, Sensor};
use crate::isolation::{Report, Verdict};
use crate::units::{ScaledStiffness, Signal, Volts};
use crate::{Amplifier, Approach, Feedback, Gains, Margin, Reading, State as ControlState};
use proptest::prelude::*;

const BLOCK_S: f64 = 0.128;
const RANGE_V: f64 = 1000.0;
/// Longest time at one level, in ticks.
const LEVEL_TICKS: usize = if cfg!(miri) { 50 } else { 3000 };
/// Largest number of different observations in a row.
const OBSERVATIONS: usize = if cfg!(miri) { 5 } else { 60 };

fn control(compensation: Compensation) -> controller::Settings {
    let feedback = Some(Feedback::TYPICAL);
    controller::Settings { compensation, amplifier: Amplifier::up_to(RANGE_V), feedback, ..controller::Settings::PAPER }
}

fn compensations() -> [Compensation; 3] {
    [
        Compensation::ProportionalIntegral(Gains::PAPER),
        Compensation::TimeOptimal(Approach::DEAD_BEAT),
        Compensation::Robust(Margin::TYPICAL),
    ]
}

fn bank() -> isolation::Settings {
    isolation::Settings { range_v: RANGE_V, ..isolation::Settings::PAPER }
}

fn variant(compensation: Compensation, parameters: &Parameters) -> Variant {
    Variant::new(&control(compensation), &bank(), parameters).unwrap()
}

/// What is known after a fault of this verdict began 100 blocks ago.
fn seen(verdict: Verdict, size: f64) -> Observation {
    let volts = |volts| Volts::new(volts).unwrap();
    Observation {
        report: Report::of(verdict, 100, size, 50),
        moved: volts(300.0),
        moved_since_exchange: volts(300.0),
        trusted_blocks: 1000,
        exchanged: false,
    }
}

fn update(state: &mut State, seen: &Observation) -> Option<Parameters> {
    state.update(&Settings::TYPICAL, seen, Plant::PAPER, RANGE_V, BLOCK_S)
}

/// Exchanges every proposal, with what the bank says of each model, until none comes for 20 blocks.
fn follow(state: &mut State, mut says: impl FnMut(&State) -> Observation) {
    let (mut proposed, mut idle) = (None, 0);
    for _ in 0..10_000 {
        let exchanged = proposed.is_some();
        proposed = update(state, &Observation { exchanged, ..says(state) });
        idle = if proposed.is_none() { idle + 1 } else { 0 };
        if idle > 1000 {
            return;
        }
    }
    panic!("it does not come to rest");
}

const TAU: Verdict = Verdict::Named(Cause::TimeConstant);

#[test]
fn a_setting_out_of_range_is_rejected_by_name() {
    let time = SampleTime::from_rate(1000.0).unwrap();
    let good = Settings::TYPICAL;
    assert_eq!(good.validate(time).map(drop), Ok(()));
    for (settings, field) in [
        (Settings { time_constant: 0.6, ..good }, "adaptation.time_constant"),
        (Settings { share: -0.1, ..good }, "adaptation.share"),
        (Settings { gain: f64::NAN, ..good }, "adaptation.gain"),
        (Settings { rate_per_s: 0.0, ..good }, "adaptation.rate_per_s"),
        (Settings { precision: 1.0, ..good }, "adaptation.precision"),
        (Settings { excitation: 0.0, ..good }, "adaptation.excitation"),
    ] {
        assert_eq!(settings.validate(time).unwrap_err().field, field);
    }
}

#[test]
fn bounds_within_which_no_controller_can_run_are_rejected() {
    let paper = control(Compensation::ProportionalIntegral(Gains::PAPER));
    assert_eq!(Settings::TYPICAL.check_for(&paper, &bank()), Ok(()));
    // The bank's shortest time constant is 0.256 s.
    let short = Plant { time_constant_s: 0.3, ..Plant::PAPER };
    let of = controller::Settings { plant: short, ..control(Compensation::None) };
    assert_eq!(Settings::TYPICAL.check_for(&of, &bank()).unwrap_err().field, "plant.time_constant_s");
    // A share of 0.6 that may become 0.75, and 0.94 by the controller's own margin.
    let large = Plant { share: 0.6, ..Plant::PAPER };
    let margin = Margin { share: 0.25, ..Margin::TYPICAL };
    let of = controller::Settings { plant: large, ..control(Compensation::Robust(margin)) };
    let bank = isolation::Settings { plant: large, ..bank() };
    let narrow = Settings { share: 0.05, ..Settings::TYPICAL };
    assert_eq!(narrow.check_for(&of, &bank), Ok(()));
    assert!(Settings::TYPICAL.check_for(&of, &bank).is_err());
    assert_eq!(Settings::TYPICAL.check_for(&controller::Settings { plant: large, ..paper }, &bank), Ok(()));
}

#[test]
fn bounds_are_as_far_away_as_the_settings_say() {
    let settings = Settings { time_constant: 0.25, share: 0.125, gain: 0.5, ..Settings::TYPICAL };
    let low = Parameters { time_constant: 0.75, share: 0.875, gain: 0.5 };
    let high = Parameters { time_constant: 1.25, share: 1.125, gain: 1.5 };
    assert_eq!(settings.bounds(), (low, high));
}

/// Follows a named time constant until the quiet bank confirms it. Returns the blocks in `phase` and the state at the end.
fn taken_over(phase: Phase) -> (u32, State) {
    let (mut state, mut blocks) = (State::default(), 0);
    follow(&mut state, |state| {
        blocks += u32::from(state.phase() == phase);
        seen(if state.parameters() == Parameters::STORED { TAU } else { Verdict::Quiet }, 0.125)
    });
    (blocks, state)
}

/// A round of 20 blocks to the first decision of the bank, three that have to agree, and one more.
#[test]
fn a_quiet_trial_is_confirmed_after_100_blocks() {
    let (trial, state) = taken_over(Phase::Trial);
    // With the one in which the bank begins anew.
    assert_eq!((trial, state.phase()), (101, Phase::Watching));
}

#[test]
fn a_model_that_has_moved_settles_for_three_time_constants() {
    let seconds = f64::from(taken_over(Phase::Settling).0) * BLOCK_S;
    assert!((seconds - 3.0 * Plant::PAPER.time_constant_s).abs() < 2.0 * BLOCK_S, "{seconds} s");
}

/// The bank begins anew if it could name an adaptable one of two causes and readings were missing, or it has tried for long.
#[test]
fn a_hopeless_decision_begins_anew() {
    let of = |since, trusted_blocks, one| {
        let report = Report::of(Verdict::Ambiguous(one, Cause::SecondRelaxation), since, 0.125, 50);
        let seen = Observation { report, trusted_blocks, ..seen(Verdict::Quiet, 0.0) };
        update(&mut State::default(), &seen)
    };
    for (since, trusted_blocks, anew) in [(399, 1000, false), (400, 1000, true), (399, 398, true), (399, 399, false)] {
        let expected = anew.then_some(Parameters::STORED);
        assert_eq!(of(since, trusted_blocks, Cause::TimeConstant), expected, "{since} {trusted_blocks}");
        assert_eq!(of(since, trusted_blocks, Cause::Hysteresis), None, "{since} {trusted_blocks}");
    }
}

/// The size of a share's error is relative to the share that runs: 0.005 of 1.1 times the share is less than half of 0.0095 of it.
#[test]
fn a_second_takeover_has_to_be_half_as_large_in_relation_to_what_runs() {
    let settings = Settings { precision: 0.05, ..Settings::TYPICAL };
    for (second, shrinks) in [(0.005, true), (0.0054, false)] {
        let mut state = State::default();
        let update = |state: &mut State, size, exchanged| {
            let seen = Observation { exchanged, ..seen(Verdict::Named(Cause::InstantaneousShare), size) };
            state.update(&settings, &seen, Plant::PAPER, RANGE_V, BLOCK_S).is_some()
        };
        let mut exchanged = false;
        for _ in 0..1000 {
            if state.phase() != Phase::Trial {
                exchanged = update(&mut state, 0.0095, exchanged);
            }
        }
        assert!((state.parameters().share - 1.1045).abs() < 1e-4, "{:?}", state.parameters());
        update(&mut state, second, exchanged);
        update(&mut state, second, false);
        assert_eq!(state.phase(), if shrinks { Phase::Moving } else { Phase::Returning }, "{second}");
    }
}

/// A named time constant of 160 variances in a block, taken over until its trial begins; and whether its last proposal was exchanged.
fn on_trial() -> (State, bool) {
    let seen = Observation { report: Report::of(TAU, 100, 0.125, 160), ..seen(TAU, 0.125) };
    let (mut state, mut exchanged) = (State::default(), false);
    for _ in 0..10_000 {
        exchanged = update(&mut state, &Observation { exchanged, ..seen }).is_some();
        if state.phase() == Phase::Trial {
            return (state, exchanged);
        }
    }
    panic!("no trial");
}

/// A takeover that has removed the cause leaves little of the residual, whatever remains to be explained.
#[test]
fn an_unknown_cause_undoes_a_takeover_that_has_left_more_than_a_sixteenth_of_the_energy() {
    for (since, energy, kept) in [(100, 10, true), (100, 11, false), (300, 10, true), (300, 11, false)] {
        let (mut state, exchanged) = on_trial();
        let report = Report::of(Verdict::Unknown, since, 0.125, energy);
        update(&mut state, &Observation { report, exchanged, ..seen(Verdict::Unknown, 0.125) });
        let expected = if kept { Phase::Frozen } else { Phase::Returning };
        assert_eq!(state.phase(), expected, "{energy} of 160 after {since} blocks");
    }
}

/// An alarm without a name, in which the trial ends after four times its usual length.
#[test]
fn a_trial_that_never_becomes_quiet_is_confirmed_if_it_has_left_a_sixteenth_of_the_energy() {
    for (energy, confirmed) in [(10, true), (11, false)] {
        let (mut state, mut exchanged) = on_trial();
        let report = Report::of(Verdict::Alarm, 100, 0.0, energy);
        // With the one in which the bank begins anew.
        for block in 0..401 {
            assert_eq!(state.phase(), Phase::Trial, "after {block} blocks");
            let seen = Observation { report, exchanged, ..seen(Verdict::Alarm, 0.0) };
            exchanged = update(&mut state, &seen).is_some();
        }
        assert_eq!(state.phase(), if confirmed { Phase::Watching } else { Phase::Returning }, "{energy} of 160");
    }
}

/// The deviation is 2^-10, the share 1 / 11 of the gain.
#[test]
fn the_precision_of_a_share_is_relative_to_the_share() {
    for (precision, enough) in [(0.0205, false), (0.0215, true)] {
        let settings = Settings { precision, ..Settings::TYPICAL };
        let seen = seen(Verdict::Named(Cause::InstantaneousShare), 0.005);
        let plant = Plant { share: 1.0 / 11.0, ..Plant::PAPER };
        let moves = State::default().update(&settings, &seen, plant, RANGE_V, BLOCK_S).is_some();
        assert_eq!(moves, enough, "{precision}");
    }
}

/// Until the bank has begun anew it says what it said before.
#[test]
fn nothing_is_taken_over_before_the_bank_has_begun_anew() {
    let mut state = State::default();
    let named = seen(TAU, 0.125);
    assert_eq!(update(&mut state, &Observation { trusted_blocks: 99, ..named }), Some(Parameters::STORED));
    assert_eq!((update(&mut state, &named), state.phase()), (Some(Parameters::STORED), Phase::Watching));
    update(&mut state, &Observation { exchanged: true, ..named });
    assert_eq!(state.phase(), Phase::Moving);
}

#[test]
fn without_a_trusted_sensor_it_is_frozen() {
    let mut state = State::default();
    for (trusted_blocks, phase) in [(0, Phase::Frozen), (1, Phase::Watching)] {
        update(&mut state, &Observation { trusted_blocks, ..seen(Verdict::Quiet, 0.0) });
        assert_eq!(state.phase(), phase);
    }
}

/// A size that nothing determines has a deviation of 0.
#[test]
fn a_cause_without_a_size_changes_nothing() {
    let mut state = State::default();
    let report = Report::of(TAU, 100, 0.125, 50).without_size();
    assert_eq!(report.size(), (0.0, 0.0));
    assert_eq!(update(&mut state, &Observation { report, ..seen(TAU, 0.0) }), None);
    assert_eq!(state.phase(), Phase::Watching);
}

/// Each smaller than half of the one before, and never quiet.
#[test]
fn after_four_takeovers_without_a_confirmation_all_are_undone() {
    let (mut state, mut exchanged, mut size) = (State::default(), false, 0.125);
    let mut takeovers = 0;
    for _ in 0..10_000 {
        if state.phase() == Phase::Returning {
            break;
        }
        let before = state.phase();
        exchanged = update(&mut state, &Observation { exchanged, ..seen(TAU, size) }).is_some();
        if state.phase() == Phase::Moving && before != Phase::Moving {
            takeovers += 1;
            size *= 0.45;
        }
    }
    assert_eq!((takeovers, state.phase()), (4, Phase::Returning));
}

#[test]
fn the_output_of_the_loop_is_that_of_the_spring_times_the_gain() {
    let volts = |volts: f64| Volts::new(volts).unwrap();
    let config = control(Compensation::None).validate().unwrap().quantize();
    let of_loop = config.tick(&mut ControlState::default(), Input { target: volts(100.0), measured: None });
    let output = Scale::new(2.0).output(of_loop);
    let twice = |volts: Signal| volts + volts;
    assert_eq!((output.target, output.applied), (volts(200.0), of_loop.applied));
    assert!(of_loop.stiffness.0 > Signal::ZERO && output.stiffness.0 == twice(of_loop.stiffness.0));
}

/// The controller's own spring and the bank's may differ: each is multiplied.
#[test]
fn controller_and_bank_run_the_spring_with_these_parameters() {
    let parameters = Parameters { time_constant: 1.25, share: 0.75, gain: 1.1 };
    let of_bank = Plant { share: 0.125, time_constant_s: 4.0 };
    let (control, bank) = (control(Compensation::None), isolation::Settings { plant: of_bank, ..bank() });
    let built = Variant::new(&control, &bank, &parameters).unwrap();
    let time = crate::SampleTime::from_rate(control.rate_hz).unwrap();
    let plant = Plant { share: 0.75 / 11.0, time_constant_s: 1.25 * 5.5 };
    assert_eq!(built.control, controller::Settings { plant, ..control }.validate().unwrap().quantize());
    let plant = Plant { share: 0.75 * 0.125, time_constant_s: 5.0 };
    assert_eq!(built.bank, isolation::Settings { plant, ..bank }.validate(time).unwrap().quantize());
    assert_eq!(built.scale, Scale::new(1.1));
}

#[test]
fn phases_have_the_names_of_the_log() {
    let names = ["watching", "moving", "settling", "trial", "frozen", "returning", "stopped", "off"];
    assert_eq!(Phase::ALL.map(Phase::name), names);
}

#[test]
fn a_named_cause_moves_its_parameter_slowly_and_is_confirmed_when_the_bank_is_quiet() {
    let (moves, state) = taken_over(Phase::Moving);
    let wanted = libm::exp(0.125);
    assert!((state.parameters().time_constant - wanted).abs() < 1e-12);
    assert_eq!((state.parameters().share, state.parameters().gain), (1.0, 1.0));
    assert!(f64::from(moves) >= (wanted - 1.0) / (0.05 * BLOCK_S), "{moves}");
    assert_eq!((state.phase(), state.confirmed), (Phase::Watching, state.parameters()));
}

#[test]
fn the_size_of_each_cause_is_that_of_its_signature() {
    for (cause, size, expected) in [
        (Cause::GainError, 0.1, Parameters { gain: 1.1, ..Parameters::STORED }),
        (Cause::InstantaneousShare, 0.01, Parameters { share: 1.11, ..Parameters::STORED }),
        (Cause::TimeConstant, 0.1, Parameters { time_constant: libm::exp(0.1), ..Parameters::STORED }),
    ] {
        let next = Parameters::STORED.after(cause, size, Plant::PAPER);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(next.gain, expected.gain) && near(next.share, expected.share), "{cause:?}: {next:?}");
        assert!(near(next.time_constant, expected.time_constant), "{cause:?}: {next:?}");
    }
}

#[test]
fn no_other_cause_and_no_weak_evidence_changes_anything() {
    let named = seen(TAU, 0.125);
    let still = Volts::new(50.0).unwrap();
    let wide = Settings { precision: 1e-4, ..Settings::TYPICAL };
    let others = Cause::ALL.into_iter().map(Verdict::Named).filter(|verdict| {
        !matches!(verdict, Verdict::Named(Cause::GainError | Cause::TimeConstant | Cause::InstantaneousShare))
    });
    let ambiguous = Verdict::Ambiguous(Cause::TimeConstant, Cause::SecondRelaxation);
    for verdict in others.chain([ambiguous, Verdict::Unknown, Verdict::Alarm, Verdict::Quiet]) {
        assert_eq!(update(&mut State::default(), &seen(verdict, 0.125)), None, "{verdict:?}");
    }
    assert_eq!(update(&mut State::default(), &Observation { moved: still, ..named }), None, "no excitation");
    assert_eq!(
        update(&mut State::default(), &Observation { trusted_blocks: 0, ..named }),
        None,
        "the sensor is not trusted"
    );
    let wide = State::default().update(&wide, &named, Plant::PAPER, RANGE_V, BLOCK_S);
    assert_eq!(wide, None, "the interval is too wide");
    // Not trusted at some time since the fault began: the bank begins anew, with the same parameters.
    let mut state = State::default();
    assert_eq!(update(&mut state, &Observation { trusted_blocks: 99, ..named }), Some(Parameters::STORED));
    assert!(update(&mut State::default(), &named).is_some());
}

/// A takeover that a fault of the sensor caused ends at the stored model, and stays there until it is acknowledged.
#[test]
fn what_is_not_confirmed_is_undone() {
    let named = |cause| {
        move |state: &State| {
            let wrong = matches!(state.phase(), Phase::Trial | Phase::Frozen);
            seen(if wrong { Verdict::Named(cause) } else { TAU }, 0.125)
        }
    };
    for cause in [Cause::ReadingOffset, Cause::Drift, Cause::SensorSaturation, Cause::StuckSensor, Cause::TimeConstant]
    {
        let mut state = State::default();
        let (mut farthest, mut tried) = (0.0, 0);
        let says = named(cause);
        follow(&mut state, |state| {
            farthest = f64::max(farthest, state.parameters().time_constant);
            tried += u32::from(matches!(state.phase(), Phase::Trial | Phase::Frozen));
            says(state)
        });
        assert_eq!((state.parameters(), state.phase()), (Parameters::STORED, Phase::Stopped), "{cause:?}");
        assert!(farthest > 1.1, "{cause:?}");
        assert!(tried <= 2, "{cause:?}: the first verdict ends the trial, not its longest time: {tried} blocks");
        state.switch(true);
        assert_eq!(state.phase(), Phase::Watching);
    }
}

/// From each phase the model goes back to the stored one, and nothing is taken over until it is switched on.
#[test]
fn switched_off_it_goes_back_to_the_stored_model_and_on_again_it_follows() {
    let until = |state: &mut State, phase| {
        let mut exchanged = false;
        for _ in 0..1000 {
            if state.phase() == phase {
                return;
            }
            exchanged = update(state, &Observation { exchanged, ..seen(TAU, 0.125) }).is_some();
        }
        panic!("never {phase:?}");
    };
    for phase in [Phase::Watching, Phase::Moving, Phase::Settling, Phase::Trial] {
        let mut state = State::default();
        until(&mut state, phase);
        state.switch(false);
        follow(&mut state, |_| seen(TAU, 0.125));
        assert_eq!((state.parameters(), state.phase()), (Parameters::STORED, Phase::Off), "{phase:?}");
        state.switch(true);
        assert_eq!(state.phase(), Phase::Watching, "{phase:?}");
        until(&mut state, Phase::Trial);
        assert!(state.parameters().time_constant > 1.1, "{phase:?}");
        // On again before it has gone back.
        state.switch(false);
        assert_eq!(state.phase(), Phase::Returning);
        state.switch(true);
        until(&mut state, Phase::Watching);
        assert_eq!(state.parameters(), Parameters::STORED, "{phase:?}");
    }
}

#[test]
fn a_parameter_that_its_bound_does_not_let_fit_goes_back_to_the_stored_one() {
    let mut state = State::default();
    let mut highest = 0.0;
    // The size halves each time, so that only the bound stops it.
    let mut size = 1.0;
    follow(&mut state, |state| {
        highest = f64::max(highest, state.parameters().time_constant);
        if state.phase() == Phase::Trial {
            size = 0.25;
        }
        seen(TAU, size)
    });
    assert_eq!((highest, state.parameters(), state.phase()), (1.25, Parameters::STORED, Phase::Stopped));
}

/// What is watched over blocks of a quiet bank, each at one voltage and with one output in all its ticks.
#[test]
fn a_block_ends_with_what_voltage_sensor_and_loop_have_done_in_it() {
    let Variant { control, bank, .. } = variant(compensations()[0], &Parameters::STORED);
    let volts = |volts| Volts::new(volts).unwrap();
    let idle = control.tick(&mut ControlState::default(), Input { target: Volts::ZERO, measured: None });
    let good = controller::Output { sensor: Some(Sensor::Trusted), limits: Limits::NONE, ..idle };
    let tolerance = settled_within(RANGE_V);
    assert_eq!(tolerance.to_f64(), 10.0);
    let (mut watch, mut state) = (Watch::NEW, isolation::State::default());
    let mut block = |watch: &mut Watch, voltage: f64, output: controller::Output| {
        for tick in 1..=bank.block_ticks() {
            bank.tick(&mut state, volts(voltage), ScaledStiffness::default(), None);
            assert_eq!(watch.tick(&bank, &state, &output, tolerance), tick == bank.block_ticks());
        }
        state
    };
    assert_eq!(watch.observe(&isolation::State::default(), false).moved_since_exchange, Volts::ZERO);
    for (number, voltage) in [100.0, 300.0, 200.0].into_iter().enumerate() {
        let seen = block(&mut watch, voltage, good);
        let now = watch.observe(&seen, false);
        assert_eq!((now.trusted_blocks, now.exchanged), (number as u32 + 1, false));
        assert_eq!(now.moved, Volts::ZERO, "without a fault it begins anew in each block");
        assert!(watch.settled());
    }
    let seen = block(&mut watch, 150.0, good);
    assert_eq!(watch.observe(&seen, false).moved_since_exchange, volts(200.0));
    let exchanged = watch.observe(&seen, true);
    assert_eq!((exchanged.moved_since_exchange, exchanged.exchanged), (Volts::ZERO, true));
    // At the tolerance, and one step beyond it, on both sides.
    for (off, settled) in [(10 << 20, true), ((10 << 20) + 1, false), (-10 << 20, true), ((-10 << 20) - 1, false)] {
        let stiffness = ScaledStiffness(Signal::from_bits(off));
        block(&mut watch, 150.0, controller::Output { target: Volts::ZERO, stiffness, ..good });
        assert_eq!(watch.settled(), settled, "{off}");
    }
    block(&mut watch, 150.0, controller::Output { limits: Limits::SLEW, ..good });
    assert!(!watch.settled());
    let seen =
        block(&mut watch, 150.0, controller::Output { sensor: Some(Sensor::Failed(feedback::Fault::Stale)), ..good });
    assert_eq!(watch.observe(&seen, false).trusted_blocks, 0);
    let seen = block(&mut watch, 150.0, controller::Output { sensor: None, ..good });
    assert_eq!(watch.observe(&seen, false).trusted_blocks, 0);
    let seen = block(&mut watch, 150.0, good);
    assert_eq!(watch.observe(&seen, false).trusted_blocks, 1);
}

#[test]
fn a_gain_of_1_changes_no_bit() {
    let scale = Scale::default();
    for bits in [0, 1, -1, 12_345_678, i32::MIN, i32::MAX] {
        let stiffness = ScaledStiffness(Signal::from_bits(bits));
        assert_eq!((scale.inward(stiffness), scale.outward(stiffness)), (stiffness, stiffness));
    }
}

prop_compose! {
    fn parameters()(time_constant in 0.75..1.25, share in 0.75..1.25, gain in 0.85..1.15) -> Parameters {
        Parameters { time_constant, share, gain }
    }
}

prop_compose! {
    fn observation()(
        code in prop::sample::select((0..=u16::MAX).filter(|code| Verdict::from_code(*code).is_some()).collect::<std::vec::Vec<_>>()),
        three in any::<bool>(),
        cause in 0u16..3,
        (since_blocks, size, energy) in (0u32..4000, -100.0..100.0, 0u32..1000),
        (moved, moved_since_exchange) in (0.0..1000.0, 0.0..1000.0),
        trusted_blocks in prop_oneof![Just(0u32), 0u32..5000],
        exchanged in any::<bool>(),
    ) -> Observation {
        // One of the three causes in half of the blocks.
        let verdict = Verdict::from_code(if three { 3 << 8 | cause } else { code }).unwrap();
        let volts = |volts| Volts::new(volts).unwrap();
        Observation {
            report: Report::of(verdict, since_blocks, if three { size / 100.0 } else { size }, energy),
            moved: volts(moved),
            moved_since_exchange: volts(moved_since_exchange),
            trusted_blocks,
            exchanged,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if cfg!(miri) { 2 } else { 64 }, ..ProptestConfig::default() })]

    /// Whatever is observed, in any order: the parameters stay within their bounds and move by no more than the rate.
    #[test]
    fn parameters_stay_within_bounds_and_rate(observations in prop::collection::vec((observation(), 1usize..40), 1..OBSERVATIONS)) {
        let (mut state, mut proposed) = (State::default(), None);
        let (low, high) = Settings::TYPICAL.bounds();
        for (seen, times) in observations {
            for _ in 0..times {
                let before = state.parameters();
                // An exchange takes place only of what was proposed.
                proposed = update(&mut state, &Observation { exchanged: seen.exchanged && proposed.is_some(), ..seen });
                let now = state.parameters();
                let next = proposed.unwrap_or(now);
                prop_assert_eq!(next.within((low, high)), next);
                let step = [before.time_constant - now.time_constant, before.share - now.share, before.gain - now.gain];
                prop_assert!(step.iter().all(|step| step.abs() <= 0.05 * BLOCK_S + 1e-12), "{step:?}");
                let learned = state.phase() == Phase::Moving && now != next;
                prop_assert!(!learned || seen.trusted_blocks > 0);
            }
        }
    }

    /// In any state of a running loop: the estimate stays, and so does the code of the next tick for the same target without a
    /// new reading. While the sensor is not trusted the correction fades, which moves the code with or without an exchange.
    #[test]
    fn an_exchange_moves_neither_estimate_nor_code(
        levels in prop::collection::vec((0.0..500.0f64, 1..LEVEL_TICKS, -30.0..30.0f64), 1..6),
        (one, other) in (parameters(), parameters()),
    ) {
        for compensation in compensations() {
            let (before, after) = (variant(compensation, &one), variant(compensation, &other));
            let mut state = ControlState::default();
            let mut last = None;
            let (mut target, mut stiffness) = (Volts::ZERO, ScaledStiffness::default());
            for &(level, ticks, off) in &levels {
                target = Volts::new(level).unwrap();
                for tick in 0..ticks {
                    // A noise of one step, so that the sensor is not stuck.
                    let noise = Signal::from_num(off + 0.5 * f64::from(tick as u32 % 2));
                    let read = ScaledStiffness(stiffness.0.saturating_add(noise));
                    let output = before.control.tick(&mut state, before.scale.input(target, Some(read)));
                    let model = ScaledStiffness(output.stiffness.0 - state.correction().0);
                    stiffness = before.scale.outward(model);
                    last = Some(output);
                }
            }
            let estimate = before.scale.outward(before.control.present(&state)).to_f64();
            after.take_over(&mut state, (&before.control, &before.scale), target);
            let now = after.scale.outward(after.control.present(&state)).to_f64();
            prop_assert!((now - estimate).abs() < 1e-5, "{compensation:?}: {now} {estimate}");
            let code = last.unwrap().code.0;
            let next = after.control.tick(&mut state, after.scale.input(target, None)).code.0;
            let fades = last.unwrap().sensor.is_some_and(|sensor| !sensor.is_trusted());
            prop_assert!(fades || next.abs_diff(code) <= 1, "{compensation:?}: {next} {code}");
        }
    }

    /// Target and reading are divided by the gain, so that the tick runs a model without one.
    #[test]
    fn the_input_of_a_gain_is_divided_by_it(gain in 0.5..1.5f64, target in 0.0..1000.0f64, read in -500.0..1000.0f64) {
        let stiffness = |volts: f64| ScaledStiffness(Signal::from_num(volts));
        let Input { target: inward, measured } = Scale::new(gain).input(Volts::new(target).unwrap(), Some(stiffness(read)));
        prop_assert!((inward.to_f64() - target / gain).abs() < 1e-5);
        let Some(Reading { stiffness: measured, .. }) = measured else { panic!("a reading") };
        prop_assert!((measured.to_f64() - read / gain).abs() < 1e-5);
        prop_assert!((Scale::new(gain).outward(measured).to_f64() - read).abs() < 1e-5);
    }
}
