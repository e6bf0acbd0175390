//! Tests of the replies, and of the commands for the control tick.

use super::*;
use crate::adaptation::AdaptationReport;
use crate::capture::Captured;
use crate::diagnosis::{Mismatch, Sensor};
use crate::frame::{Frame, Unreadable};
use crate::isolation::IsolationReport;
use crate::nonce::Nonce;
use crate::notice::Notice;
use crate::receiver::Receiver;
use crate::reply::FaultReport;
use crate::sequence::Sequence;
use crate::telemetry::State;
use crate::value::Desired;
use model::stiffness::{Cantilever, YoungsModulus};
use model::supervisor::Fault as Cause;

const ARMED: View = view(supervisor::State::Armed, State::Armed);
const DISARMED: View = view(supervisor::State::Disarmed, State::Disarmed);
const FAULTED: View = view(supervisor::State::Faulted(Cause::Monitor), State::Faulted);
/// A second fault that stands once the first one is acknowledged.
const SECOND: View = view(supervisor::State::Faulted(Cause::Watchdog), State::Faulted);
/// A stored model that failed its validation.
const REJECTED: BlockId = BlockId { number: 3, format: 1, length: 9, checksum: 7 };
const BROWN_OUT: Option<BrownOut> = Some(BrownOut { level: 0, expected: 4 });
const SET: Request = Request::Set(Desired::ScaledVolts(300.0));

const fn view(state: supervisor::State, shown: State) -> View {
    let (volts, measured) = (WireVolts(7), None);
    let (target, applied, estimate) = (volts, volts, volts);
    let (mismatch, sensor) = (Mismatch(0), Sensor(0));
    let sample =
        Telemetry { tick: 5, state: shown, target, applied, estimate, measured, code: 9, limits: 0, mismatch, sensor };
    let standing = match state {
        supervisor::State::Faulted(fault) => Faults::NONE.with(fault),
        _ => Faults::NONE,
    };
    View { sample, state, standing, refusal: None, overruns: 3 }
}

fn reply(bytes: &[u8]) -> Reply {
    stamped(bytes).1
}

fn stamped(bytes: &[u8]) -> (Nonce, Reply) {
    let mut receiver = Receiver::new();
    let read = |byte: &u8| receiver.on_byte(*byte).map(|packet| (packet.session(), packet.read().unwrap()));
    bytes.iter().find_map(read).unwrap()
}

/// Session and sequence number of a frame, and whether it is a reply.
fn packet_of(bytes: &[u8]) -> (Nonce, Sequence, Result<Reply, Unreadable>) {
    let mut receiver = Receiver::new();
    let read = |byte: &u8| receiver.on_byte(*byte).map(|packet| (packet.session(), packet.sequence, packet.read()));
    bytes.iter().find_map(read).unwrap()
}

fn notice_of(bytes: &[u8]) -> Result<Notice, Unreadable> {
    let mut receiver = Receiver::new();
    bytes.iter().find_map(|byte| receiver.on_byte(*byte).map(|packet| packet.read())).unwrap()
}

fn server() -> Server {
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap();
    let about = About {
        silence_limit_ticks: 500,
        rate_hz: 1000,
        model: Blocks { stored: REJECTED, ..Blocks::default() },
        brown_out: BROWN_OUT,
        seed: 7,
        ..About::default()
    };
    Server::new(spring, about)
}

/// The nonce that a Hello is offered.
fn greet(server: &mut Server, view: &View) -> Nonce {
    let hello = Frame::new(Sequence(0), &Request::Hello);
    let answer = hello.as_bytes().iter().find_map(|&byte| match server.on_byte(byte, view) {
        Some(Step::Send(bytes)) => Some(stamped(bytes)),
        _ => None,
    });
    answer.unwrap().0
}

/// The command for the tick, and the reply if the tick changes the state from `before` to `after`.
fn exchange(request: Request, before: &View, after: &View) -> (Option<Command>, Reply) {
    let mut server = server();
    let nonce = greet(&mut server, before);
    let frame = Frame::new(nonce.stamp(Sequence(1)), &request);
    let (mut command, mut answer) = (None, None);
    for &byte in frame.as_bytes() {
        match server.on_byte(byte, before) {
            Some(Step::Command(given)) => {
                assert!(given.heard);
                command = Some(given);
                answer = Some(reply(server.command_done(after)));
            }
            Some(Step::Send(bytes) | Step::Restart(bytes)) => answer = Some(reply(bytes)),
            Some(Step::Capture(_)) => answer = Some(reply(server.answered(&Reply::Captured(Captured::default())))),
            Some(Step::Adaptation(_)) => answer = Some(reply(server.answered(&Reply::Adaptation(Default::default())))),
            Some(Step::Isolation(_)) => answer = Some(reply(server.answered(&Reply::Isolation(Default::default())))),
            Some(Step::Update(block, _)) => answer = Some(reply(server.updated(block, Ok(None), after))),
            Some(Step::ReadSettings { built_in, number }) => {
                let payload: &[u8] = if built_in { b"built in" } else { &[b'r'; 40] };
                answer = Some(reply(server.settings_part(Part::of(number, payload))));
            }
            None => {}
        }
    }
    assert!(server.take_heard() == command.is_none() && !server.take_heard());
    (command, answer.unwrap())
}

#[test]
fn the_reply_reports_the_state_after_the_tick() {
    let ack = |state| Reply::Ack { state, target: WireVolts(7) };
    let monitor = Fault::from(Cause::Monitor);
    for (request, before, after, expected) in [
        (SET, ARMED, ARMED, ack(State::Armed)),
        (SET, ARMED, DISARMED, Reply::Refused(Reason::NotArmed)),
        (SET, ARMED, FAULTED, Reply::Refused(Reason::Faulted(monitor))),
        (Request::Arm, DISARMED, ARMED, ack(State::Armed)),
        (Request::Arm, DISARMED, FAULTED, Reply::Refused(Reason::Faulted(monitor))),
        (
            Request::Arm,
            DISARMED,
            View { refusal: Some(Refusal::InterlockOpen), ..DISARMED },
            Reply::Refused(Reason::InterlockOpen),
        ),
        (Request::Arm, DISARMED, View { refusal: Some(Refusal::Live), ..DISARMED }, Reply::Refused(Reason::Live)),
        (
            Request::Arm,
            DISARMED,
            View { refusal: Some(Refusal::Reference), ..DISARMED },
            Reply::Refused(Reason::Reference),
        ),
        (
            Request::Acknowledge(monitor),
            FAULTED,
            View { refusal: Some(Refusal::Live), ..FAULTED },
            Reply::Refused(Reason::Live),
        ),
        (Request::Disarm, ARMED, DISARMED, ack(State::Disarmed)),
        (Request::Disarm, ARMED, FAULTED, ack(State::Faulted)),
        (
            Request::Acknowledge(monitor),
            FAULTED,
            View { refusal: Some(Refusal::CausePresent), ..FAULTED },
            Reply::Refused(Reason::CausePresent(monitor)),
        ),
        (Request::Acknowledge(monitor), FAULTED, DISARMED, ack(State::Disarmed)),
        (Request::Acknowledge(monitor), FAULTED, SECOND, ack(State::Faulted)),
        (Request::Acknowledge(monitor), FAULTED, FAULTED, Reply::Refused(Reason::OtherFault(monitor))),
    ] {
        let (command, answer) = exchange(request, &before, &after);
        assert!(command.is_some());
        assert_eq!(answer, expected, "{request:?} {:?} {:?}", before.state, after.state);
    }
}

#[test]
fn requests_without_a_command_are_answered_without_a_tick() {
    for (request, view) in [
        (Request::Heartbeat, ARMED),
        (Request::Stream { every_ticks: 5 }, DISARMED),
        (Request::Arm, ARMED),
        (Request::Disarm, FAULTED),
        (SET, DISARMED),
        (Request::Arm, FAULTED),
    ] {
        assert_eq!(exchange(request, &view, &view).0, None, "{request:?}");
    }
    let (command, Reply::Status(status)) = exchange(Request::Status, &FAULTED, &FAULTED) else { panic!() };
    assert_eq!((status.lowest.to_f64(), status.highest.to_f64()), (0.0, 700.0));
    assert_eq!((command, status.overruns, status.fault, status.counters.accepted), (None, 3, Fault(6), 2));
}

#[test]
fn models_and_settings_are_accepted_while_disarmed_and_while_a_config_fault_stands() {
    let monitor = Fault::from(Cause::Monitor);
    for request in [
        Request::ModelPart { number: 0, bytes: [1; PART] },
        Request::ModelEnd { length: 9, checksum: 7 },
        Request::SettingsPart { number: 0, bytes: [1; PART] },
        Request::SettingsEnd { length: 9, checksum: 7 },
        Request::Restart,
    ] {
        let answer = |view| exchange(request, &view, &view).1;
        assert_eq!(answer(DISARMED), Reply::Ack { state: State::Disarmed, target: WireVolts(7) }, "{request:?}");
        assert_eq!(answer(ARMED), Reply::Refused(Reason::Armed), "{request:?}");
        assert_eq!(answer(FAULTED), Reply::Refused(Reason::Faulted(monitor)), "{request:?}");
        let done = Reply::Ack { state: State::Faulted, target: WireVolts(7) };
        assert_eq!(answer(View { standing: FAULTED.standing.with(Cause::Config), ..FAULTED }), done, "{request:?}");
    }
    let answer = |request| exchange(request, &ARMED, &ARMED).1;
    let models = Blocks { active: BlockId::default(), stored: REJECTED };
    assert_eq!([answer(Request::Model), answer(Request::BrownOut)], [Reply::Model(models), Reply::BrownOut(BROWN_OUT)]);
}

#[test]
fn the_running_and_the_built_in_settings_can_be_read_in_any_state() {
    let padded = |text: &[u8]| -> [u8; PART] { core::array::from_fn(|at| text.get(at).copied().unwrap_or(0)) };
    for view in [ARMED, DISARMED, FAULTED] {
        let read = |built_in, number| exchange(Request::ReadSettings { built_in, number }, &view, &view).1;
        let part = |number, length, bytes| Reply::SettingsPart(Part { number, length, bytes });
        assert_eq!(read(false, 0), part(0, 40, [b'r'; PART]));
        assert_eq!(read(false, 1), part(1, 40, padded(b"rrrrrrrr")));
        assert_eq!(read(false, 2), part(2, 40, [0; PART]), "behind the end");
        assert_eq!(read(false, 255), part(255, 40, [0; PART]), "behind the end");
        assert_eq!(read(true, 0), part(0, 8, padded(b"built in")));
    }
}

#[test]
fn capture_isolation_bank_and_adaptation_are_read_in_any_state() {
    for view in [ARMED, DISARMED, FAULTED] {
        for capture in [Capture::Start { rows: 9 }, Capture::State, Capture::Read { first: 3 }] {
            let (command, reply) = exchange(Request::Capture(capture), &view, &view);
            assert_eq!((command, reply), (None, Reply::Captured(Captured::default())));
        }
        for isolation in [Isolation::Read, Isolation::Acknowledge] {
            let (command, reply) = exchange(Request::Isolation(isolation), &view, &view);
            assert_eq!((command, reply), (None, Reply::Isolation(IsolationReport::default())));
        }
        for adaptation in [Adaptation::Read, Adaptation::Off, Adaptation::On] {
            let (command, reply) = exchange(Request::Adaptation(adaptation), &view, &view);
            assert_eq!((command, reply), (None, Reply::Adaptation(AdaptationReport::default())));
        }
    }
}

#[test]
fn what_was_stored_is_reported_for_its_own_block() {
    let mut server = server();
    let stored = BlockId { number: 4, ..REJECTED };
    server.updated(Block::Settings, Ok(Some(stored)), &DISARMED);
    assert_eq!(server.about.settings, Blocks { stored, ..Blocks::default() });
    assert_eq!(server.about.model.stored, REJECTED);
    server.updated(Block::Settings, Err(Reason::NotStored), &DISARMED);
    server.updated(Block::Model, Ok(None), &DISARMED);
    assert_eq!((server.about.settings.stored, server.about.model.stored), (stored, REJECTED));
}

#[test]
fn commands_contain_the_transition_and_the_target() {
    let arming = |request, view| exchange(request, &view, &view).0.and_then(|command| command.arming);
    assert_eq!(arming(Request::Arm, DISARMED), Some(supervisor::Command::Arm));
    assert_eq!(arming(Request::Disarm, ARMED), Some(supervisor::Command::Disarm));
    assert_eq!(exchange(SET, &ARMED, &ARMED).0.unwrap().target.map(|volts| volts.to_f64()), Some(300.0));
}

fn at(tick: u64, view: View) -> View {
    View { sample: Telemetry { tick, ..view.sample }, ..view }
}

fn send(server: &mut Server, view: &View, nonce: Nonce, number: u16, request: Request) -> Reply {
    let frame = Frame::new(nonce.stamp(Sequence(number)), &request);
    let answer = frame.as_bytes().iter().find_map(|&byte| match server.on_byte(byte, view) {
        Some(Step::Send(bytes)) => Some(reply(bytes)),
        Some(Step::Command(_)) => Some(Reply::Refused(Reason::NotArmed)),
        _ => None,
    });
    answer.unwrap()
}

#[test]
fn a_report_of_a_fault_is_repeated_until_the_host_has_heard_of_it() {
    let mut server = server();
    assert_eq!(server.fault(&FAULTED), None, "nobody is there");
    let nonce = greet(&mut server, &DISARMED);
    send(&mut server, &DISARMED, nonce, 1, Request::Stream { every_ticks: 1 });
    let Some(Reply::Fault(before)) = server.fault(&at(6, DISARMED)).map(reply) else { panic!() };
    assert_eq!((before.number, before.tick, before.standing), (1, 5, 0), "it came and went before the session");
    let first =
        FaultReport { number: 2, tick: 7, fault: Cause::Monitor.into(), standing: 1 << 5, mismatch: Mismatch(0) };
    let sent = |server: &mut Server, tick| server.fault(&at(tick, FAULTED)).map(reply);
    for tick in 7..1000 {
        let expected = (tick % 100 == 7).then_some(Reply::Fault(first));
        assert_eq!(sent(&mut server, tick), expected, "{tick}");
    }
    let heard = |server: &mut Server, number, sequence| {
        assert!(matches!(
            send(server, &FAULTED, nonce, sequence, Request::Heard { number }),
            Reply::Ack { state: State::Faulted, .. }
        ));
    };
    heard(&mut server, 1, 2);
    assert_eq!(sent(&mut server, 1007), Some(Reply::Fault(first)), "it heard of another one");
    heard(&mut server, 2, 3);
    for tick in 1008..3000 {
        assert_eq!(sent(&mut server, tick), None, "{tick}");
    }
    // A second fault is reported immediately, with both that stand.
    let both = View { standing: Faults::NONE.with(Cause::Monitor).with(Cause::Watchdog), ..FAULTED };
    let Some(Reply::Fault(second)) = server.fault(&at(3000, both)).map(reply) else { panic!() };
    assert_eq!((second.number, second.fault, second.standing), (3, Cause::Watchdog.into(), 0x30));
    assert!(second.faults().eq([Fault::from(Cause::Watchdog), Cause::Monitor.into()]));
}

/// Every fault comes while nobody hears: each is reported, at any rate of the ticks.
#[test]
fn a_later_fault_does_not_replace_a_report_that_nobody_has_heard() {
    for rate_hz in [1, 1000] {
        let mut server = server();
        server.about.rate_hz = rate_hz;
        let nonce = greet(&mut server, &DISARMED);
        send(&mut server, &DISARMED, nonce, 1, Request::Status);
        let mut standing = Faults::NONE;
        let mut view = FAULTED;
        for (tick, fault) in (10..).zip(Cause::ALL) {
            standing = standing.with(fault);
            view = View { standing, ..at(tick, FAULTED) };
            let first = server.fault(&view).map(reply);
            assert!(matches!(first, Some(Reply::Fault(report)) if report.standing == standing.bits()), "{first:?}");
        }
        // Once each in a later tick, and no more: the loop of the task that sends them ends. One more than there are faults is taken, so
        // that reports without an end fail the test.
        let mut repeated = std::vec::Vec::new();
        let later = at(view.sample.tick + 100, view);
        for _ in 0..=Cause::ALL.len() {
            let Some(bytes) = server.fault(&later) else { break };
            let Reply::Fault(report) = reply(bytes) else { panic!() };
            repeated.push((report.number, report.tick, report.fault.0));
        }
        let expected = Cause::ALL.map(|fault| (u32::from(fault.code()), 9 + u64::from(fault.code()), fault.code()));
        assert_eq!(repeated, expected, "{rate_hz} Hz");
    }
}

/// The acknowledged fault comes again before the next poll of the link: it is a new one.
#[test]
fn the_same_fault_is_reported_again_after_its_acknowledgement() {
    let mut server = server();
    let nonce = greet(&mut server, &FAULTED);
    let monitor = Cause::Monitor.into();
    send(&mut server, &FAULTED, nonce, 1, Request::Status);
    let Some(Reply::Fault(first)) = server.fault(&FAULTED).map(reply) else { panic!() };
    send(&mut server, &FAULTED, nonce, 2, Request::Heard { number: first.number });
    send(&mut server, &FAULTED, nonce, 3, Request::Acknowledge(monitor));
    server.command_done(&at(8, DISARMED));
    let Some(Reply::Fault(again)) = server.fault(&at(9, FAULTED)).map(reply) else { panic!() };
    assert_eq!((again.number, again.tick), (first.number + 1, 9));
}

#[test]
fn telemetry_that_is_not_sent_is_counted() {
    let mut server = server();
    let nonce = greet(&mut server, &DISARMED);
    send(&mut server, &DISARMED, nonce, 1, Request::Stream { every_ticks: 10 });
    for (tick, due, dropped) in [(14, false, 0), (15, true, 0), (56, true, 3), (64, false, 3), (65, true, 3)] {
        assert_eq!(server.telemetry(&at(tick, DISARMED)).is_some(), due, "{tick}");
        assert_eq!(server.counters().telemetry_dropped, dropped, "{tick}");
    }
    server.telemetry_lost();
    let Reply::Status(status) = send(&mut server, &at(70, DISARMED), nonce, 2, Request::Status) else { panic!() };
    assert_eq!(status.counters.telemetry_dropped, 4);
    // While the host is silent nothing is due, so that nothing is dropped.
    assert!(server.telemetry(&at(5000, DISARMED)).is_none());
    send(&mut server, &at(5003, DISARMED), nonce, 3, Request::Heartbeat);
    assert!(server.telemetry(&at(5013, DISARMED)).is_some());
    assert_eq!(server.counters().telemetry_dropped, 4);
}

/// A host from before it drops the frame by its kind; its sequence number is that of the sample before.
#[test]
fn the_verdict_comes_with_the_telemetry_when_it_changes_and_once_per_second() {
    let mut server = server();
    let nonce = greet(&mut server, &DISARMED);
    assert!(!server.verdict_due(0x300, &at(9, DISARMED)), "no telemetry");
    send(&mut server, &at(10, DISARMED), nonce, 1, Request::Stream { every_ticks: 10 });
    let mut sent = std::vec::Vec::new();
    let mut number = 2;
    for tick in 11..4000 {
        let verdict = if tick < 1500 { 0 } else { 0x300 };
        let view = at(tick, DISARMED);
        if tick % 300 == 0 && tick < 2800 {
            send(&mut server, &view, nonce, number, Request::Heartbeat);
            number += 1;
        }
        let sample = server.telemetry(&view).map(|bytes| packet_of(bytes).1);
        if !server.verdict_due(verdict, &view) {
            continue;
        }
        let notice = Notice::Isolation(IsolationReport { tick, verdict, ..IsolationReport::default() });
        let bytes = server.verdict(verdict, &notice, &view);
        let (session, sequence, read) = packet_of(bytes);
        assert_eq!((session, read), (nonce, Err(Unreadable::Kind)), "no reply");
        assert_eq!(notice_of(bytes), Ok(notice));
        assert!(sample.is_none_or(|sample| sample == sequence));
        sent.push(tick);
        if tick == 1500 {
            server.verdict_lost();
        }
    }
    // 1500 was lost; the host has been silent since 2700 + 500.
    assert_eq!(sent, [11, 1011, 1500, 1501, 2501]);
    send(&mut server, &at(4000, DISARMED), nonce, number, Request::Stream { every_ticks: 0 });
    assert!(!server.verdict_due(0x100, &at(4001, DISARMED)), "no telemetry any more");
    send(&mut server, &at(4002, DISARMED), nonce, number + 1, Request::Stream { every_ticks: 5 });
    assert!(server.verdict_due(0x300, &at(4002, DISARMED)), "with the first sample of a new request");
    server.verdict(0x300, &Notice::Isolation(IsolationReport::default()), &at(4002, DISARMED));
    assert!(!server.verdict_due(0x300, &at(4003, DISARMED)));
    send(&mut server, &at(4004, DISARMED), nonce, number + 2, Request::Stream { every_ticks: 10 });
    assert!(server.verdict_due(0x300, &at(4004, DISARMED)), "and of another, within the same second");
}

/// The monitors agree again once the output is off; the report still says what they found.
#[test]
fn a_report_of_a_fault_names_what_disagreed() {
    let mut server = server();
    let nonce = greet(&mut server, &DISARMED);
    send(&mut server, &DISARMED, nonce, 1, Request::Status);
    let mut found = at(6, FAULTED);
    found.sample.mismatch = Mismatch(4);
    let Some(Reply::Fault(first)) = server.fault(&found).map(reply) else { panic!() };
    let Some(Reply::Fault(later)) = server.fault(&at(106, FAULTED)).map(reply) else { panic!() };
    assert_eq!((first.tick, first.mismatch, later), (6, Mismatch(4), first));
}
