//! Every pair of a state and an event, compared with tables written by hand.
//!
//! A state is what a supervisor can be in before a tick: disarmed, armed, ramping or faulted, with every set of standing
//! faults and every one of them shown, with or without missed ticks that are not forgotten, and with monitors that agree
//! or have disagreed. An event is what comes in that tick: every combination of a command, the interlock, the host, missed
//! ticks, the monitors, and no reported fault, each of them, or two.

use super::*;
use std::vec::Vec;

/// What the supervisor was in before the tick: the columns of the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Was {
    Disarmed,
    Armed,
    /// Armed, with a silent host.
    Ramping,
    /// Armed, with a silent host; the next tick of silence ends the ramp.
    RampEnds,
    Faulted,
}

/// What happens on a command.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Then {
    Stay,
    /// Arms, unless a row of [`AGAINST_ARMING`] applies.
    Arm,
    Disarm,
    /// Removes the shown fault, unless its cause is there.
    Acknowledge,
    Refuse,
}
use Then::{Acknowledge, Refuse, Stay};

/// Whether an input is a fault: the columns are disarmed, armed, ramping, the end of the ramp, faulted. Of several in one
/// tick the first row is shown.
const IS_A_FAULT: [(Input, [bool; 5]); 4] = [
    (Input::Reported, [true, true, true, true, true]),
    (Input::InterlockOpen, [false, true, true, true, false]),
    (Input::DisagreesTooLong, [true, true, true, true, true]),
    (Input::MissedTooMany, [false, true, true, true, false]),
];

/// What follows a command, in the same columns.
const ON_COMMAND: [(Option<Command>, [Then; 5]); 3] = [
    (None, [Stay, Stay, Stay, Stay, Stay]),
    (Some(Command::Arm), [Then::Arm, Stay, Stay, Stay, Refuse]),
    (Some(Command::Disarm), [Stay, Then::Disarm, Then::Disarm, Then::Disarm, Acknowledge]),
];

/// What speaks against arming; the first row that applies is the reason.
const AGAINST_ARMING: [(Input, Refusal); 4] = [
    (Input::InterlockOpen, Refusal::InterlockOpen),
    (Input::HostSilent, Refusal::HostSilent),
    (Input::SupplyWrong, Refusal::Reference),
    (Input::VoltageWrong, Refusal::Live),
];

/// What speaks against acknowledging a fault (`None`: any fault); the first row that applies is the reason.
const AGAINST_ACKNOWLEDGING: [(Option<Fault>, Input, Refusal); 5] = [
    (None, Input::SupplyWrong, Refusal::Reference),
    (None, Input::VoltageWrong, Refusal::Live),
    (Some(Fault::Interlock), Input::InterlockOpen, Refusal::InterlockOpen),
    (Some(Fault::Overrun), Input::MissedLately, Refusal::CausePresent),
    (None, Input::Reported, Refusal::CausePresent),
];

/// What a tick shows the supervisor, by itself or with what was before.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Input {
    /// A fault is reported; against acknowledging, the shown fault.
    Reported,
    InterlockOpen,
    HostSilent,
    /// The supply of the converters is out of its range in this tick.
    SupplyWrong,
    /// The amplifier's monitors disagree in this tick.
    VoltageWrong,
    /// One of both, for longer than allowed.
    DisagreesTooLong,
    /// A tick was missed within the time in which one is forgotten.
    MissedLately,
    /// More than five ticks were missed.
    MissedTooMany,
}

/// Missed ticks before the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Missed {
    Never,
    /// One, and this tick is the one that forgets it.
    ForgottenNow,
    Lately,
    /// Five together, as many as are tolerated.
    Five,
}

/// Ticks for which the monitors have disagreed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Disagreed {
    No,
    Once,
    /// The monitors have disagreed for as long as is allowed.
    AsAllowed,
}

/// What the monitors read in the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reading {
    None,
    Agrees,
    Voltage,
    Supply,
}

#[derive(Clone, Debug)]
struct Before {
    was: Was,
    shown: Option<Fault>,
    standing: Faults,
    missed: Missed,
    disagreed: Disagreed,
}

#[derive(Clone, Copy, Debug)]
struct Event {
    command: Option<Command>,
    interlock_closed: bool,
    silent: bool,
    missed_ticks: u32,
    monitors: Reading,
    faults: Faults,
}

/// A tick is forgotten, and a voltage discharged, after three ticks; monitors may disagree for two; the host may be silent
/// for ten, and the ramp falls by 0.7 V in each.
fn small() -> Config {
    let settings = Settings {
        host_timeout_s: 0.01,
        ramp_v_per_s: 700.0,
        missed_ticks_allowed: 5,
        forget_missed_s: 0.003,
        monitor_time_s: 0.002,
        discharge_time_s: 0.003,
        ..Settings::DEFAULT
    };
    settings.validate(SampleTime::from_rate(RATE_HZ).unwrap()).unwrap().quantize()
}

/// Ticks that make up the history before the tick.
const HISTORY: u32 = 4;

impl Before {
    /// Every state; a fault is shown with every set of standing faults that contains it.
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        let mut add = |was, shown, standing| {
            for missed in [Missed::Never, Missed::ForgottenNow, Missed::Lately, Missed::Five] {
                for disagreed in [Disagreed::No, Disagreed::Once, Disagreed::AsAllowed] {
                    all.push(Self { was, shown, standing, missed, disagreed });
                }
            }
        };
        for was in [Was::Disarmed, Was::Armed, Was::Ramping, Was::RampEnds] {
            add(was, None, Faults::NONE);
        }
        for bits in 1..1 << Fault::ALL.len() {
            let standing = Faults::from_bits(bits);
            for shown in standing.iter() {
                add(Was::Faulted, Some(shown), standing);
            }
        }
        all
    }

    fn driven(&self) -> bool {
        matches!(self.was, Was::Armed | Was::Ramping | Was::RampEnds)
    }

    /// A supervisor that events have brought into this state.
    fn reach(&self) -> Supervisor {
        let mut supervisor = Supervisor::new(small(), None);
        let target = if self.was == Was::RampEnds { volts(0.7 * f64::from(HISTORY) + 0.35) } else { volts(300.0) };
        if self.driven() {
            assert!(matches!(tick(&mut supervisor, Inputs { target, ..arm() }).0, Decision::Start(_)));
        }
        for fault in self.shown.into_iter().chain(self.standing.iter()) {
            supervisor.fail(fault);
        }
        let silent = matches!(self.was, Was::Ramping | Was::RampEnds);
        let allowed = if self.driven() { 2 } else { 3 };
        let disagreeing = match self.disagreed {
            Disagreed::No => 0,
            Disagreed::Once => 1,
            Disagreed::AsAllowed => allowed,
        };
        for left in (0..HISTORY).rev() {
            let missed_ticks = match (self.missed, left) {
                (Missed::ForgottenNow, 2) | (Missed::Lately, 0) => 1,
                (Missed::Five, 0) => 5,
                _ => 0,
            };
            let monitors = (left < disagreeing).then_some(FAR_OFF);
            let ticks_since_host = if silent { 11 } else { 0 };
            tick(&mut supervisor, Inputs { target, ticks_since_host, missed_ticks, monitors, ..good() });
        }
        let state = match self.was {
            Was::Disarmed => State::Disarmed,
            Was::Faulted => State::Faulted(self.shown.unwrap()),
            _ => State::Armed,
        };
        assert_eq!((supervisor.state(), supervisor.standing()), (state, self.standing), "{self:?}");
        assert_eq!(supervisor.ramping(), silent, "{self:?}");
        supervisor
    }
}

/// Readings that disagree with every output of this test.
const FAR_OFF: Monitors = Monitors { voltage: Volts(Signal::MAX), current_ua: 0, supply_mv: None };

impl Event {
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        // Of the two, one is shown by many of the states while the other, whose number is lower, is not acknowledged either.
        let two = Faults::NONE.with(Fault::Watchdog).with(Fault::SelfTest);
        let faults = || [Faults::NONE, two].into_iter().chain(Fault::ALL.map(|fault| Faults::NONE.with(fault)));
        for command in [None, Some(Command::Arm), Some(Command::Disarm)] {
            for (interlock_closed, silent) in [(false, false), (false, true), (true, false), (true, true)] {
                for missed_ticks in [0, 1, 6] {
                    for monitors in [Reading::None, Reading::Agrees, Reading::Voltage, Reading::Supply] {
                        let event = |faults| Self { command, interlock_closed, silent, missed_ticks, monitors, faults };
                        all.extend(faults().map(event));
                    }
                }
            }
        }
        all
    }

    fn inputs(&self, driven: bool) -> Inputs {
        let voltage = volts(if driven { 300.0 } else { 0.0 });
        let reading = |supply_mv| Some(Monitors { voltage, current_ua: 0, supply_mv: Some(supply_mv) });
        Inputs {
            command: self.command,
            target: volts(300.0),
            ticks_since_host: if self.silent { 11 } else { 0 },
            interlock_closed: self.interlock_closed,
            missed_ticks: self.missed_ticks,
            monitors: match self.monitors {
                Reading::None => None,
                Reading::Agrees => reading(3300),
                Reading::Voltage => Some(FAR_OFF),
                Reading::Supply => reading(3600),
            },
            faults: self.faults,
        }
    }

    /// Whether `input` is there in this tick.
    fn has(&self, input: Input, before: &Before) -> bool {
        let disagrees = matches!(self.monitors, Reading::Voltage | Reading::Supply);
        match input {
            Input::Reported => self.faults != Faults::NONE,
            Input::InterlockOpen => !self.interlock_closed,
            Input::HostSilent => self.silent,
            Input::SupplyWrong => self.monitors == Reading::Supply,
            Input::VoltageWrong => self.monitors == Reading::Voltage,
            Input::DisagreesTooLong => disagrees && before.disagreed == Disagreed::AsAllowed,
            Input::MissedLately => self.missed_ticks > 0 || matches!(before.missed, Missed::Lately | Missed::Five),
            Input::MissedTooMany => self.missed_ticks == 6 || self.missed_ticks == 1 && before.missed == Missed::Five,
        }
    }
}

/// State, standing faults and refusal after the tick, from the tables.
fn expected(before: &Before, event: &Event) -> (State, Faults, Option<Refusal>) {
    let (mut shown, mut standing) = (before.shown, before.standing);
    for (input, faults) in IS_A_FAULT {
        if event.has(input, before) && faults[before.was as usize] {
            let found = match input {
                Input::InterlockOpen => Faults::NONE.with(Fault::Interlock),
                Input::DisagreesTooLong => Faults::NONE.with(Fault::Monitor),
                Input::MissedTooMany => Faults::NONE.with(Fault::Overrun),
                _ => event.faults,
            };
            shown = shown.or(found.iter().next());
            standing = found.iter().fold(standing, Faults::with);
        }
    }
    let now = if shown.is_some() { Was::Faulted } else { before.was };
    // A command was given before the fault of the same tick that has just disabled the output.
    let command = event.command.filter(|_| !(before.driven() && now == Was::Faulted));
    let (_, row) = ON_COMMAND.into_iter().find(|(on, _)| *on == command).unwrap();
    let same = |refusal| (shown.map_or(State::Disarmed, State::Faulted), standing, refusal);
    match row[now as usize] {
        Stay if now == Was::Armed || now == Was::Ramping => (State::Armed, standing, None),
        Stay if now == Was::RampEnds && !event.silent => (State::Armed, standing, None),
        Stay | Then::Disarm => same(None),
        Refuse => same(Some(Refusal::Faulted)),
        Then::Arm => match AGAINST_ARMING.into_iter().find(|(input, _)| event.has(*input, before)) {
            Some((_, refusal)) => same(Some(refusal)),
            None => (State::Armed, standing, None),
        },
        Acknowledge => {
            let shown = shown.unwrap();
            let against = AGAINST_ACKNOWLEDGING.into_iter().find(|(fault, input, _)| {
                let reported = *input != Input::Reported || event.faults.contains(shown);
                fault.is_none_or(|fault| fault == shown) && event.has(*input, before) && reported
            });
            if let Some((_, _, refusal)) = against {
                return same(Some(refusal));
            }
            let standing = standing.without(shown);
            (standing.iter().next().map_or(State::Disarmed, State::Faulted), standing, None)
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn every_state_and_event_leads_where_the_tables_say_and_only_armed_has_a_voltage() {
    let events = Event::all();
    let (mut pairs, mut driven) = (0, 0);
    for before in Before::all() {
        let reached = before.reach();
        for event in &events {
            let mut supervisor = reached.clone();
            let (decision, drive) = tick(&mut supervisor, event.inputs(before.driven()));
            let is = (supervisor.state(), supervisor.standing(), supervisor.refusal());
            assert_eq!(is, expected(&before, event), "{before:?} {event:?}");
            let armed = is.0 == State::Armed;
            let voltage = drive == Drive { code: DacCode(1755), enabled: true };
            assert!(if armed { voltage } else { drive == Drive::SAFE }, "{before:?} {event:?}: {drive:?}");
            let as_decided = match decision {
                Decision::Rest => !armed,
                Decision::Start(_) => armed && before.was == Was::Disarmed,
                Decision::Pursue(_) => armed && before.driven(),
            };
            assert!(as_decided, "{before:?} {event:?}: {decision:?}");
            pairs += 1;
            driven += u32::from(armed);
        }
    }
    std::println!("count: {pairs} pairs of state and event\ncount: {driven} pairs with a voltage");
    assert_eq!(pairs, 12 * (4 + 10 * 512) * 1728, "a pair is missing");
    assert!(driven > 500, "{driven} pairs with a voltage show little");
}
