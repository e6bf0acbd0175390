//! Every message survives encoding and decoding and fits into a frame.

mod common;

use link::frame::{MAX_FRAME, MAX_MESSAGE};
use link::reply::Firmware;
use link::session::Counters;
use link::{
    Controller, Desired, Fault, Frame, Message, Mismatch, Nonce, Receiver, Reply, Request, Sensor, Sequence, Stamp,
    State, Status, Telemetry, WireVolts,
};
use proptest::prelude::*;
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

fn decode<M: Message>(frame: &Frame) -> Vec<(Stamp, M)> {
    let mut receiver = Receiver::new();
    let mut decoded = Vec::new();
    for &byte in frame.as_bytes() {
        if let Some(packet) = receiver.on_byte(byte) {
            decoded.push((packet.session().stamp(packet.sequence), packet.read().unwrap()));
        }
    }
    decoded
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_request_survives_a_round_trip(sequence: u16, session: u32, request in common::request()) {
        let stamp = Nonce(session).stamp(Sequence(sequence));
        let frame = Frame::new(stamp, &request);
        prop_assert!(frame.as_bytes().len() <= MAX_FRAME);
        prop_assert_eq!(decode(&frame), vec![(stamp, request)]);
        prop_assert!(is_not_a_reply(&frame));
    }

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_reply_survives_a_round_trip(sequence: u16, session: u32, reply in common::reply()) {
        let stamp = Nonce(session).stamp(Sequence(sequence));
        let frame = Frame::new(stamp, &reply);
        prop_assert!(!frame.as_bytes().is_empty());
        prop_assert_eq!(decode(&frame), vec![(stamp, reply)]);
    }

    #[test]
    #[cfg_attr(miri, ignore = "slow under Miri")]
    fn a_notice_survives_a_round_trip_and_is_not_a_reply(sequence: u16, session: u32, notice in common::notice()) {
        let stamp = Nonce(session).stamp(Sequence(sequence));
        let frame = Frame::new(stamp, &notice);
        prop_assert!(!frame.as_bytes().is_empty());
        prop_assert_eq!(decode(&frame), vec![(stamp, notice)]);
        prop_assert!(is_not_a_reply(&frame));
    }
}

/// A host does not accept the echo of its own request, or a notice, as a reply.
fn is_not_a_reply(frame: &Frame) -> bool {
    let mut receiver = Receiver::new();
    frame.as_bytes().iter().all(|&byte| receiver.on_byte(byte).is_none_or(|packet| packet.read::<Reply>().is_err()))
}

#[test]
fn nan_survives_a_round_trip() {
    let decoded = decode::<Request>(&Frame::new(Sequence(0), &Request::Set(Desired::Pascal(f64::NAN))));
    assert!(matches!(decoded[..], [(_, Request::Set(Desired::Pascal(number)))] if number.is_nan()));
}

/// A message of any number of bytes.
#[derive(Clone, Debug, PartialEq)]
struct Long(usize);

impl Serialize for Long {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0)?;
        (0..self.0).try_for_each(|_| tuple.serialize_element(&7u8))?;
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Long {
    fn deserialize<D: Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(serde::de::Error::custom("only sent"))
    }
}

impl Message for Long {
    const KIND: u8 = b'L';
}

/// Two delimiters, the byte of COBS, version, kind, sequence, session and CRC-32C are the rest of the frame.
#[test]
fn a_message_of_the_largest_length_fills_a_frame_and_a_longer_one_is_not_sent() {
    let length = |bytes| Frame::new(Sequence(1), &Long(bytes)).as_bytes().len();
    assert_eq!(length(MAX_MESSAGE), MAX_FRAME);
    assert_eq!(length(MAX_MESSAGE - 1), MAX_FRAME - 1);
    assert_eq!(length(MAX_MESSAGE + 1), 0);
}

/// The longest message, with the longest encoding of every number.
#[test]
fn the_longest_message_fits_into_a_frame() {
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
        mismatch: Mismatch(255),
        sensor: Sensor(255),
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
            telemetry_dropped: most,
        },
    };
    const { assert!(130 <= MAX_FRAME) };
    let length = |reply| Frame::new(Sequence(u16::MAX), &reply).as_bytes().len();
    assert_eq!(length(Reply::Status(status)), 130);
    assert_eq!(length(Reply::Telemetry(sample)), 54);
}
