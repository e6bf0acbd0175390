//! Counters of a session across their ends: sequence numbers after 65 536 frames, ticks after 2^32 (49.7 days at 1 kHz).

use link::{Action, Frame, Receiver, Reply, Request, Sequence, Session, State, Telemetry, WireVolts};

const ACK: Reply = Reply::Ack { state: State::Armed, target: WireVolts(5) };
const SILENCE_TICKS: u32 = 500;

/// Sends a request; returns whether it was executed.
fn executes(session: &mut Session, sequence: u16, request: &Request, now: u64) -> bool {
    let mut executed = false;
    for &byte in Frame::new(Sequence(sequence), request).as_bytes() {
        if let Some(Action::Apply(_)) = session.on_byte(byte, now) {
            executed = true;
            session.answer(&ACK);
        }
    }
    executed
}

#[test]
fn every_request_in_sequence_is_executed_across_the_wrap_of_its_number() {
    let mut session = Session::new(SILENCE_TICKS);
    assert!(executes(&mut session, 65_000, &Request::Hello, 0));
    for step in 1..=70_000u32 {
        let sequence = (65_000 + step) as u16;
        assert!(executes(&mut session, sequence, &Request::Status, u64::from(step)), "frame {step}");
        assert!(!executes(&mut session, sequence, &Request::Status, u64::from(step)), "a repetition is not executed");
    }
    assert_eq!((session.counters().accepted, session.counters().repeated), (70_001, 70_000));
}

#[test]
fn telemetry_and_silence_go_on_when_the_ticks_pass_two_to_the_32() {
    const EVERY: u16 = 7;
    let start = (1u64 << 32) - 300_000;
    let mut session = Session::new(SILENCE_TICKS);
    let mut receiver = Receiver::new();
    assert!(executes(&mut session, 1, &Request::Hello, start));
    assert!(executes(&mut session, 2, &Request::Stream { every_ticks: EVERY }, start));
    let (mut pushed, mut last, mut sequence) = (0u32, None, 2u16);
    for now in start + 1..start + 600_000 {
        if now % 400 == 0 {
            sequence = sequence.wrapping_add(1);
            assert!(executes(&mut session, sequence, &Request::Status, now));
        }
        let due = (now - start).is_multiple_of(u64::from(EVERY));
        assert_eq!(session.telemetry_due(now), due && !session.host_silent(now), "tick {now}");
        if session.telemetry_due(now) {
            let sample = Telemetry { tick: now, ..Telemetry::default() };
            let bytes = session.telemetry(sample, now).to_vec();
            let mut number = None;
            for byte in bytes {
                if let Some(packet) = receiver.on_byte(byte) {
                    number = Some(packet.sequence);
                    assert_eq!(packet.read::<Reply>(), Ok(Reply::Telemetry(sample)));
                }
            }
            assert!(last.is_none_or(|last: Sequence| number == Some(last.next())), "after {pushed} samples");
            (last, pushed) = (number, pushed + 1);
        }
    }
    assert!(pushed > 80_000, "{pushed} samples: their number has wrapped");
    // The host has been silent since its last request.
    let end = start + 600_000 + u64::from(SILENCE_TICKS);
    assert!(session.host_silent(end + 1) && !session.telemetry_due(end + 1));
}
