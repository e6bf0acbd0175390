//! The run with a host at the serial line: what it sends and when, and the codes and answers that must follow.
//!
//! The time of an answer shows which tick followed a request: the answer leaves right after that tick. From there on
//! the code on the host predicts every DAC code.

use anyhow::{Context, Result, bail, ensure};
use firmware::control::{Control, Sensors, Untimed};
use firmware::settings::{SUPERVISION, WATCHDOG_MS, built_in};
use firmware::store::{Memory, Page, Pages, Side, Store};
use link::nonce::Nonces;
use link::{
    Block, Command, Desired, Frame, Packet, Reason, Receiver, Reply, Request, Sequence, State, WireSettings, WireVolts,
    block, frame,
};
use model::{Settings, Volts, supervisor};
use serde_json::{Value, json};

use xtask::variant::Variant;

use super::events::{Event, Events};
use crate::variant;

/// Duration of a byte at 115 200 bit/s, in us.
const BYTE_US: f64 = 1e7 / 115_200.0;
/// Two targets, in V. Under the time-optimal controller the voltage leaves the amplifier's limit before the second.
const TARGETS_V: [f64; 2] = [100.0, 60.0];

/// Time in us and request of each frame. After the last one the host is silent.
fn schedule() -> Vec<(u32, Request)> {
    let set = |volts| Request::Set(Desired::ScaledVolts(volts));
    vec![
        (20_000, Request::Hello),
        (40_000, Request::Arm),
        (60_000, set(TARGETS_V[0])),
        (160_000, Request::Heartbeat),
        (260_000, Request::Heartbeat),
        (360_000, Request::Heartbeat),
        (460_000, set(TARGETS_V[1])),
        (560_000, Request::Heartbeat),
        (660_000, Request::Heartbeat),
    ]
}

/// Random number that the chip's generator delivers.
pub(super) const RANDOM: u32 = 0x7a11_ab1e;

/// The schedule as JSON: time in us and frame in hex. A frame's sequence number is its index, and its session the first of
/// a chip whose generator delivers `random`.
pub(super) fn frames(random: u32) -> Value {
    let nonce = Nonces::new(random).draw();
    let frame =
        |(number, (us, request))| json!([us, hex(Frame::new(nonce.stamp(Sequence(number)), &request).as_bytes())]);
    (0..).zip(schedule()).map(frame).collect()
}

/// Bytes as text.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Time of the watchdog in the stored settings, in ms.
pub(super) const STORED_RESET_MS: u32 = 2 * WATCHDOG_MS;

/// A page of settings that differ from the built-in ones of `variant` in the time of the watchdog.
pub(super) fn stored_settings(variant: Variant) -> Result<Vec<u8>> {
    let built_in = WireSettings::new(&built_in(variant::settings(variant)));
    let [hang_ms, stall_ms, _] = built_in.watchdogs_ms;
    let settings = WireSettings { watchdogs_ms: [hang_ms, stall_ms, STORED_RESET_MS], ..built_in };
    let payload = settings.payload().context("settings without a payload")?;
    let mut store = Store::new(Memory::default());
    let refused = |reason: Reason| anyhow::anyhow!("{reason}");
    for (number, part) in (0..).zip(payload.chunks(block::PART)) {
        let mut bytes = [0; block::PART];
        bytes[..part.len()].copy_from_slice(part);
        store.part(Block::Settings, number, &bytes).map_err(refused)?;
    }
    let length = u16::try_from(payload.len())?;
    store.end(Block::Settings, length, frame::checksum(&payload), |_, _| Ok(())).map_err(refused)?;
    Ok(store.pages().bytes(Page { block: Block::Settings, side: Side::A }).to_vec())
}

/// An error unless every answer is the expected one and every DAC code is the host's for `variant`. Returns a line for
/// the report.
pub(super) fn check(events: &Events, variant: Variant) -> Result<String> {
    let (_, ticking) = events.split("watchdog started")?;
    let written = written(&ticking)?;
    let answers = answers(&ticking)?;
    let schedule = schedule();
    ensure!(answers.len() == schedule.len(), "{} answers to {} requests", answers.len(), schedule.len());

    let mut orders = vec![Command::default(); written.len()];
    for ((number, (_, request)), (us, sequence, reply)) in (0u16..).zip(&schedule).zip(&answers) {
        ensure!(sequence.0 == number, "answer {} to request {number}", sequence.0);
        let next = written.iter().position(|(at, ..)| at > us).context("no tick after an answer")?;
        let tick = match request {
            // Followed before it is answered. All other requests are answered first, and the next tick processes them.
            Request::Arm | Request::Set(_) => next - 1,
            _ => next,
        };
        orders[tick] = match request {
            Request::Arm => Command { heard: true, arming: Some(supervisor::Command::Arm), target: Some(Volts::ZERO) },
            Request::Set(Desired::ScaledVolts(volts)) => {
                Command { heard: true, arming: None, target: Some(Volts::new(*volts)?) }
            }
            // A sign of life is in the session's frames only.
            Request::Hello => Command::default(),
            _ => Command { heard: true, ..Command::default() },
        };
        expect(number, request, reply, variant).with_context(|| format!("{request:?} is answered with {reply:?}"))?;
    }

    let on_host = drives(variant, &orders)?;
    for (tick, ((code, enabled), (us, host_code, host_enabled))) in on_host.iter().zip(&written).enumerate() {
        if (*code, *enabled) != (*host_code, *host_enabled) {
            bail!(
                "tick {tick} at {us:.0} us writes {host_code}, enabled {host_enabled}; on the host it is {code}, {enabled}"
            );
        }
    }
    let driven = on_host.iter().filter(|(code, enabled)| *enabled && *code > 0).count();
    ensure!(driven > 1000, "{driven} ticks with voltage show little");
    // Codes at the limit, or the same in every image, would not distinguish this image.
    let highest = (1u16 << variant::settings(variant).amplifier.dac_bits) - 1;
    let inside = on_host.iter().filter(|(code, enabled)| *enabled && (1..highest).contains(code)).count();
    ensure!(inside > 500, "{inside} codes inside of the range show little");
    let mut telling = usize::MAX;
    for other in variant.others() {
        let differ = drives(other, &orders)?.iter().zip(&on_host).filter(|(other, own)| other != own).count();
        ensure!(differ > 500, "only {differ} codes would be others in another image");
        telling = telling.min(differ);
    }
    ensure!(written.last().is_some_and(|(_, code, enabled)| *code == 0 && !enabled), "silence does not disarm");
    let [first, second] = TARGETS_V;
    Ok(format!(
        "{} requests over LPUART1 armed it, set {first} V and {second} V and fell silent, past a debugger that reads the log \
         no more: {driven} codes with voltage, all {} of the run as on the host, where at least {telling} of them are others for any other controller or limit",
        schedule.len(),
        written.len()
    ))
}

/// Code and enable of every tick, as this machine has them for `variant`.
fn drives(variant: Variant, orders: &[Command]) -> Result<Vec<(u16, bool)>> {
    let mut control = Control::new(&variant::settings(variant), &SUPERVISION, None)?;
    let sensors = Sensors { interlock_closed: true, ..Sensors::default() };
    let drive = |orders| control.tick(orders, &sensors, &mut Untimed).drive;
    Ok(orders.iter().map(drive).map(|drive| (drive.code().0, drive.enabled())).collect())
}

/// An error unless `reply` is the right answer to `request`.
fn expect(number: u16, request: &Request, reply: &Reply, variant: Variant) -> Result<()> {
    let target = |volts: f64| Reply::Ack { state: State::Armed, target: WireVolts::from_f64(volts) };
    let good = match (request, reply) {
        (Request::Hello, Reply::Status(status)) => {
            let Settings { amplifier, .. } = variant::settings(variant);
            let reach = [status.lowest, status.highest] == [amplifier.min_v, amplifier.max_v].map(WireVolts::from_f64);
            status.sample.state == State::Disarmed
                && status.firmware.controller == variant::controller(variant)
                && reach
        }
        (Request::Arm, reply) => *reply == target(0.0),
        (Request::Set(Desired::ScaledVolts(volts)), reply) => *reply == target(*volts),
        (Request::Heartbeat, reply) => *reply == target(TARGETS_V[usize::from(number > 6)]),
        _ => false,
    };
    ensure!(good, "not as expected");
    Ok(())
}

/// Time, code and enable of every tick. The enable is switched off before the code is written, and on after it.
fn written(ticking: &Events) -> Result<Vec<(f64, u16, bool)>> {
    let mut written: Vec<(f64, u16, bool)> = Vec::new();
    let mut enabled = false;
    for Event(us, what, value) in &ticking.0 {
        match what.as_str() {
            "dac" => written.push((*us, u16::try_from(value.as_u64().context("a code")?)?, enabled)),
            "enable" => {
                enabled = value == "on";
                if let (true, Some(last)) = (enabled, written.last_mut()) {
                    last.2 = true;
                }
            }
            _ => {}
        }
    }
    Ok(written)
}

/// The time at which each answer began to leave, in us, its sequence number and its content.
pub(super) fn answers(ticking: &Events) -> Result<Vec<(f64, Sequence, Reply)>> {
    let mut receiver = Receiver::new();
    let mut answers = Vec::new();
    let mut begin = None;
    for Event(us, _, value) in ticking.0.iter().filter(|event| event.1 == "sent") {
        let byte = u8::try_from(value.as_u64().context("a byte")?)?;
        let begun = *begin.get_or_insert(us - BYTE_US);
        if let Some(packet) = receiver.on_byte(byte) {
            let reply = Packet::read::<Reply>(&packet).map_err(|error| anyhow::anyhow!("{error:?}"))?;
            answers.push((begun, packet.sequence, reply));
            begin = None;
        }
    }
    ensure!(receiver.damaged() == 0, "the MCU sends damaged frames");
    Ok(answers)
}
