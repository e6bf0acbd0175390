//! Strategies that generate every kind of message.

use link::adaptation::Adaptation;
use link::capture::{Capture, Captured, ROWS, Rows};
use link::isolation::Isolation;
use link::reply::Firmware;
use link::session::Counters;
use link::{
    AdaptationReport, BlockId, Blocks, BrownOut, Controller, Desired, Fault, FaultReport, Field, IsolationReport,
    Mismatch, Notice, Part, Reason, Reply, Request, Sensor, State, Status, Telemetry, WireVolts,
};
use proptest::prelude::*;

/// Any number but NaN, which does not equal itself and has its own test.
fn number() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("NaN", |number| !number.is_nan())
}

fn fault() -> impl Strategy<Value = Fault> {
    any::<u8>().prop_map(Fault)
}

fn volts() -> impl Strategy<Value = WireVolts> {
    any::<i32>().prop_map(WireVolts)
}

pub(crate) fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        Just(Request::Hello),
        Just(Request::Status),
        number().prop_map(|v| Request::Set(Desired::ScaledVolts(v))),
        number().prop_map(|v| Request::Set(Desired::Pascal(v))),
        number().prop_map(|v| Request::Set(Desired::NewtonPerMetre(v))),
        Just(Request::Arm),
        Just(Request::Disarm),
        fault().prop_map(Request::Acknowledge),
        Just(Request::Heartbeat),
        any::<u16>().prop_map(|every_ticks| Request::Stream { every_ticks }),
        Just(Request::Model),
        any::<(u8, [u8; 32])>().prop_map(|(number, bytes)| Request::ModelPart { number, bytes }),
        any::<(u16, u32)>().prop_map(|(length, checksum)| Request::ModelEnd { length, checksum }),
        Just(Request::Restart),
        any::<u32>().prop_map(|number| Request::Heard { number }),
        Just(Request::Settings),
        any::<(u8, [u8; 32])>().prop_map(|(number, bytes)| Request::SettingsPart { number, bytes }),
        any::<(u16, u32)>().prop_map(|(length, checksum)| Request::SettingsEnd { length, checksum }),
        any::<(bool, u8)>().prop_map(|(built_in, number)| Request::ReadSettings { built_in, number }),
        any::<u32>().prop_map(|rows| Request::Capture(Capture::Start { rows })),
        Just(Request::Capture(Capture::State)),
        any::<u32>().prop_map(|first| Request::Capture(Capture::Read { first })),
        prop::sample::select(vec![Isolation::Read, Isolation::Acknowledge]).prop_map(Request::Isolation),
        prop::sample::select(vec![Adaptation::Read, Adaptation::Off, Adaptation::On]).prop_map(Request::Adaptation),
        Just(Request::BrownOut),
    ]
}

fn state() -> impl Strategy<Value = State> {
    prop::sample::select(vec![State::Disarmed, State::Armed, State::Ramping, State::Faulted])
}

fn reason() -> impl Strategy<Value = Reason> {
    prop_oneof![
        (number(), number()).prop_map(|(lowest, highest)| Reason::OutOfRange { lowest, highest }),
        Just(Reason::NotArmed),
        fault().prop_map(Reason::Faulted),
        any::<u8>().prop_map(Reason::BadVersion),
        Just(Reason::HelloFirst),
        any::<u16>().prop_map(|newest| Reason::Stale { newest }),
        Just(Reason::SequenceReused),
        Just(Reason::UnknownRequest),
        Just(Reason::InterlockOpen),
        fault().prop_map(Reason::OtherFault),
        Just(Reason::HostSilent),
        Just(Reason::Armed),
        any::<u8>().prop_map(Reason::PartMissing),
        Just(Reason::Damaged),
        (any::<u8>(), number(), number()).prop_map(|(field, lowest, highest)| Reason::BadModel {
            field: Field(field),
            lowest,
            highest
        }),
        Just(Reason::NotStored),
        Just(Reason::Live),
        any::<u8>().prop_map(|code| Reason::CausePresent(Fault(code))),
        Just(Reason::OtherSession),
        Just(Reason::Reference),
        (any::<u8>(), number(), number()).prop_map(|(field, lowest, highest)| Reason::BadSettings {
            field: Field(field),
            lowest,
            highest
        }),
        any::<u8>().prop_map(|field| Reason::NotBuiltIn(Field(field))),
        any::<u32>().prop_map(|most| Reason::TooManyRows { most }),
    ]
}

fn telemetry() -> impl Strategy<Value = Telemetry> {
    let bytes = any::<[u8; 3]>();
    (any::<u64>(), state(), volts(), volts(), volts(), prop::option::of(volts()), any::<u16>(), bytes).prop_map(
        |(tick, state, target, applied, estimate, measured, code, [limits, mismatch, sensor])| Telemetry {
            tick,
            state,
            target,
            applied,
            estimate,
            measured,
            code,
            limits,
            mismatch: Mismatch(mismatch),
            sensor: Sensor(sensor),
        },
    )
}

fn controller() -> impl Strategy<Value = Controller> {
    prop_oneof![Just(Controller::None), Just(Controller::Paper), Just(Controller::Fast), Just(Controller::Robust)]
}

fn status() -> impl Strategy<Value = Status> {
    let program = (any::<[u8; 3]>(), controller());
    (program, any::<[u32; 4]>(), volts(), volts(), fault(), fault(), telemetry(), any::<[u32; 8]>()).prop_map(
        |(([major, minor, patch], controller), numbers, lowest, highest, fault, last_fault, sample, counts)| {
            let [revision, rate_hz, silence_limit_ticks, overruns] = numbers;
            let [accepted, repeated, damaged, oversize, bad_version, out_of_order, unknown, telemetry_dropped] = counts;
            Status {
                firmware: Firmware { major, minor, patch, revision, controller },
                rate_hz,
                silence_limit_ticks,
                lowest,
                highest,
                overruns,
                fault,
                last_fault,
                sample,
                counters: Counters {
                    accepted,
                    repeated,
                    damaged,
                    oversize,
                    bad_version,
                    out_of_order,
                    unknown,
                    telemetry_dropped,
                },
            }
        },
    )
}

fn model() -> impl Strategy<Value = BlockId> {
    any::<(u32, u8, u16, u32)>().prop_map(|(number, format, length, checksum)| BlockId {
        number,
        format,
        length,
        checksum,
    })
}

fn isolation() -> impl Strategy<Value = IsolationReport> {
    (any::<[u64; 2]>(), any::<[u16; 2]>(), [number(), number(), number()]).prop_map(
        |([tick, since_tick], [verdict, trip_on_cause], [size, half_width, explained])| IsolationReport {
            tick,
            verdict,
            since_tick,
            size,
            half_width,
            explained,
            trip_on_cause,
        },
    )
}

pub(crate) fn notice() -> impl Strategy<Value = Notice> {
    isolation().prop_map(Notice::Isolation)
}

pub(crate) fn reply() -> impl Strategy<Value = Reply> {
    prop_oneof![
        (state(), volts()).prop_map(|(state, target)| Reply::Ack { state, target }),
        reason().prop_map(Reply::Refused),
        status().prop_map(Reply::Status),
        telemetry().prop_map(Reply::Telemetry),
        (model(), model()).prop_map(|(active, stored)| Reply::Model(Blocks { active, stored })),
        any::<(u32, u64, u8, u16, u8)>().prop_map(|(number, tick, fault, standing, mismatch)| {
            let (fault, mismatch) = (Fault(fault), Mismatch(mismatch));
            Reply::Fault(FaultReport { number, tick, fault, standing, mismatch })
        }),
        any::<[u32; 3]>().prop_map(|[most, wanted, captured]| Reply::Captured(Captured { most, wanted, captured })),
        any::<(u32, u8, [[u8; 8]; ROWS])>().prop_map(|(first, count, rows)| Reply::Rows(Rows { first, count, rows })),
        isolation().prop_map(Reply::Isolation),
        (any::<[u64; 2]>(), any::<u8>(), any::<u32>(), prop::collection::vec(number(), 8)).prop_map(
            |([tick, exchange_tick], phase, exchanges, numbers)| {
                let (ratios, bounds) = ([numbers[0], numbers[1], numbers[2]], [numbers[3], numbers[4], numbers[5]]);
                let stored = [numbers[6], numbers[7]];
                Reply::Adaptation(AdaptationReport { tick, phase, ratios, bounds, stored, exchanges, exchange_tick })
            }
        ),
        any::<Option<(u8, u8)>>()
            .prop_map(|of| Reply::BrownOut(of.map(|(level, expected)| BrownOut { level, expected }))),
        (model(), model()).prop_map(|(active, stored)| Reply::Settings(Blocks { active, stored })),
        any::<(u8, u16, [u8; 32])>().prop_map(|(number, length, bytes)| Reply::SettingsPart(Part {
            number,
            length,
            bytes
        })),
    ]
}
