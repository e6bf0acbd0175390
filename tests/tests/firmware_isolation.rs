//! The firmware's isolation bank and its control tick, in closed loop with a spring that changes while it runs.
//!
//! `cargo xtask story --isolation` compares the emulated image with the same code.

use firmware::adaptation::{self, Alone, Change};
use firmware::control::{Control, Sensors, Untimed};
use firmware::isolation::{Isolation, Terms};
use firmware::settings::{SETTINGS, SUPERVISION, built_in};
use link::Command;
use link::isolation::Off;
use model::adaptation::Parameters;
use model::isolation::{self, Cause, Causes, Report, Verdict};
use model::supervisor::{self, Fault, State};
use model::{Feedback, Plant, Settings, Volts, device};
use simulation::isolation::trace::{self, Event};
use simulation::record::{Record, Row};
use test_bench::script::{UP_DOWN_TICKS, up_down_v};
use validation::ground_truth::{self, Effect, Live, Noise};

/// Ticks per second.
const RATE_HZ: f64 = 1000.0;

/// What changes.
#[derive(Clone, Copy, PartialEq)]
enum Happens {
    Nothing,
    /// The spring becomes stiffer by a tenth.
    Gain,
    /// The sensor repeats its last reading.
    Stuck,
}

/// What the bank said in a tick in which it said something new.
struct Said {
    tick: u32,
    report: Report,
}

impl Happens {
    /// Tick in which it happens: a sensor that is stuck at 400 V, below the model and then above it, does not look like a saturated one.
    const fn tick(self) -> u32 {
        if matches!(self, Self::Stuck) { 44_000 } else { 20_000 }
    }
}

/// A run up and down the stair: what the bank said, the record of it, and the states of the output.
struct Run {
    said: Vec<Said>,
    record: Record,
    states: Vec<(u32, State)>,
    terms: Terms,
    /// What the adaptation has changed, with its tick.
    adapted: Vec<(u32, Change)>,
}

fn settings(trip_on_cause: Causes) -> device::Settings {
    let control = Settings { feedback: Some(Feedback::TYPICAL), ..SETTINGS };
    device::Settings { trip_on_cause, ..built_in(control) }
}

fn run(change: Happens, trip_on_cause: Causes) -> Run {
    run_with(change, trip_on_cause, false)
}

/// Runs controller and bank in closed loop with a spring that changes, as [`run`] does, with the adaptation if `adapts`.
fn run_with(change: Happens, trip_on_cause: Causes, adapts: bool) -> Run {
    let settings = settings(trip_on_cause);
    settings.check().unwrap();
    let terms = Terms::new(&settings, Some(Plant::PAPER), settings.control.amplifier.max_v);
    let mut isolation = Box::new(Isolation::off());
    isolation.start(&terms);
    let mut control = Control::new(&settings.control, &SUPERVISION, None).unwrap();
    let amplifier = settings.control.amplifier;
    let mut adaptation = adapts.then(|| Alone::new(adaptation::Terms::new(&settings, amplifier, &terms)));
    let mut spring = Live::new(&[], Noise::white(0.2), 1, 500.0, UP_DOWN_TICKS as usize);
    let (mut measured, mut last) = (None, Verdict::Quiet);
    let mut run = Run {
        said: Vec::new(),
        record: Record { name: "run".into(), rows: Vec::new() },
        states: Vec::new(),
        terms,
        adapted: Vec::new(),
    };
    for tick in 0..UP_DOWN_TICKS {
        if tick == change.tick() && change == Happens::Gain {
            let stiffer = Effect {
                cause: ground_truth::Cause::GainError,
                form: 0,
                full_size: vec![1.1],
                neutral: vec![1.0],
                size: 1.0,
            };
            spring.change(&[stiffer], 500.0);
        }
        // A fault is acknowledged 5 s later, then the output is armed again.
        let state = control.supervisor().state();
        let since = run.states.last().map_or(0, |(since, _)| tick - since);
        let arming = match state {
            State::Disarmed => Some(supervisor::Command::Arm),
            State::Faulted(_) if since > 5000 => Some(supervisor::Command::Disarm),
            _ => None,
        };
        let target = Some(Volts::new(f64::from(up_down_v(tick))).unwrap());
        let command = Command { heard: true, arming, target };
        let faults = isolation.begin(&command, state).into_iter().collect();
        let sensors = Sensors { interlock_closed: true, measured, faults, ..Sensors::default() };
        let done = control.tick(&command, &sensors, &mut Untimed);
        if let Some(news) = isolation.tick(&control, &done)
            && news.report.verdict != last
        {
            last = news.report.verdict;
            run.said.push(Said { tick: tick + 1, report: news.report });
        }
        if let Some(adaptation) = &mut adaptation {
            let change = adaptation.after_tick(&mut control, &mut isolation, &done);
            run.adapted.extend(change.map(|change| (tick, change)));
        }
        let now = control.supervisor().state();
        if run.states.last().is_none_or(|(_, state)| *state != now) {
            run.states.push((tick, now));
        }
        let applied_v = done.output.applied.to_f64();
        let (_, reading) = spring.hold(applied_v, 1.0 / RATE_HZ);
        if tick < change.tick() || change != Happens::Stuck {
            measured = Some(Volts::new(reading.read).unwrap());
        }
        let read = measured.map(Volts::to_f64);
        let row =
            Row { line: tick as usize + 2, time_s: f64::from(tick) / RATE_HZ, voltage_v: applied_v, measured: read };
        run.record.rows.push(row);
    }
    run
}

#[test]
fn nothing_is_named_of_a_spring_that_does_not_change() {
    let run = run(Happens::Nothing, Causes::NONE);
    assert!(run.said.is_empty(), "{:?}", run.said.iter().map(|said| said.report.verdict).collect::<Vec<_>>());
}

/// The bank on the MCU says in the tick after what `vsj isolate` says of the record, bit for bit.
#[test]
fn what_is_said_of_a_change_is_what_vsj_isolate_says_of_the_record() {
    for (change, cause) in [(Happens::Gain, Cause::GainError), (Happens::Stuck, Cause::StuckSensor)] {
        let run = run(change, Causes::NONE);
        let trace = trace::run(&run.record, isolation::Settings::PAPER).unwrap().trace;
        let bank = settings(Causes::NONE).isolation(Plant::PAPER, 700.0).unwrap();
        // In the tick before: a reading is sampled after the tick whose voltage it belongs to.
        let time_s = |tick: u32| f64::from(tick - 1) / RATE_HZ;
        let said: Vec<Event> =
            run.said.iter().map(|said| Event::new(&said.report, time_s(said.tick), &bank, RATE_HZ)).collect();
        assert_eq!(said, trace[1..], "the first is that of the first row");
        let named = run.said.iter().find(|said| said.report.verdict == Verdict::Named(cause)).expect("a name");
        assert!(said.iter().all(|event| event.verdict != "named" || event.cause == Some(cause.name())), "{said:?}");
        let since_tick = named.tick - 128 * named.report.since_blocks;
        assert!((change.tick() - 200..change.tick() + 600).contains(&since_tick), "{cause:?} since {since_tick}");
        let described = run.terms.describe(&named.report, u64::from(named.tick), u64::from(since_tick));
        if change == Happens::Gain {
            assert!((described.size - 0.1).abs() < 0.01 && described.half_width < 0.01, "{described:?}");
            assert!(described.explained > 0.95, "{described:?}");
        }
        assert_eq!(run.states.len(), 1, "armed throughout: {:?}", run.states);
    }
}

#[test]
fn a_cause_of_trip_on_cause_is_a_fault_until_it_is_acknowledged_and_another_cause_is_not() {
    let tripped = run(Happens::Gain, Causes::NONE.with(Cause::GainError));
    let states: Vec<State> = tripped.states.iter().map(|(_, state)| *state).collect();
    let faulted = State::Faulted(Fault::Isolation);
    assert_eq!(states[..4], [State::Armed, faulted, State::Disarmed, State::Armed], "{states:?}");
    let named = tripped.said.iter().find(|said| matches!(said.report.verdict, Verdict::Named(_))).unwrap();
    // In the tick after the one that has named it.
    assert_eq!(tripped.states[1].0, named.tick);
    let quiet = tripped.said.iter().find(|said| said.tick > named.tick).unwrap();
    assert_eq!((quiet.report.verdict, quiet.tick), (Verdict::Quiet, tripped.states[2].0 + 1), "the bank begins anew");
    let other = run(Happens::Gain, Causes::NONE.with(Cause::StuckSensor));
    assert_eq!(other.states.len(), 1, "{:?}", other.states);
}

#[test]
fn without_what_the_bank_needs_it_is_off_and_a_trip_is_refused() {
    let why = |terms: Terms| terms.describe(&Report::default(), 7, 0).why_off();
    let (quiet, trip) = (Causes::NONE, Causes::NONE.with(Cause::Drift));
    let with = |settings: device::Settings, plant| Terms::new(&settings, plant, 700.0);
    assert_eq!(why(with(settings(quiet), Some(Plant::PAPER))), None);
    assert_eq!(why(with(built_in(SETTINGS), Some(Plant::PAPER))), Some(Off::NoSensor));
    assert_eq!(why(with(settings(quiet), None)), Some(Off::ExtendedSpring));
    let fast = Plant { time_constant_s: 0.05, ..Plant::PAPER };
    assert_eq!(why(with(settings(quiet), Some(fast))), Some(Off::OutOfRange));
    for plant in [None, Some(fast)] {
        assert_eq!(with(settings(quiet), plant).check(), Ok(()));
        assert_eq!(with(settings(trip), plant).check().unwrap_err().field, "trip_on_cause");
    }
    assert_eq!(with(settings(trip), Some(Plant::PAPER)).check(), Ok(()));
}

#[test]
fn the_model_follows_a_gain_that_is_named_and_no_bad_sensor() {
    let gain = run_with(Happens::Gain, Causes::NONE, true);
    let (_, last) = gain.adapted.last().expect("it adapts");
    let Parameters { time_constant, share, gain: ratio } = last.parameters;
    assert!((ratio - 1.1).abs() < 0.002 && (time_constant, share) == (1.0, 1.0), "{last:?}");
    assert_eq!(gain.states.len(), 1, "armed throughout: {:?}", gain.states);
    // The bank is quiet on the adapted model, and the parameters moved slowly.
    assert_eq!(gain.said.last().unwrap().report.verdict, Verdict::Quiet);
    let moves = gain.adapted.windows(2).map(|pair| pair[1].1.parameters.gain - pair[0].1.parameters.gain);
    assert!(moves.map(f64::abs).all(|step| step <= 0.05 * 0.128 + 1e-12));
    let ratios = |run: &Run| run.adapted.iter().all(|(_, change)| change.parameters == Parameters::STORED);
    for happens in [Happens::Nothing, Happens::Stuck] {
        assert!(ratios(&run_with(happens, Causes::NONE, true)));
    }
}

/// A cause that is a fault disables the output before it can be taken over.
#[test]
fn a_trip_comes_before_the_adaptation() {
    let tripped = run_with(Happens::Gain, Causes::NONE.with(Cause::GainError), true);
    assert_eq!(tripped.states[1].1, State::Faulted(Fault::Isolation), "{:?}", tripped.states);
    let before = tripped.adapted.iter().take_while(|(tick, _)| *tick <= tripped.states[1].0);
    assert!(before.map(|(_, change)| change.parameters).all(|parameters| parameters == Parameters::STORED));
}
