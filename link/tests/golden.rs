//! The wire format, byte by byte. A change makes existing hosts and MCUs incompatible and requires a new [`link::VERSION`].
//! CRC and framing are compared with an independent implementation.

mod by_hand;

use by_hand::by_hand;
use link::adaptation::Adaptation;
use link::capture::{Capture, Captured, ROWS, Rows};
use link::isolation::Isolation;
use link::reply::Firmware;
use link::session::Counters;
use link::{
    AdaptationReport, BlockId, Blocks, BrownOut, Controller, Desired, Fault, FaultReport, Field, Frame,
    IsolationReport, Message, Mismatch, Nonce, Notice, Part, Reason, Reply, Request, Sensor, Sequence, State, Status,
    Telemetry, WireVolts,
};

/// Returns the message and its frame as a line of the file for other clients.
fn check<M: Message>(message: &M, kind: u8, golden: &str) -> String {
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let mut bytes: Vec<u8> =
        (0..golden.len() / 2).map(|at| u8::from_str_radix(&golden[2 * at..2 * at + 2], 16).unwrap()).collect();
    // Two different bytes, so that a swapped order is detected.
    let frame = Frame::new(Nonce(0x0304_0506).stamp(Sequence(0x0102)), message);
    bytes.extend([6, 5, 4, 3]);
    assert_eq!(hex(frame.as_bytes()), hex(&by_hand(link::VERSION, kind, 0x0102, &bytes)), "expected message {golden}");
    format!("{golden} {}\n", hex(frame.as_bytes()))
}

/// Compares the frames with the file that the tests of `clients/cpp` read; writes it with `GOLDEN=write`.
fn check_file(name: &str, frames: &str) {
    let path = format!("{}/../clients/cpp/golden/{name}", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        std::fs::write(&path, frames).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(written, frames, "{path} is out of date: GOLDEN=write cargo test -p vsj-link --test golden");
}

#[test]
fn requests() {
    let mut frames = String::new();
    for (request, golden) in [
        (Request::Hello, "00"),
        (Request::Status, "01"),
        (Request::Set(Desired::ScaledVolts(300.0)), "02000000000000c07240"),
        (Request::Set(Desired::Pascal(1.5e9)), "0201000000c00b5ad641"),
        (Request::Set(Desired::NewtonPerMetre(0.25)), "0202000000000000d03f"),
        (Request::Arm, "03"),
        (Request::Disarm, "04"),
        (Request::Acknowledge(Fault(4)), "0504"),
        (Request::Heartbeat, "06"),
        (Request::Stream { every_ticks: 300 }, "07ac02"),
        (Request::Model, "08"),
        (Request::ModelPart { number: 12, bytes: [0xa5; 32] }, &format!("090c{}", "a5".repeat(32))),
        (Request::ModelEnd { length: 300, checksum: 128 }, "0aac028001"),
        (Request::Restart, "0b"),
        (Request::Heard { number: 300 }, "0cac02"),
        (Request::Settings, "0d"),
        (Request::SettingsPart { number: 3, bytes: [0xa5; 32] }, &format!("0e03{}", "a5".repeat(32))),
        (Request::SettingsEnd { length: 300, checksum: 128 }, "0fac028001"),
        (Request::ReadSettings { built_in: false, number: 2 }, "100002"),
        (Request::ReadSettings { built_in: true, number: 7 }, "100107"),
        (Request::Capture(Capture::Start { rows: 10_000 }), "1100904e"),
        (Request::Capture(Capture::State), "1101"),
        (Request::Capture(Capture::Read { first: 300 }), "1102ac02"),
        (Request::Isolation(Isolation::Read), "1200"),
        (Request::Isolation(Isolation::Acknowledge), "1201"),
        (Request::Adaptation(Adaptation::Read), "1300"),
        (Request::Adaptation(Adaptation::Off), "1301"),
        (Request::Adaptation(Adaptation::On), "1302"),
        (Request::BrownOut, "14"),
    ] {
        frames += &check(&request, b'Q', golden);
    }
    check_file("requests.txt", &frames);
}

#[test]
fn replies() {
    let sample = Telemetry {
        tick: 70_000,
        state: State::Armed,
        target: WireVolts(314_572_800),
        applied: WireVolts(-1),
        estimate: WireVolts(2),
        measured: None,
        code: 4095,
        limits: 9,
        mismatch: Mismatch(3),
        sensor: Sensor(4),
    };
    let status = Status {
        firmware: Firmware { major: 1, minor: 2, patch: 3, revision: 0x1234_5678, controller: Controller::Fast },
        rate_hz: 1000,
        silence_limit_ticks: 500,
        lowest: WireVolts(5),
        highest: WireVolts(6),
        overruns: 4,
        fault: Fault(1),
        last_fault: Fault(5),
        sample,
        counters: Counters {
            accepted: 10,
            repeated: 11,
            damaged: 12,
            oversize: 13,
            bad_version: 14,
            out_of_order: 15,
            unknown: 16,
            telemetry_dropped: 17,
        },
    };
    let mut frames = String::new();
    for (reply, golden) in [
        (Reply::Ack { state: State::Disarmed, target: WireVolts(0) }, "000000"),
        (Reply::Ack { state: State::Armed, target: WireVolts(1) }, "000102"),
        (Reply::Ack { state: State::Ramping, target: WireVolts(64) }, "00028001"),
        (Reply::Ack { state: State::Faulted, target: WireVolts(-1) }, "000301"),
        (Reply::Refused(Reason::OutOfRange { lowest: 0.0, highest: 700.0 }), "010000000000000000000000000000e08540"),
        (Reply::Refused(Reason::NotArmed), "0101"),
        (Reply::Refused(Reason::Faulted(Fault(3))), "010203"),
        (Reply::Refused(Reason::BadVersion(1)), "010301"),
        (Reply::Refused(Reason::HelloFirst), "0104"),
        (Reply::Refused(Reason::Stale { newest: 300 }), "0105ac02"),
        (Reply::Refused(Reason::SequenceReused), "0106"),
        (Reply::Refused(Reason::UnknownRequest), "0107"),
        (Reply::Refused(Reason::InterlockOpen), "0108"),
        (Reply::Refused(Reason::OtherFault(Fault(1))), "010901"),
        (Reply::Refused(Reason::HostSilent), "010a"),
        (Reply::Refused(Reason::Armed), "010b"),
        (Reply::Refused(Reason::PartMissing(3)), "010c03"),
        (Reply::Refused(Reason::Damaged), "010d"),
        (
            Reply::Refused(Reason::BadModel { field: Field::named("leakage.share"), lowest: 0.0, highest: 1.0 }),
            "010e050000000000000000000000000000f03f",
        ),
        (Reply::Refused(Reason::NotStored), "010f"),
        (Reply::Refused(Reason::Live), "0110"),
        (Reply::Refused(Reason::CausePresent(Fault(5))), "011105"),
        (Reply::Refused(Reason::OtherSession), "0112"),
        (Reply::Refused(Reason::Reference), "0113"),
        (
            Reply::Refused(Reason::BadSettings { field: Field::named("hang_ms"), lowest: 0.0, highest: 1.0 }),
            "0114270000000000000000000000000000f03f",
        ),
        (
            Reply::Refused(Reason::BadSettings { field: Field::named("margin.share"), lowest: 0.0, highest: 0.25 }),
            "01142e0000000000000000000000000000d03f",
        ),
        (Reply::Refused(Reason::NotBuiltIn(Field::named("controller"))), "011512"),
        (Reply::Refused(Reason::TooManyRows { most: 300 }), "0116ac02"),
        (
            Reply::Status(status),
            "02010203f8acd1910102e807f4030a0c040105f0a20401808080ac02010400ff1f0903040a0b0c0d0e0f1011",
        ),
        (
            Reply::Status(Status {
                firmware: Firmware { controller: Controller::Robust, ..status.firmware },
                ..status
            }),
            "02010203f8acd1910103e807f4030a0c040105f0a20401808080ac02010400ff1f0903040a0b0c0d0e0f1011",
        ),
        (Reply::Telemetry(sample), "03f0a20401808080ac02010400ff1f090304"),
        (
            Reply::Telemetry(Telemetry { measured: Some(WireVolts(3)), ..sample }),
            "03f0a20401808080ac0201040106ff1f090304",
        ),
        (
            Reply::Model(Blocks {
                active: BlockId { number: 1, format: 2, length: 300, checksum: 4 },
                stored: BlockId { number: 5, format: 6, length: 7, checksum: 8 },
            }),
            "040102ac020405060708",
        ),
        (
            Reply::Fault(FaultReport {
                number: 300,
                tick: 70_000,
                fault: Fault(6),
                standing: 0x24,
                mismatch: Mismatch(3),
            }),
            "05ac02f0a204062403",
        ),
        (
            Reply::Settings(Blocks {
                active: BlockId { number: 1, format: 2, length: 300, checksum: 4 },
                stored: BlockId { number: 5, format: 6, length: 7, checksum: 8 },
            }),
            "060102ac020405060708",
        ),
        (Reply::Captured(Captured { most: 300, wanted: 10_000, captured: 5 }), "08ac02904e05"),
        (
            Reply::Rows(Rows { first: 300, count: 2, rows: [[0xa5; 8]; ROWS] }),
            &format!("09ac0202{}", "a5".repeat(8 * ROWS)),
        ),
        (
            Reply::Isolation(IsolationReport {
                tick: 70_000,
                verdict: 0x4a0,
                since_tick: 300,
                size: 0.25,
                half_width: 1.0,
                explained: 0.0,
                trip_on_cause: 0x8001,
            }),
            "0af0a204a009ac02000000000000d03f000000000000f03f0000000000000000818002",
        ),
        (
            Reply::Adaptation(AdaptationReport {
                tick: 70_000,
                phase: 3,
                ratios: [1.0, 2.0, 0.5],
                bounds: [0.25, 0.125, 0.0],
                stored: [4.0, 8.0],
                exchanges: 300,
                exchange_tick: 200,
            }),
            "0bf0a20403000000000000f03f0000000000000040000000000000e03f\
             000000000000d03f000000000000c03f000000000000000000000000000010400000000000002040ac02c801",
        ),
        (Reply::BrownOut(None), "0c00"),
        (Reply::BrownOut(Some(BrownOut { level: 0, expected: 4 })), "0c010004"),
        (
            Reply::SettingsPart(Part { number: 2, length: 300, bytes: [0xa5; 32] }),
            &format!("0702ac02{}", "a5".repeat(32)),
        ),
    ] {
        frames += &check(&reply, b'A', golden);
        if let Reply::Refused(reason) = reply {
            assert_eq!(golden[2..4], format!("{:02x}", reason.code()), "{reason}");
        }
    }
    check_file("replies.txt", &frames);
}

#[test]
fn notices() {
    let report = IsolationReport {
        tick: 70_000,
        verdict: 0x4a0,
        since_tick: 300,
        size: 0.25,
        half_width: 1.0,
        explained: 0.0,
        trip_on_cause: 0x8001,
    };
    let golden = "00f0a204a009ac02000000000000d03f000000000000f03f0000000000000000818002";
    check_file("notices.txt", &check(&Notice::Isolation(report), b'N', golden));
}

/// The bytes of one complete frame on the wire.
#[test]
fn a_complete_frame() {
    let frame = Frame::new(Sequence(1), &Request::Hello);
    assert_eq!(frame.as_bytes(), by_hand(link::VERSION, b'Q', 1, &[0; 5]));
    assert_eq!(frame.as_bytes(), [0, 4, 5, b'Q', 1, 1, 1, 1, 1, 1, 5, 0xb1, 0xef, 0x5d, 0x2e, 0]);
}

#[test]
fn fault_codes() {
    let names = (0..=11).map(|code| Fault(code).name()).collect::<Vec<_>>().join(" ");
    assert_eq!(
        names,
        "none panic hard-fault overrun interlock watchdog monitor config supply self-test isolation unknown"
    );
}
