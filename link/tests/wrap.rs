//! Counters of a session across their ends: sequence numbers after 65 536 frames, ticks after 2^32 (49.7 days at 1 kHz).

use link::{Action, Frame, Nonce, Receiver, Reply, Request, Sequence, Session, State, Telemetry, WireVolts};

const ACK: Reply = Reply::Ack { state: State::Armed, target: WireVolts(5) };
const SILENCE_TICKS: u32 = 500;

/// A host and the session that it talks to.
struct Host {
    session: Session,
    nonce: Nonce,
}

impl Host {
    /// A host with a session that it asked for with the request number `sequence`.
    fn begin(sequence: u16, now: u64) -> Self {
        let mut host = Self { session: Session::new(SILENCE_TICKS, 7), nonce: Nonce::NONE };
        host.offer(sequence, now);
        host
    }

    /// Asks for a session; the following frames carry its nonce.
    fn offer(&mut self, sequence: u16, now: u64) {
        let mut receiver = Receiver::new();
        let mut nonce = None;
        for &byte in Frame::new(Sequence(sequence), &Request::Hello).as_bytes() {
            if let Some(Action::Apply(_)) = self.session.on_byte(byte, now) {
                let answer = self.session.answer(&ACK);
                nonce = answer.iter().find_map(|&byte| receiver.on_byte(byte).map(|packet| packet.session()));
            }
        }
        self.nonce = nonce.expect("an offer");
    }

    /// Sends a request; returns whether it was executed.
    fn executes(&mut self, sequence: u16, request: &Request, now: u64) -> bool {
        let mut executed = false;
        for &byte in Frame::new(self.nonce.stamp(Sequence(sequence)), request).as_bytes() {
            if let Some(Action::Apply(_)) = self.session.on_byte(byte, now) {
                executed = true;
                self.session.answer(&ACK);
            }
        }
        executed
    }
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn every_request_is_executed_across_the_wrap_of_its_number_until_the_session_is_used_up() {
    const NUMBERS: u32 = 1 << 16;
    let mut host = Host::begin(65_000, 0);
    let sequence = |step: u32| (65_000 + step) as u16;
    for step in 1..=NUMBERS {
        let now = u64::from(step);
        assert!(host.executes(sequence(step), &Request::Status, now), "frame {step}");
        assert!(!host.executes(sequence(step), &Request::Status, now), "a repetition is not executed");
    }
    assert_eq!((host.session.counters().accepted, host.session.counters().repeated), (NUMBERS + 1, NUMBERS));
    assert!(!host.executes(sequence(NUMBERS + 1), &Request::Status, u64::from(NUMBERS)), "the first number again");
    host.offer(3, u64::from(NUMBERS));
    assert!(host.executes(4, &Request::Status, u64::from(NUMBERS)), "a new session");
}

#[test]
#[cfg_attr(miri, ignore = "slow under Miri")]
fn telemetry_and_silence_go_on_when_the_ticks_pass_two_to_the_32() {
    const EVERY: u16 = 7;
    let start = (1u64 << 32) - 300_000;
    let mut host = Host::begin(1, start);
    let mut receiver = Receiver::new();
    assert!(host.executes(2, &Request::Stream { every_ticks: EVERY }, start));
    let (mut pushed, mut last, mut sequence) = (0u32, None, 2u16);
    for now in start + 1..start + 600_000 {
        if now % 400 == 0 {
            sequence = sequence.wrapping_add(1);
            assert!(host.executes(sequence, &Request::Status, now));
        }
        let due = (now - start).is_multiple_of(u64::from(EVERY));
        assert_eq!(host.session.telemetry_due(now), due && !host.session.host_silent(now), "tick {now}");
        if host.session.telemetry_due(now) {
            let sample = Telemetry { tick: now, ..Telemetry::default() };
            let bytes = host.session.telemetry(sample, now).to_vec();
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
    assert!(host.session.host_silent(end + 1) && !host.session.telemetry_due(end + 1));
}
