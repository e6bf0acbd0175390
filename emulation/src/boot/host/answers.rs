//! What the chip answers to the requests of a schedule.

use anyhow::{Context, Result, ensure};
use link::{Desired, Packet, Receiver, Reply, Request, Sequence, State, Status, WireVolts};
use model::Settings;
use xtask::variant::Variant;

use crate::boot::events::{BYTE_US, Event, Events};
use crate::boot::schedule::Schedule;
use crate::variant;

/// The time at which an answer began to leave, in us, its sequence number and its content.
pub(super) type Answer = (f64, Sequence, Reply);

/// Everything that the chip sends.
pub(in crate::boot) fn answers(ticking: &Events) -> Result<Vec<Answer>> {
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

/// Whether a status is that of a chip that has just started.
pub(super) fn greets(status: &Status, variant: Variant) -> bool {
    let Settings { amplifier, .. } = variant::settings(variant);
    let reach = [status.lowest, status.highest] == [amplifier.min_v, amplifier.max_v].map(WireVolts::from_f64);
    status.sample.state == State::Disarmed && status.firmware.controller == variant::controller(variant) && reach
}

/// An error unless each request from the one with number `from` on has the right answer: those that arm, set and keep alive as they say,
/// the others as `is_right` says.
pub(super) fn expect(
    schedule: &Schedule,
    from: usize,
    answers: &[Answer],
    is_right: impl Fn(&Request, &Reply) -> bool,
) -> Result<()> {
    let requests = &schedule.0[from..];
    ensure!(answers.len() == requests.len(), "{} answers to {} requests", answers.len(), requests.len());
    let mut target = WireVolts::from_f64(0.0);
    for ((number, (_, request)), (_, sequence, reply)) in (from..).zip(requests).zip(answers) {
        ensure!(usize::from(sequence.0) == number, "answer {} to request {number}", sequence.0);
        if let Request::Set(Desired::ScaledVolts(volts)) = request {
            target = WireVolts::from_f64(*volts);
        }
        let right = match (request, reply) {
            (Request::Arm | Request::Set(_) | Request::Heartbeat, reply) => {
                *reply == Reply::Ack { state: State::Armed, target }
            }
            (Request::Status, Reply::Status(status)) => {
                (status.sample.state, status.sample.target, status.overruns) == (State::Armed, target, 0)
            }
            _ => is_right(request, reply),
        };
        ensure!(right, "{request:?} is answered with {reply:?}");
    }
    Ok(())
}
