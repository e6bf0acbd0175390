//! Tests of the bank in closed loop with a spring of double precision.
//!
//! Of a spring by other code and other noise, and compared with `vsj isolate`: `tests/tests/firmware_isolation.rs`.

use std::boxed::Box;
use std::vec::Vec;

use link::isolation::Off;
use link::{Command, IsolationReport};
use model::isolation::{Cause, Causes, Report, Verdict};
use model::supervisor::{self, Fault, State};
use model::{Feedback, Plant, Settings, Volts, device};
use random_numbers::Lcg32;

use super::{Isolation, News, Terms};
use crate::control::{Control, Sensors, Tick, Untimed};
use crate::settings::{SETTINGS, built_in};

/// All settings, with a sensor and this trip.
pub(crate) fn settings(trip_on_cause: Causes) -> device::Settings {
    let control = Settings { feedback: Some(Feedback::TYPICAL), ..SETTINGS };
    device::Settings { trip_on_cause, ..built_in(control) }
}

/// Controller, bank and a plain spring, whose readings have a noise of up to 0.3 V.
pub(crate) struct Rig {
    pub(crate) control: Control,
    pub(crate) isolation: Box<Isolation>,
    pub(crate) terms: Terms,
    /// Gain of the spring, as a ratio to that of the model.
    pub(crate) gain: f64,
    slow_v: f64,
    measured: Option<Volts>,
    numbers: Lcg32,
}

impl Rig {
    /// At rest, disarmed.
    pub(crate) fn new(settings: &device::Settings) -> Self {
        let terms = Terms::new(settings, Some(Plant::PAPER), settings.control.amplifier.max_v);
        let mut isolation = Box::new(Isolation::off());
        isolation.start(&terms);
        let control = Control::new(&settings.control, &settings.supervision, None).unwrap();
        Self { control, isolation, terms, gain: 1.0, slow_v: 0.0, measured: None, numbers: Lcg32::new(1) }
    }

    /// One tick with a command and a target, in V.
    pub(crate) fn tick(&mut self, arming: Option<supervisor::Command>, target_v: f64) -> (Tick, Option<News>) {
        let command = Command { heard: true, arming, target: Some(Volts::new(target_v).unwrap()) };
        let faults = self.isolation.begin(&command, self.control.supervisor().state()).into_iter().collect();
        let sensors = Sensors { interlock_closed: true, measured: self.measured, faults, ..Sensors::default() };
        let tick = self.control.tick(&command, &sensors, &mut Untimed);
        let news = self.isolation.tick(&self.control, &tick);
        let Plant { share, time_constant_s, .. } = Plant::PAPER;
        let applied_v = tick.output.applied.to_f64();
        // The reading is sampled after the voltage was applied, which then stays until the next tick.
        let stiffness_v = self.gain * (share * applied_v + (1.0 - share) * self.slow_v);
        self.slow_v = applied_v + (self.slow_v - applied_v) * (-1e-3 / time_constant_s).exp();
        let noise_v = f64::from(self.numbers.draw()) / 2f64.powi(32) * 0.6 - 0.3;
        self.measured = Some(Volts::new(stiffness_v + noise_v).unwrap());
        (tick, news)
    }

    /// Runs from `from` up to `to`, both in ticks, along a stair of 100 V in 5 s, up to 500 V and down again, always armed. `each` is called
    /// with the number of ticks so far.
    pub(crate) fn run(&mut self, from: u64, to: u64, mut each: impl FnMut(&mut Self, u64, &Tick, Option<News>)) {
        for tick in from..to {
            let step = (tick / 5000) % 10;
            let target_v = 100.0 * step.min(10 - step) as f64;
            let disarmed = self.control.supervisor().state() == State::Disarmed;
            let (done, news) = self.tick(disarmed.then_some(supervisor::Command::Arm), target_v);
            each(self, tick + 1, &done, news);
        }
    }
}

/// Ticks until the spring changes, and until the bank has named it for long.
const CHANGES: u64 = 12_000;
const NAMED: u64 = 40_000;

/// A run in which the spring becomes stiffer by a tenth, up to [`NAMED`]: the news with their ticks.
fn stiffer(rig: &mut Rig) -> Vec<(u64, News)> {
    let mut all = Vec::new();
    rig.run(0, CHANGES, |_, tick, _, news| all.extend(news.map(|news| (tick, news))));
    rig.gain = 1.1;
    rig.run(CHANGES, NAMED, |_, tick, _, news| all.extend(news.map(|news| (tick, news))));
    all
}

#[test]
fn the_start_of_a_fault_is_right_across_the_wrap_of_32_bits() {
    let news = |since_ticks| News { report: Report::default(), since_ticks, before: Verdict::Quiet };
    let wrap = 1u64 << 32;
    for (tick, since_ticks, since_tick) in
        [(wrap - 1, 1000, wrap - 1001), (wrap + 7, 1000, wrap - 993), (wrap + 7, wrap, 7), (wrap + 7, 0, wrap + 7)]
    {
        assert_eq!(news(since_ticks).since_tick(tick), since_tick, "{tick} {since_ticks}");
    }
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_change_of_the_gain_is_named_with_its_size_and_its_time_and_each_news_follows_the_one_before() {
    let mut rig = Rig::new(&settings(Causes::NONE));
    let news = stiffer(&mut rig);
    assert!(news.windows(2).all(|pair| pair[1].1.before == pair[0].1.report.verdict), "{news:?}");
    assert!(news.windows(2).all(|pair| pair[1].1 != pair[0].1), "nothing is said twice");
    let (tick, named) = news.last().unwrap();
    assert_eq!(named.report.verdict, Verdict::Named(Cause::GainError));
    let since_tick = named.since_tick(*tick);
    assert!((CHANGES - 300..CHANGES + 300).contains(&since_tick), "{since_tick}");
    let described = rig.terms.describe(&named.report, *tick, since_tick);
    let IsolationReport { size, half_width, explained, .. } = described;
    assert!((size - 0.1).abs() < 0.01 && half_width < 0.01 && explained > 0.95, "{described:?}");
    assert_eq!(
        (described.tick, described.since_tick, described.verdict()),
        (*tick, since_tick, Some(named.report.verdict))
    );
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_spring_as_the_model_is_not_named_also_while_the_output_is_off_and_the_readings_are_those_of_no_voltage() {
    let mut rig = Rig::new(&settings(Causes::NONE));
    let mut quiet = true;
    rig.run(0, 30_000, |_, _, _, news| quiet &= news.is_none_or(|news| news.report.verdict == Verdict::Quiet));
    // The spring is not at rest, but nobody knows its voltage: it is left out.
    for _ in 0..10_000 {
        let (_, news) = rig.tick(Some(supervisor::Command::Disarm), 0.0);
        rig.slow_v = 300.0;
        quiet &= news.is_none_or(|news| news.report.verdict == Verdict::Quiet);
    }
    assert!(quiet);
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn a_cause_of_the_trip_is_a_fault_until_it_is_acknowledged() {
    let trip = Causes::NONE.with(Cause::GainError);
    let mut rig = Rig::new(&settings(trip));
    rig.run(0, CHANGES, |_, _, _, _| ());
    rig.gain = 1.1;
    let mut fault_at = None;
    rig.run(CHANGES, NAMED, |rig, tick, _, _| {
        if rig.control.supervisor().state() == State::Faulted(Fault::Isolation) {
            fault_at.get_or_insert(tick);
        }
    });
    assert!(fault_at.is_some_and(|tick| tick < NAMED), "no fault");
    let command = |arming| Command { heard: true, arming, target: None };
    let (disarm, arm) = (command(Some(supervisor::Command::Disarm)), command(Some(supervisor::Command::Arm)));
    let faulted = State::Faulted(Fault::Isolation);
    // What is no acknowledgement of this fault leaves it.
    for (command, state) in [
        (command(None), faulted),
        (arm, faulted),
        (disarm, State::Disarmed),
        (disarm, State::Faulted(Fault::Interlock)),
        (disarm, faulted),
    ] {
        assert_eq!(
            rig.isolation.begin(&command, state),
            (command != disarm || state != faulted).then_some(Fault::Isolation)
        );
    }
    // Refused, because something else speaks against it: the control's state is still the fault.
    let (refused, _) = rig.tick(None, 0.0);
    assert_eq!(rig.isolation.begin(&disarm, faulted), None);
    assert_eq!((rig.isolation.tick(&rig.control, &refused), rig.control.supervisor().state()), (None, faulted));
    assert_eq!(rig.isolation.begin(&command(None), faulted), Some(Fault::Isolation));
    let (_, news) = rig.tick(Some(supervisor::Command::Disarm), 0.0);
    assert_eq!(rig.control.supervisor().state(), State::Disarmed);
    assert_eq!(news.map(|news| news.report.verdict), Some(Verdict::Quiet), "the bank begins anew");
    assert_eq!(rig.isolation.begin(&arm, State::Disarmed), None);
}

/// The acknowledgement of an alarm arrives between the tick that names a cause and the next one.
#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn the_end_of_an_alarm_is_no_end_of_the_trip() {
    let mut rig = Rig::new(&settings(Causes::NONE.with(Cause::GainError)));
    rig.run(0, CHANGES, |_, _, _, _| ());
    rig.gain = 1.1;
    let (mut named_at, mut fault_at) = (None, None);
    rig.run(CHANGES, NAMED, |rig, tick, _, news| {
        if news.is_some_and(|news| matches!(news.report.verdict, Verdict::Named(_))) {
            named_at.get_or_insert(tick);
            rig.isolation.acknowledge();
        }
        if rig.control.supervisor().state() == State::Faulted(Fault::Isolation) {
            fault_at.get_or_insert(tick);
        }
    });
    assert!(named_at.is_some() && fault_at == named_at.map(|tick| tick + 1), "{named_at:?} {fault_at:?}");
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn another_cause_than_that_of_the_trip_is_no_fault() {
    let mut rig = Rig::new(&settings(Causes::NONE.with(Cause::StuckSensor)));
    let named = stiffer(&mut rig).iter().any(|(_, news)| news.report.verdict == Verdict::Named(Cause::GainError));
    assert!(named && rig.control.supervisor().state() == State::Armed);
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn without_what_the_bank_needs_it_says_nothing_and_why_and_a_trip_is_refused() {
    let trip = Causes::NONE.with(Cause::Drift);
    let blind = built_in(SETTINGS);
    let fast = Plant { time_constant_s: 0.05, ..Plant::PAPER };
    let why = |terms: &Terms| terms.describe(&Report::default(), 7, 0).why_off();
    for (settings, plant, expected) in [
        (settings(Causes::NONE), Some(Plant::PAPER), None),
        (blind, Some(Plant::PAPER), Some(Off::NoSensor)),
        (settings(Causes::NONE), None, Some(Off::ExtendedSpring)),
        (settings(Causes::NONE), Some(fast), Some(Off::OutOfRange)),
    ] {
        let terms = Terms::new(&settings, plant, 700.0);
        assert_eq!(why(&terms), expected);
        assert_eq!(terms.check(), Ok(()), "nothing demands a trip");
        let tripping = Terms::new(&device::Settings { trip_on_cause: trip, ..settings }, plant, 700.0);
        assert_eq!(tripping.check().map_err(|error| error.field), expected.map_or(Ok(()), |_| Err("trip_on_cause")));
        assert_eq!(tripping.describe(&Report::default(), 7, 0).trips().collect::<Vec<_>>(), [Cause::Drift]);
    }
    let mut rig = Rig::new(&blind);
    rig.gain = 1.5;
    rig.run(0, 20_000, |_, _, _, news| assert_eq!(news, None));
}
