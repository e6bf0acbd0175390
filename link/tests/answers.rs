//! What an answer of the MCU carries, what a session counts, and what both ends compute from the same bytes.

use link::frame::{MAX_FRAME, checksum};
use link::{Action, BlockId, Frame, Nonce, Reason, Receiver, Reply, Request, Sequence, Session, State, WireVolts};
use model::ScaledStiffness;
use model::units::Signal;

const ACK: Reply = Reply::Ack { state: State::Armed, target: WireVolts(5) };
const SILENCE_TICKS: u32 = 500;

/// Sends bytes to the session; returns nonce, number and content of each answer.
fn send(session: &mut Session, bytes: &[u8]) -> Vec<(Nonce, Sequence, Reply)> {
    let mut receiver = Receiver::new();
    let mut answers = Vec::new();
    for &byte in bytes {
        let sent = match session.on_byte(byte, 0) {
            Some(Action::Apply(_)) => session.answer(&ACK).to_vec(),
            Some(Action::Send(bytes)) => bytes.to_vec(),
            None => continue,
        };
        for byte in sent {
            let packet = receiver.on_byte(byte);
            answers.extend(packet.map(|packet| (packet.session(), packet.sequence, packet.read().unwrap())));
        }
    }
    answers
}

/// A session that has begun, and its nonce.
fn begun() -> (Session, Nonce) {
    let mut session = Session::new(SILENCE_TICKS, 7);
    let nonce = send(&mut session, Frame::new(Sequence(4), &Request::Hello).as_bytes())[0].0;
    assert_ne!(nonce, Nonce::NONE);
    send(&mut session, Frame::new(nonce.stamp(Sequence(5)), &Request::Status).as_bytes());
    (session, nonce)
}

#[test]
fn each_answer_carries_the_number_of_its_request_and_the_nonce_of_the_running_session() {
    let (mut session, nonce) = begun();
    let next = Frame::new(nonce.stamp(Sequence(6)), &Request::Arm);
    assert_eq!(send(&mut session, next.as_bytes()), [(nonce, Sequence(6), ACK)], "executed");
    assert_eq!(send(&mut session, next.as_bytes()), [(nonce, Sequence(6), ACK)], "repeated");
    let late = Frame::new(nonce.stamp(Sequence(3)), &Request::Arm);
    let refused = Reply::Refused(Reason::Stale { newest: 6 });
    assert_eq!(send(&mut session, late.as_bytes()), [(nonce, Sequence(3), refused)], "refused");
}

#[test]
fn before_a_session_answers_carry_no_nonce() {
    let frame = Frame::new(Nonce(9).stamp(Sequence(3)), &Request::Arm);
    let answers = send(&mut Session::new(SILENCE_TICKS, 7), frame.as_bytes());
    assert_eq!(answers, [(Nonce::NONE, Sequence(3), Reply::Refused(Reason::HelloFirst))]);
}

#[test]
fn a_request_that_is_not_known_is_refused_and_counted_apart() {
    let (mut session, nonce) = begun();
    // A message whose first byte is no request: a valid frame, of which the message and the CRC are replaced.
    let mut packet = vec![link::VERSION, b'Q', 6, 0, 0xee];
    packet.extend(nonce.0.to_le_bytes());
    packet.extend(checksum(&packet).to_le_bytes());
    let frame: Vec<u8> = [0].into_iter().chain(cobs::encode_vec(&packet)).chain([0]).collect();
    let refused = Reply::Refused(Reason::UnknownRequest);
    assert_eq!(send(&mut session, &frame), [(nonce, Sequence(6), refused)]);
    assert_eq!((session.counters().unknown, session.counters().out_of_order), (1, 0));
}

#[test]
fn damaged_and_oversized_frames_are_counted_by_the_session() {
    let (mut session, nonce) = begun();
    let mut damaged = Frame::new(nonce.stamp(Sequence(6)), &Request::Arm).as_bytes().to_vec();
    damaged[4] ^= 1;
    assert_eq!(send(&mut session, &damaged), []);
    assert_eq!((session.counters().damaged, session.counters().oversize), (1, 0));
    let endless = [[7; 2 * MAX_FRAME].as_slice(), &[0]].concat();
    assert_eq!(send(&mut session, &endless), []);
    assert_eq!((session.counters().damaged, session.counters().oversize), (1, 1));
}

#[test]
fn a_session_says_how_long_its_host_may_be_silent() {
    let (session, _) = begun();
    assert_eq!(session.silence_limit_ticks(), SILENCE_TICKS);
    assert!(!session.host_silent(u64::from(SILENCE_TICKS)) && session.host_silent(u64::from(SILENCE_TICKS) + 1));
}

#[test]
fn a_model_is_identified_by_number_format_length_and_checksum() {
    // "123456789", whose CRC-32C is in every catalogue.
    let id = BlockId::of(3, b"123456789");
    assert_eq!(id, BlockId { number: 3, format: b'1', length: 9, checksum: 0xe306_9283 });
}

#[test]
fn a_stiffness_arrives_as_the_voltage_that_expresses_it() {
    let stiffness = ScaledStiffness(Signal::from_num(312.5));
    assert_eq!(WireVolts::from(stiffness).to_f64(), 312.5);
}
