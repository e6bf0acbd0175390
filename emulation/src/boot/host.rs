//! The runs with a host at the serial line: the codes and answers that must follow from what it sends.
//!
//! The time of an answer shows which tick followed a request: the answer leaves right after that tick. From there on
//! the code on the host predicts every DAC code.

use anyhow::{Context, Result, bail, ensure};
use firmware::control::{Control, Sensors, Untimed};
use firmware::settings::{SUPERVISION, WATCHDOG_MS};
use link::{
    BlockId, Blocks, BrownOut, Command, Desired, Fault, Packet, Reason, Receiver, Reply, Request, Sequence, State,
    Status, WireVolts,
};
use model::{Settings, Volts, supervisor};
use xtask::variant::Variant;

use super::events::{BYTE_US, Event, Events, JITTER_US, PERIOD_US, jitter};
use super::schedule::{self, EVERY_TICKS, STORED_RESET_MS, Schedule, TARGETS_V};
use crate::variant;

/// The time at which an answer began to leave, in us, its sequence number and its content.
type Answer = (f64, Sequence, Reply);
/// Time in us, code and enable of a tick.
type Written = (f64, u16, bool);

/// An error unless every answer is the expected one and every DAC code is the host's for `variant`. Returns a line for
/// the report.
pub(super) fn check(events: &Events, variant: Variant) -> Result<String> {
    let (_, ticking) = events.split("watchdog started")?;
    let written = written(&ticking)?;
    let schedule = schedule::armed();
    let answers = answers(&ticking)?;
    expect(&schedule, 0, &answers, |request, reply| match (request, reply) {
        (Request::Hello, Reply::Status(status)) => greets(status, variant),
        _ => false,
    })?;
    let orders = orders(&schedule, &answers, &written)?;
    let on_host = drives(control(variant)?, &orders);
    equal(&on_host, &written)?;
    let driven = driven(&on_host);
    ensure!(driven > 1000, "{driven} ticks with voltage show little");
    // Codes at the limit, or the same in every image, would not distinguish this image.
    let highest = (1u16 << variant::settings(variant).amplifier.dac_bits) - 1;
    let inside = on_host.iter().filter(|(code, enabled)| *enabled && (1..highest).contains(code)).count();
    ensure!(inside > 500, "{inside} codes inside of the range show little");
    let mut telling = usize::MAX;
    for other in variant.others() {
        let differ = differ(&drives(control(other)?, &orders), &on_host);
        ensure!(differ > 500, "only {differ} codes would be others in another image");
        telling = telling.min(differ);
    }
    ensure!(written.last().is_some_and(|(_, code, enabled)| *code == 0 && !enabled), "silence does not disarm");
    let [first, second] = TARGETS_V;
    Ok(format!(
        "{} requests over LPUART1 armed it, set {first} V and {second} V and fell silent, past a debugger that reads the log \
         no more: {driven} codes with voltage, all {} of the run as on the host, where at least {telling} of them are others for any other \
         controller or limit",
        schedule.0.len(),
        written.len()
    ))
}

/// A run in which a host stores settings and an extended model with the image's own flash driver and restarts the chip: both run, and
/// every DAC code is the host's for that model.
pub(super) fn sent(events: &Events, variant: Variant) -> Result<String> {
    let starts = events.starts();
    let [before, after] = starts.as_slice() else { bail!("{} starts, 2 expected", starts.len()) };
    let (_, storing) = before.split("watchdog started")?;
    let (erased, programmed) = (storing.times("erased").len(), storing.times("programmed").len());
    let (settings, model) = (schedule::settings(variant)?, schedule::model()?);
    let words = schedule::words(&settings) + schedule::words(&model);
    // One for the first part of each block, and its other page once the block is sealed, since nothing was stored.
    ensure!(
        (erased, programmed) == (4, words),
        "{erased} pages erased, {programmed} words programmed, 4 and {words} expected"
    );
    // The restart writes a zero of its own.
    let stored_us = storing.times("programmed").last().copied().unwrap_or(0.0);
    let ticks: Vec<f64> = storing.times("dac").into_iter().take_while(|us| *us < stored_us).collect();
    let late = jitter(&ticks);
    ensure!(late < JITTER_US, "ticks are up to {late:.2} us off their grid of {PERIOD_US} us while pages are erased");
    ensure!(ticks.last().is_some_and(|us| stored_us - us < 2.0 * PERIOD_US), "no tick at {stored_us:.0} us");

    let schedule = schedule::sent(variant)?;
    let restart = schedule.0.iter().position(|(_, request)| *request == Request::Restart).context("no restart")? + 1;
    let disarmed = Reply::Ack { state: State::Disarmed, target: WireVolts::from_f64(0.0) };
    let answers_before = answers(&storing)?;
    ensure!(answers_before.len() == restart, "{} answers to {restart} requests", answers_before.len());
    let other = answers_before.iter().skip(1).find(|(.., reply)| *reply != disarmed);
    ensure!(other.is_none(), "answered with {other:?}");

    let (_, ticking) = after.split("watchdog started")?;
    let (written, answers) = (written(&ticking)?, answers(&ticking)?);
    let runs = |payload: &[u8]| {
        let id = BlockId::of(1, payload);
        Blocks { active: id, stored: id }
    };
    expect(&schedule, restart, &answers, |request, reply| match (request, reply) {
        (Request::Hello, Reply::Status(status)) => greets(status, variant),
        (Request::Settings, Reply::Settings(blocks)) => *blocks == runs(&settings),
        (Request::Model, Reply::Model(blocks)) => *blocks == runs(&model),
        (Request::BrownOut, Reply::BrownOut(level)) => *level == Some(BrownOut { level: 4, expected: 4 }),
        _ => false,
    })?;
    let fed = after.0.iter().filter(|event| event.1 == "fed").map(|event| event.2.as_u64());
    let expected_us = u64::from(STORED_RESET_MS) * 1000;
    ensure!(fed.clone().count() > 10 && fed.clone().all(|us| us == Some(expected_us)), "the watchdog has another time");

    let orders = orders(&schedule, &answers, &written)?;
    let mut extended = control(variant)?;
    extended.use_model(&variant::settings(variant), &schedule::extended()?)?;
    let on_host = drives(extended, &orders);
    equal(&on_host, &written)?;
    let driven = driven(&on_host);
    let telling = differ(&drives(control(variant)?, &orders), &on_host);
    ensure!(driven > 500 && telling > 500, "{driven} codes with voltage, {telling} others with the built-in spring");
    Ok(format!(
        "settings and a model with hysteresis, static law and two relaxations, {} and {} bytes in {programmed} words, no tick more than \
         {late:.2} us off its grid meanwhile; after the restart both run, a watchdog of {STORED_RESET_MS} ms instead of {WATCHDOG_MS} ms, \
         {driven} codes with voltage, all {} as on the host, {telling} of them others with the built-in spring",
        settings.len(),
        model.len(),
        written.len()
    ))
}

/// A run in which the chip is reset in the middle of operations of the flash, in those of `cuts`, while a model is stored beside another:
/// the old one runs, or nothing can be armed, and the next transfer is stored.
pub(super) fn cut(events: &Events, cuts: &[usize]) -> Result<String> {
    ensure!(!events.0.iter().any(|event| event.1 == "dac" && event.2 != 0), "a voltage without a target");
    let starts = events.starts();
    ensure!(starts.len() == cuts.len() + 2, "{} starts after {} cuts and a restart", starts.len(), cuts.len());
    ensure!(events.times("cut").len() == cuts.len(), "not every operation is cut");
    let (old, new) = (schedule::old_model()?, schedule::model()?);
    let seal = schedule::operations()? - 1;
    let mut config = 0;
    let mut last = None;
    for (start, events) in starts.iter().enumerate() {
        let answers = answers(&events.split("watchdog started")?.1)?;
        let status =
            answers.iter().find_map(|(.., reply)| if let Reply::Status(status) = reply { Some(status) } else { None });
        let fault = status.with_context(|| format!("no status after start {start}"))?.fault;
        let model =
            answers.iter().find_map(|(.., reply)| if let Reply::Model(model) = reply { Some(model) } else { None });
        let active = model.with_context(|| format!("no model after start {start}"))?.active;
        let runs = if start <= cuts.len() { &old } else { &new };
        ensure!((active.length, active.checksum) == frame_of(runs), "{active:?} runs after start {start}");
        // In its last word it cannot be known what was stored, and nothing is armed until a model is.
        let expected = if fault == Fault::NONE {
            Reply::Ack { state: State::Armed, target: WireVolts::from_f64(0.0) }
        } else {
            let after_seal = start > 0 && cuts[..start.min(cuts.len())].contains(&seal);
            ensure!(after_seal && fault == Fault::from(supervisor::Fault::Config), "{fault} after start {start}");
            events.safe()?;
            config += 1;
            Reply::Refused(Reason::Faulted(fault))
        };
        let is_armed = start > cuts.len() || answers.iter().any(|(.., reply)| *reply == expected);
        ensure!(is_armed, "arming is not answered with {expected:?} after start {start}: {answers:?}");
        last = Some(answers);
    }
    ensure!(config > 0 || !cuts.contains(&seal), "no fault where it cannot be known what was stored");
    let answers = last.context("no start")?;
    let acknowledged = Reply::Ack { state: State::Disarmed, target: WireVolts::from_f64(0.0) };
    let last = answers.iter().rfind(|(.., reply)| !matches!(reply, Reply::Fault(_)));
    ensure!(last.is_some_and(|(.., reply)| *reply == acknowledged), "the fault stays: {answers:?}");
    Ok(format!(
        "reset in the middle of {} of the {} operations of the flash that store a model: the old one ran each time, arming was refused \
         where it could not be known what was stored ({config} starts), and the next model was stored; DAC zero throughout",
        cuts.len(),
        seal + 1
    ))
}

/// Length and checksum of a payload.
fn frame_of(payload: &[u8]) -> (u16, u32) {
    let id = BlockId::of(0, payload);
    (id.length, id.checksum)
}

/// A run in which the page for a new model is write-protected: the host hears that it was not stored, and what was stored before runs.
pub(super) fn protected(events: &Events) -> Result<String> {
    let (_, ticking) = events.split("watchdog started")?;
    ensure!(ticking.times("erased").is_empty() && ticking.times("programmed").is_empty(), "the page was changed");
    let old = BlockId::of(1, &schedule::old_model()?);
    let answers: Vec<Reply> = answers(&ticking)?.into_iter().skip(1).map(|(.., reply)| reply).collect();
    let armed = Reply::Ack { state: State::Armed, target: WireVolts::from_f64(0.0) };
    let expected = [Reply::Refused(Reason::NotStored), Reply::Model(Blocks { active: old, stored: old }), armed];
    ensure!(answers == expected, "answered with {answers:?}");
    Ok(format!("`{}`; the model before stays and can be armed", Reason::NotStored))
}

/// A run in which valid frames fill the line from the host, until the interlock opens: every tick comes in time and writes the host's code,
/// and telemetry goes on.
pub(super) fn flood(events: &Events, variant: Variant) -> Result<String> {
    let (before, _) = events.split("injected")?;
    let (_, ticking) = before.split("watchdog started")?;
    let (written, schedule) = (written(&ticking)?, schedule::flood());
    let late = jitter(&ticking.times("dac"));
    ensure!(late < JITTER_US, "ticks are up to {late:.2} us off their grid of {PERIOD_US} us");
    let mut answers = answers(&ticking)?;
    let begun = f64::from(schedule.0.last().context("no frame")?.0);
    let samples: Vec<u64> = answers
        .iter()
        .filter_map(
            |(us, _, reply)| {
                if let Reply::Telemetry(sample) = reply { (*us > begun).then_some(sample.tick) } else { None }
            },
        )
        .collect();
    let longest = samples.windows(2).map(|pair| pair[1] - pair[0]).max().context("no telemetry")?;
    let ticks = ticking.times("dac").into_iter().filter(|us| *us > begun).count();
    ensure!(longest <= MOST_TICKS, "{longest} ticks without telemetry");
    ensure!(samples.len() * MOST_TICKS as usize >= ticks, "{} samples in {ticks} ticks", samples.len());
    answers.retain(|(.., reply)| !matches!(reply, Reply::Telemetry(_)));
    let flooded = answers.iter().filter(|(us, ..)| *us > begun).count();
    ensure!(flooded > 30, "{flooded} answers show little");
    let missed = answers
        .iter()
        .filter_map(|(.., reply)| if let Reply::Status(it) = reply { Some(it.overruns) } else { None })
        .max();
    ensure!(missed == Some(0), "{missed:?} missed ticks");
    let on_host = drives(control(variant)?, &orders(&schedule, &answers, &written)?);
    equal(&on_host, &written)?;
    Ok(format!(
        "{flooded} answers and {} samples, at least every {longest} ticks for {EVERY_TICKS}, no tick missed or more than {late:.2} us off \
         its grid, \
         all {} codes as on the host",
        samples.len(),
        written.len()
    ))
}

/// Most ticks between two samples in the flood: the longest answers are on the line meanwhile.
const MOST_TICKS: u64 = 3 * EVERY_TICKS as u64;

/// A run in which one tick takes longer than the five that are tolerated: they are counted, and the voltage stays.
pub(super) fn late(events: &Events, missed: u32) -> Result<String> {
    let (_, ticking) = events.split("watchdog started")?;
    let (before, after) = events.split("injected")?;
    let dac: Vec<f64> = before.times("dac").into_iter().rev().take(1).chain(after.times("dac")).collect();
    let longest = dac.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let missed_us = f64::from(missed) * PERIOD_US;
    ensure!((missed_us..missed_us + 3.0 * PERIOD_US).contains(&longest), "the longest pause was {longest:.0} us");
    ensure!(after.0.iter().filter(|event| event.1 == "dac").all(|event| event.2 != 0), "the voltage does not stay");
    ensure!(!after.0.iter().any(|event| event.2 == "off") && after.times("reset").is_empty(), "it is switched off");
    let last = answers(&ticking)?.into_iter().rev().find_map(|(.., reply)| match reply {
        Reply::Status(status) => Some((status.overruns, status.fault)),
        _ => None,
    });
    ensure!(last == Some((missed, Fault::NONE)), "{last:?} instead of {missed} missed ticks and no fault");
    Ok(format!(
        "{missed} missed ticks are counted in the status and tolerated, the longest pause was {:.1} ms",
        longest / 1e3
    ))
}

/// An error unless the orders' codes of the host are those that were `written`.
fn equal(on_host: &[(u16, bool)], written: &[Written]) -> Result<()> {
    for (tick, ((code, enabled), (us, host_code, host_enabled))) in on_host.iter().zip(written).enumerate() {
        if (*code, *enabled) != (*host_code, *host_enabled) {
            bail!(
                "tick {tick} at {us:.0} us writes {host_code}, enabled {host_enabled}; on the host it is {code}, {enabled}"
            );
        }
    }
    Ok(())
}

/// Number of ticks with voltage.
fn driven(drives: &[(u16, bool)]) -> usize {
    drives.iter().filter(|(code, enabled)| *enabled && *code > 0).count()
}

/// Number of ticks in which two runs differ.
fn differ(one: &[(u16, bool)], other: &[(u16, bool)]) -> usize {
    one.iter().zip(other).filter(|(one, other)| one != other).count()
}

/// What each tick was ordered by the requests of `schedule` that are answered.
fn orders(schedule: &Schedule, answers: &[Answer], written: &[Written]) -> Result<Vec<Command>> {
    let mut orders = vec![Command::default(); written.len()];
    for (us, sequence, _) in answers {
        let (_, request) = schedule.0.get(usize::from(sequence.0)).context("an answer to no request")?;
        // The last answers may leave after the last tick of the run.
        let Some(next) = written.iter().position(|(at, ..)| at > us) else { continue };
        let tick = match request {
            // Followed before it is answered. All other requests are answered first, and the next tick processes them.
            Request::Arm | Request::Set(_) => next.checked_sub(1).context("an answer before the first tick")?,
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
    }
    Ok(orders)
}

/// The controller of `variant`.
fn control(variant: Variant) -> Result<Control> {
    Ok(Control::new(&variant::settings(variant), &SUPERVISION, None)?)
}

/// Code and enable of every tick, as this machine has them.
fn drives(mut control: Control, orders: &[Command]) -> Vec<(u16, bool)> {
    let sensors = Sensors { interlock_closed: true, ..Sensors::default() };
    let drive = |orders| control.tick(orders, &sensors, &mut Untimed).drive;
    orders.iter().map(drive).map(|drive| (drive.code().0, drive.enabled())).collect()
}

/// Whether a status is that of a chip that has just started.
fn greets(status: &Status, variant: Variant) -> bool {
    let Settings { amplifier, .. } = variant::settings(variant);
    let reach = [status.lowest, status.highest] == [amplifier.min_v, amplifier.max_v].map(WireVolts::from_f64);
    status.sample.state == State::Disarmed && status.firmware.controller == variant::controller(variant) && reach
}

/// An error unless each request from the one with number `from` on has the right answer: those that arm, set and keep alive as they say,
/// the others as `is_right` says.
fn expect(
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

/// Time, code and enable of every tick. The enable is switched off before the code is written, and on after it.
fn written(ticking: &Events) -> Result<Vec<Written>> {
    let mut written: Vec<Written> = Vec::new();
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

/// Everything that the chip sends.
pub(super) fn answers(ticking: &Events) -> Result<Vec<Answer>> {
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
