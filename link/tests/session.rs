//! The session on the MCU: which requests are executed, answered and dropped.

use link::session::Counters;
use link::{Action, Desired, Frame, Message, Nonce, Reason, Receiver, Reply, Request, Sequence, Session, State};
use link::{Telemetry, WireVolts};

const ACK: Reply = Reply::Ack { state: State::Armed, target: WireVolts(5) };
const SET: Request = Request::Set(Desired::ScaledVolts(300.0));

/// A session with the requests that it executed.
struct Mcu {
    session: Session,
    /// Nonce of the host's frames.
    nonce: Nonce,
    now: u64,
    /// Reply to every executed request.
    reply: Reply,
    applied: Vec<Request>,
}

impl Mcu {
    fn new() -> Self {
        Self { session: Session::new(500, 7), nonce: Nonce::NONE, now: 0, reply: ACK, applied: Vec::new() }
    }

    fn after_hello(sequence: u16) -> Self {
        let mut mcu = Self::new();
        mcu.greet(sequence);
        mcu
    }

    /// Asks for a session and begins it with a request for the status of this number.
    fn greet(&mut self, sequence: u16) {
        self.offer(sequence.wrapping_sub(1));
        assert_eq!(self.hear(sequence, &Request::Status), Some((sequence, ACK)));
        self.applied.clear();
    }

    /// Asks for a session; the following frames carry its nonce.
    fn offer(&mut self, sequence: u16) -> Nonce {
        let (nonce, number, answer) = self.exchange(&Frame::new(Sequence(sequence), &Request::Hello)).unwrap();
        assert_eq!((number, answer), (sequence, self.reply));
        self.nonce = nonce;
        nonce
    }

    fn hear<M: Message>(&mut self, sequence: u16, message: &M) -> Option<(u16, Reply)> {
        self.hear_frame(&Frame::new(self.nonce.stamp(Sequence(sequence)), message))
    }

    fn hear_frame(&mut self, frame: &Frame) -> Option<(u16, Reply)> {
        self.exchange(frame).map(|(_, sequence, answer)| (sequence, answer))
    }

    fn exchange(&mut self, frame: &Frame) -> Option<(Nonce, u16, Reply)> {
        let mut sent = Vec::new();
        for &byte in frame.as_bytes() {
            match self.session.on_byte(byte, self.now) {
                Some(Action::Apply(request)) => {
                    self.applied.push(request);
                    sent.extend_from_slice(self.session.answer(&self.reply));
                }
                Some(Action::Send(bytes)) => sent.extend_from_slice(bytes),
                None => {}
            }
        }
        read(&sent)
    }

    fn refusal(&mut self, sequence: u16, request: &Request) -> Option<Reason> {
        self.refusal_in(self.nonce, sequence, request)
    }

    fn refusal_in(&mut self, nonce: Nonce, sequence: u16, request: &Request) -> Option<Reason> {
        match self.hear_frame(&Frame::new(nonce.stamp(Sequence(sequence)), request)) {
            Some((same, Reply::Refused(reason))) if same == sequence => Some(reason),
            _ => None,
        }
    }
}

fn read(bytes: &[u8]) -> Option<(Nonce, u16, Reply)> {
    let mut receiver = Receiver::new();
    bytes.iter().find_map(|&byte| {
        let packet = receiver.on_byte(byte)?;
        Some((packet.session(), packet.sequence.0, packet.read().unwrap()))
    })
}

#[test]
fn a_repeated_request_is_answered_again_and_executed_once() {
    let mut mcu = Mcu::after_hello(10);
    for _ in 0..3 {
        assert_eq!(mcu.hear(11, &SET), Some((11, ACK)));
    }
    assert_eq!(mcu.applied, [SET]);
    assert_eq!(mcu.session.counters(), Counters { accepted: 3, repeated: 2, ..Counters::default() });
}

/// The stored reply survives telemetry, rejections, and a Disarm that is late or has the same number.
#[test]
fn the_reply_to_a_repeated_request_is_preserved() {
    let mut mcu = Mcu::after_hello(10);
    mcu.hear(11, &SET);
    mcu.session.telemetry(Telemetry::default(), 0);
    assert!(mcu.refusal(9, &SET).is_some());
    mcu.reply = Reply::Ack { state: State::Disarmed, target: WireVolts(0) };
    for used in [8, 11] {
        assert_eq!(mcu.hear(used, &Request::Disarm), Some((used, mcu.reply)));
        assert_eq!(mcu.hear(11, &SET), Some((11, ACK)), "after a Disarm with {used}");
    }
    assert_eq!(mcu.applied, [SET, Request::Disarm, Request::Disarm]);
}

#[test]
fn a_late_request_is_rejected() {
    let mut mcu = Mcu::after_hello(10);
    mcu.hear(12, &Request::Arm);
    assert_eq!(mcu.refusal(11, &SET), Some(Reason::Stale { newest: 12 }));
    assert_eq!(mcu.refusal(10, &SET), Some(Reason::Stale { newest: 12 }));
    assert_eq!(mcu.applied, [Request::Arm]);
    assert_eq!(mcu.session.counters().out_of_order, 2);
}

#[test]
fn gaps_in_the_sequence_are_accepted_and_numbers_wrap_around() {
    let mut mcu = Mcu::after_hello(65_500);
    mcu.hear(65_535, &Request::Arm);
    mcu.hear(3, &SET);
    assert_eq!(mcu.applied, [Request::Arm, SET]);
    assert_eq!(mcu.refusal(65_535, &Request::Arm), Some(Reason::Stale { newest: 3 }));
    mcu.hear(32_770, &SET);
    mcu.hear(65_499, &SET);
    assert_eq!(mcu.applied.len(), 4, "the last number of the session");
    assert_eq!(mcu.refusal(65_500, &SET), Some(Reason::Stale { newest: 65_499 }), "the session is used up");
}

#[test]
fn a_different_request_with_the_same_number_is_rejected() {
    let mut mcu = Mcu::after_hello(10);
    mcu.hear(11, &SET);
    assert_eq!(mcu.refusal(11, &Request::Arm), Some(Reason::SequenceReused));
    assert_eq!(mcu.refusal(11, &Request::Set(Desired::ScaledVolts(300.1))), Some(Reason::SequenceReused));
    assert_eq!(mcu.applied, [SET]);
}

#[test]
fn only_disarm_is_executed_before_a_hello() {
    let mut mcu = Mcu::new();
    for (sequence, request) in [Request::Status, SET, Request::Arm, Request::Heartbeat].iter().enumerate() {
        assert_eq!(mcu.refusal(sequence as u16, request), Some(Reason::HelloFirst));
    }
    assert!(mcu.session.host_silent(0));
    assert_eq!(mcu.hear(4, &Request::Disarm), Some((4, ACK)));
    assert_eq!(mcu.applied, [Request::Disarm]);
    assert_eq!(mcu.refusal(5, &SET), Some(Reason::HelloFirst), "a Disarm does not start a session");
    mcu.offer(6);
    assert_eq!(mcu.refusal_in(Nonce::NONE, 7, &Request::Arm), Some(Reason::HelloFirst), "without the nonce");
    assert!(mcu.session.host_silent(0));
}

#[test]
fn disarm_is_executed_late_reused_or_from_another_version_without_changing_the_sequence() {
    let mut mcu = Mcu::after_hello(10);
    mcu.hear(20, &SET);
    assert_eq!(mcu.hear(15, &Request::Disarm), Some((15, ACK)));
    assert_eq!(mcu.hear(20, &Request::Disarm), Some((20, ACK)));
    let foreign = Frame::with_version(link::VERSION + 1, Sequence(1), &Request::Disarm);
    assert_eq!(mcu.hear_frame(&foreign), Some((1, ACK)));
    assert_eq!(mcu.hear_frame(&Frame::new(Nonce(1).stamp(Sequence(30)), &Request::Disarm)), Some((30, ACK)));
    assert_eq!(mcu.applied, [SET, Request::Disarm, Request::Disarm, Request::Disarm, Request::Disarm]);
    assert_eq!(mcu.refusal(19, &SET), Some(Reason::Stale { newest: 20 }));
    mcu.hear(21, &Request::Disarm);
    assert_eq!(
        mcu.refusal(21, &SET),
        Some(Reason::SequenceReused),
        "a Disarm in sequence counts like any other request"
    );
}

#[test]
fn a_new_session_restarts_the_sequence_and_stops_telemetry() {
    let mut mcu = Mcu::after_hello(40_000);
    mcu.hear(40_001, &Request::Stream { every_ticks: 10 });
    assert!(mcu.session.telemetry_due(10));
    mcu.offer(7);
    assert!(mcu.session.telemetry_due(10), "a Hello alone changes nothing");
    assert_eq!(mcu.hear(8, &SET), Some((8, ACK)));
    assert!(!mcu.session.telemetry_due(10), "telemetry continues although the new session has not requested it");
}

/// A recording of a session, played again in any order after it has ended or been replaced: nothing in it but `Disarm` is
/// followed, and it does not end the host's silence.
#[test]
fn a_recorded_session_has_no_effect_when_it_is_replayed() {
    let mut mcu = Mcu::new();
    let mut recorded = vec![Frame::new(Sequence(9), &Request::Hello)];
    let nonce = mcu.offer(9);
    for (number, request) in (10..).zip([Request::Arm, SET, Request::Heartbeat, Request::Stream { every_ticks: 10 }]) {
        recorded.push(Frame::new(nonce.stamp(Sequence(number)), &request));
        assert_eq!(mcu.hear(number, &request), Some((number, ACK)));
    }
    mcu.applied.clear();
    // In the session itself: the last frame is answered again, and is no sign of life either.
    mcu.now = 400;
    for _ in 0..3 {
        recorded.iter().for_each(|frame| assert!(mcu.hear_frame(frame).is_some()));
    }
    assert_eq!((mcu.session.silent_ticks(400), mcu.session.take_heard()), (Some(400), true));
    // In the next one, begun with the same numbers.
    mcu.greet(10);
    assert_ne!(mcu.nonce, nonce);
    assert!(mcu.session.take_heard());
    for frame in recorded.iter().chain(recorded.iter().rev()) {
        mcu.now += 10;
        let answer = mcu.hear_frame(frame);
        assert!(matches!(answer, Some((9, ACK) | (_, Reply::Refused(Reason::OtherSession)))), "{answer:?}");
    }
    assert_eq!((mcu.session.silent_ticks(mcu.now), mcu.session.take_heard()), (Some(100), false));
    assert!(mcu.applied.iter().all(|request| *request == Request::Hello), "{:?}", mcu.applied);
    assert_eq!(mcu.hear(11, &SET), Some((11, ACK)), "the running session goes on");
    // After a restart, which gives other nonces.
    let mut restarted = Mcu { session: Session::new(500, 8), ..Mcu::new() };
    for frame in &recorded {
        let answer = restarted.hear_frame(frame);
        assert!(matches!(answer, Some((9, ACK) | (_, Reply::Refused(Reason::HelloFirst)))), "{answer:?}");
    }
    assert!(restarted.session.host_silent(0) && !restarted.session.take_heard());
}

/// The answer may be lost: the repeated Hello must not make the nonce of the first answer worthless.
#[test]
fn a_repeated_hello_is_offered_the_same_session_and_a_new_one_another() {
    let mut mcu = Mcu::after_hello(3);
    let first = mcu.offer(7);
    assert_eq!(mcu.offer(7), first);
    assert_ne!(mcu.offer(8), first);
    let second = mcu.nonce;
    assert_eq!(mcu.refusal_in(first, 9, &SET), Some(Reason::OtherSession), "only the last offer holds");
    assert_eq!(mcu.refusal_in(second, 10, &SET), None);
    mcu.applied.clear();
    assert_ne!(mcu.offer(8), second, "an offer that was taken is not made again");
}

#[test]
fn a_request_of_another_version_is_rejected_with_this_version() {
    let mut mcu = Mcu::after_hello(0);
    let frame = Frame::with_version(9, Sequence(1), &SET);
    assert_eq!(mcu.hear_frame(&frame), Some((1, Reply::Refused(Reason::BadVersion(link::VERSION)))));
    assert_eq!((mcu.session.counters().bad_version, mcu.applied.len()), (1, 0));
}

#[test]
fn an_echo_of_a_reply_is_dropped() {
    let mut mcu = Mcu::after_hello(0);
    assert_eq!(mcu.hear(1, &ACK), None);
    assert_eq!(mcu.session.counters().unknown, 1);
}

#[test]
fn only_accepted_requests_of_the_session_end_the_silence() {
    let mut mcu = Mcu::new();
    assert_eq!(mcu.session.silent_ticks(1000), None);
    mcu.now = 1000;
    mcu.offer(9);
    assert_eq!(mcu.session.silent_ticks(1000), None, "a Hello may be a recorded one");
    mcu.hear(10, &Request::Status);
    assert!(!mcu.session.host_silent(1500));
    assert!(mcu.session.host_silent(1501));
    mcu.now = 1600;
    mcu.hear(11, &Request::Heartbeat);
    mcu.now = 1700;
    mcu.hear(11, &Request::Heartbeat);
    assert_eq!(mcu.session.silent_ticks(1700), Some(100), "a repeated frame may be a recorded one");
    mcu.now = 2100;
    mcu.hear(9, &Request::Heartbeat);
    mcu.hear(11, &SET);
    mcu.hear(9, &Request::Disarm);
    mcu.hear_frame(&Frame::with_version(link::VERSION + 1, Sequence(12), &SET));
    mcu.hear(12, &ACK);
    mcu.refusal_in(Nonce(1), 12, &Request::Heartbeat);
    assert_eq!(mcu.session.silent_ticks(2100), Some(500));
}

#[test]
fn telemetry_keeps_its_period_skips_missed_samples_and_stops_while_the_host_is_silent() {
    let mut mcu = Mcu::after_hello(0);
    mcu.hear(1, &Request::Stream { every_ticks: 10 });
    let mut pushed = Vec::new();
    for now in (0..48).chain(95..700) {
        if mcu.session.telemetry_due(now) {
            let sample = Telemetry { tick: now, ..Telemetry::default() };
            let (_, sequence, sent) = read(mcu.session.telemetry(sample, now)).unwrap();
            assert_eq!(sent, Reply::Telemetry(sample));
            assert_eq!(usize::from(sequence), pushed.len() + 1);
            pushed.push(now);
        }
    }
    assert_eq!(pushed[..8], [10, 20, 30, 40, 95, 100, 110, 120], "no burst after the gap, and back on the grid");
    assert_eq!(pushed.last(), Some(&500), "the host fell silent at 500");
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn the_numbers_of_telemetry_wrap_around() {
    let mut mcu = Mcu::after_hello(0);
    mcu.hear(1, &Request::Stream { every_ticks: 1 });
    for now in 1..70_000 {
        let (_, sequence, _) = read(mcu.session.telemetry(Telemetry::default(), now)).unwrap();
        assert_eq!(u64::from(sequence), now % 65_536);
    }
}
