//! Tests of the replies, and of the commands for the control tick.

use super::*;
use crate::frame::Frame;
use crate::receiver::Receiver;
use crate::reply::State;
use crate::sequence::Sequence;
use crate::value::Desired;
use model::stiffness::{Cantilever, YoungsModulus};
use model::supervisor::Fault as Cause;

const ARMED: View = view(supervisor::State::Armed, State::Armed);
const DISARMED: View = view(supervisor::State::Disarmed, State::Disarmed);
const FAULTED: View = view(supervisor::State::Faulted(Cause::Monitor), State::Faulted);
/// A second fault that stands once the first one is acknowledged.
const SECOND: View = view(supervisor::State::Faulted(Cause::Watchdog), State::Faulted);
/// A stored model that failed its validation.
const REJECTED: ModelId = ModelId { number: 3, format: 1, length: 9, checksum: 7 };
const SET: Request = Request::Set(Desired::ScaledVolts(300.0));

const fn view(state: supervisor::State, shown: State) -> View {
    let (volts, measured) = (WireVolts(7), None);
    let (target, applied, estimate) = (volts, volts, volts);
    let sample = Telemetry { tick: 5, state: shown, target, applied, estimate, measured, code: 9, limits: 0 };
    View { sample, state, refusal: None, overruns: 3 }
}

fn reply(bytes: &[u8]) -> Reply {
    let mut receiver = Receiver::new();
    bytes.iter().find_map(|&byte| receiver.on_byte(byte).map(|packet| packet.read().unwrap())).unwrap()
}

/// The command for the tick, and the reply if the tick changes the state from `before` to `after`.
fn exchange(request: Request, before: &View, after: &View) -> (Option<Command>, Reply) {
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap();
    let mut server = Server::new(spring, About { silence_limit_ticks: 500, stored: REJECTED, ..About::default() });
    let hello = Frame::new(Sequence(0), &Request::Hello);
    let frame = Frame::new(Sequence(1), &request);
    let (mut command, mut answer) = (None, None);
    for &byte in hello.as_bytes().iter().chain(frame.as_bytes()) {
        match server.on_byte(byte, before) {
            Some(Step::Command(given)) => {
                assert!(given.heard);
                command = Some(given);
                answer = Some(reply(server.command_done(after)));
            }
            Some(Step::Send(bytes) | Step::Restart(bytes)) => answer = Some(reply(bytes)),
            Some(Step::UpdateModel(_)) => answer = Some(reply(server.model_updated(Ok(None), after))),
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
fn models_are_accepted_only_while_disarmed() {
    let monitor = Fault::from(Cause::Monitor);
    for request in [
        Request::ModelPart { number: 0, bytes: [1; PART] },
        Request::ModelEnd { length: 9, checksum: 7 },
        Request::Restart,
    ] {
        let answer = |view| exchange(request, &view, &view).1;
        assert_eq!(answer(DISARMED), Reply::Ack { state: State::Disarmed, target: WireVolts(7) }, "{request:?}");
        assert_eq!(answer(ARMED), Reply::Refused(Reason::Armed), "{request:?}");
        assert_eq!(answer(FAULTED), Reply::Refused(Reason::Faulted(monitor)), "{request:?}");
    }
    let models = Models { active: ModelId::default(), stored: REJECTED };
    assert_eq!(exchange(Request::Model, &ARMED, &ARMED).1, Reply::Model(models));
}

#[test]
fn commands_contain_the_transition_and_the_target() {
    let arming = |request, view| exchange(request, &view, &view).0.and_then(|command| command.arming);
    assert_eq!(arming(Request::Arm, DISARMED), Some(supervisor::Command::Arm));
    assert_eq!(arming(Request::Disarm, ARMED), Some(supervisor::Command::Disarm));
    assert_eq!(exchange(SET, &ARMED, &ARMED).0.unwrap().target.map(|volts| volts.to_f64()), Some(300.0));
}
