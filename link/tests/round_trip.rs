//! Every message arrives as it was sent, within the bound of a frame.

mod common;

use link::frame::MAX_FRAME;
use link::reply::Firmware;
use link::session::Counters;
use link::{
    Controller, Desired, Fault, Frame, Message, Receiver, Reply, Request, Sequence, State, Status, Telemetry, WireVolts,
};
use proptest::prelude::*;

fn arrive<M: Message>(frame: &Frame) -> Vec<(Sequence, M)> {
    let mut receiver = Receiver::new();
    let mut arrived = Vec::new();
    for &byte in frame.as_bytes() {
        if let Some(packet) = receiver.on_byte(byte) {
            arrived.push((packet.sequence, packet.read().unwrap()));
        }
    }
    arrived
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_request_arrives_once_as_it_was_sent(sequence: u16, request in common::request()) {
        let frame = Frame::new(Sequence(sequence), &request);
        prop_assert!(frame.as_bytes().len() <= MAX_FRAME);
        prop_assert_eq!(arrive(&frame), vec![(Sequence(sequence), request)]);
        prop_assert!(arrive_nothing_as_reply(&frame));
    }

    #[test]
    fn a_reply_arrives_once_as_it_was_sent(sequence: u16, reply in common::reply()) {
        let frame = Frame::new(Sequence(sequence), &reply);
        prop_assert!(!frame.as_bytes().is_empty());
        prop_assert_eq!(arrive(&frame), vec![(Sequence(sequence), reply)]);
    }
}

/// A host that hears its own request does not take it for an answer.
fn arrive_nothing_as_reply(frame: &Frame) -> bool {
    let mut receiver = Receiver::new();
    frame.as_bytes().iter().all(|&byte| receiver.on_byte(byte).is_none_or(|packet| packet.read::<Reply>().is_err()))
}

#[test]
fn a_number_that_is_none_arrives_as_such() {
    let arrived = arrive::<Request>(&Frame::new(Sequence(0), &Request::Set(Desired::Pascal(f64::NAN))));
    assert!(matches!(arrived[..], [(_, Request::Set(Desired::Pascal(number)))] if number.is_nan()));
}

/// The largest message there is: every number at its longest.
#[test]
fn the_largest_message_fits_a_frame() {
    let most = u32::MAX;
    let volts = WireVolts(i32::MIN);
    let sample = Telemetry {
        tick: u64::MAX,
        state: State::Faulted,
        target: volts,
        applied: volts,
        estimate: volts,
        measured: Some(volts),
        code: u16::MAX,
        limits: u8::MAX,
    };
    let status = Status {
        firmware: Firmware { major: 255, minor: 255, patch: 255, revision: most, controller: Controller::Fast },
        rate_hz: most,
        silence_limit_ticks: most,
        lowest: volts,
        highest: volts,
        overruns: most,
        fault: Fault(255),
        last_fault: Fault(255),
        sample,
        counters: Counters {
            accepted: most,
            repeated: most,
            damaged: most,
            oversize: most,
            bad_version: most,
            out_of_order: most,
            unknown: most,
        },
    };
    const { assert!(119 <= MAX_FRAME) };
    let length = |reply| Frame::new(Sequence(u16::MAX), &reply).as_bytes().len();
    assert_eq!(length(Reply::Status(status)), 119);
    assert_eq!(length(Reply::Telemetry(sample)), 48);
}
