//! What is answered, and what reaches the tick.

use super::*;
use crate::frame::Frame;
use crate::receiver::Receiver;
use crate::reply::State;
use crate::sequence::Sequence;
use crate::value::Desired;
use model::stiffness::{Cantilever, YoungsModulus};
use model::supervisor::{Command, Fault as Cause};

const ARMED: View = view(supervisor::State::Armed, State::Armed);
const DISARMED: View = view(supervisor::State::Disarmed, State::Disarmed);
const FAULTED: View = view(supervisor::State::Faulted(Cause::Monitor), State::Faulted);
/// Is stored, and does not run.
const REFUSED: ModelId = ModelId { number: 3, format: 1, length: 9, checksum: 7 };
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

/// What is answered if the tick turns `before` into `after`, and whether it was asked to do anything.
fn talk(request: Request, before: &View, after: &View) -> (Option<Order>, Reply) {
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap();
    let mut desk = Desk::new(spring, About { silence_limit_ticks: 500, stored: REFUSED, ..About::default() });
    let hello = Frame::new(Sequence(0), &Request::Hello);
    let frame = Frame::new(Sequence(1), &request);
    let (mut order, mut answer) = (None, None);
    for &byte in hello.as_bytes().iter().chain(frame.as_bytes()) {
        match desk.on_byte(byte, before) {
            Some(Step::Order(ordered)) => {
                order = Some(ordered);
                answer = Some(reply(desk.settle(after)));
            }
            Some(Step::Send(bytes) | Step::Restart(bytes)) => answer = Some(reply(bytes)),
            Some(Step::Keep(_)) => answer = Some(reply(desk.kept(Ok(None), after))),
            None => {}
        }
    }
    assert!(desk.take_heard() && !desk.take_heard());
    (order, answer.unwrap())
}

#[test]
fn an_answer_says_what_has_happened() {
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
        (Request::Acknowledge(monitor), FAULTED, DISARMED, ack(State::Disarmed)),
        (Request::Acknowledge(monitor), FAULTED, FAULTED, Reply::Refused(Reason::OtherFault(monitor))),
    ] {
        let (order, answer) = talk(request, &before, &after);
        assert!(order.is_some());
        assert_eq!(answer, expected, "{request:?} {:?} {:?}", before.state, after.state);
    }
}

#[test]
fn what_orders_nothing_is_answered_at_once() {
    for (request, view) in [
        (Request::Heartbeat, ARMED),
        (Request::Stream { every_ticks: 5 }, DISARMED),
        (Request::Arm, ARMED),
        (Request::Disarm, FAULTED),
        (SET, DISARMED),
        (Request::Arm, FAULTED),
    ] {
        assert_eq!(talk(request, &view, &view).0, None, "{request:?}");
    }
    let (order, Reply::Status(status)) = talk(Request::Status, &FAULTED, &FAULTED) else { panic!() };
    assert_eq!((status.lowest.to_f64(), status.highest.to_f64()), (0.0, 700.0));
    assert_eq!((order, status.overruns, status.fault, status.counters.accepted), (None, 3, Fault(6), 2));
}

#[test]
fn a_model_is_taken_while_disarmed_only() {
    let monitor = Fault::from(Cause::Monitor);
    for request in [
        Request::ModelPart { number: 0, bytes: [1; PART] },
        Request::ModelEnd { length: 9, checksum: 7 },
        Request::Restart,
    ] {
        let answer = |view| talk(request, &view, &view).1;
        assert_eq!(answer(DISARMED), Reply::Ack { state: State::Disarmed, target: WireVolts(7) }, "{request:?}");
        assert_eq!(answer(ARMED), Reply::Refused(Reason::Armed), "{request:?}");
        assert_eq!(answer(FAULTED), Reply::Refused(Reason::Faulted(monitor)), "{request:?}");
    }
    let models = Models { active: ModelId::default(), stored: REFUSED };
    assert_eq!(talk(Request::Model, &ARMED, &ARMED).1, Reply::Model(models));
}

#[test]
fn orders_reach_the_tick() {
    let command = |request, view| talk(request, &view, &view).0.and_then(|order| order.command);
    assert_eq!(command(Request::Arm, DISARMED), Some(Command::Arm));
    assert_eq!(command(Request::Disarm, ARMED), Some(Command::Disarm));
    assert_eq!(talk(SET, &ARMED, &ARMED).0.unwrap().target.map(|volts| volts.to_f64()), Some(300.0));
}
