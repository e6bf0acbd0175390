//! A host stores settings and models.

use anyhow::{Context, Result, bail, ensure};
use firmware::settings::WATCHDOG_MS;
use link::{Block, BlockId, Blocks, BrownOut, Fault, Reason, Reply, Request, State, WireVolts};
use model::supervisor;
use xtask::variant::Variant;

use super::answers::{answers, expect, greets};
use super::codes::{control, differ, driven, drives, equal, inside, orders, written};
use crate::boot::events::{Events, JITTER_US, PERIOD_US, jitter};
use crate::boot::schedule::{self, Replacement, STORED_RESET_MS};
use crate::variant;

/// A run in which a host stores settings and an extended model with the image's own flash driver and restarts the chip: both run, and
/// every DAC code is the host's for that model.
pub(in crate::boot) fn sent(events: &Events, variant: Variant) -> Result<String> {
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
    // The time-optimal controller is at an end of the range for more than half of the time.
    let inside = inside(&on_host, variant);
    ensure!(
        driven > 500 && inside > 250 && 10 * telling > 9 * inside,
        "{driven} codes with voltage, {inside} inside of the range, {telling} others with the built-in spring"
    );
    Ok(format!(
        "settings and a model with hysteresis, static law and two relaxations, {} and {} bytes in {programmed} words, no tick more than \
         {late:.2} us off its grid meanwhile; after the restart both run, a watchdog of {STORED_RESET_MS} ms instead of {WATCHDOG_MS} ms, \
         {driven} codes with voltage, all {} as on the host, {telling} of them others with the built-in spring",
        settings.len(),
        model.len(),
        written.len()
    ))
}

/// A run in which the chip is reset in the middle of operations of the flash, in those of `cuts`, while a block is stored beside another:
/// the old one runs, or nothing can be armed, and the next transfer is stored.
pub(in crate::boot) fn cut(events: &Events, stored: &Replacement, cuts: &[usize]) -> Result<String> {
    ensure!(!events.0.iter().any(|event| event.1 == "dac" && event.2 != 0), "a voltage without a target");
    let starts = events.starts();
    ensure!(starts.len() == cuts.len() + 2, "{} starts after {} cuts and a restart", starts.len(), cuts.len());
    ensure!(events.times("cut").len() == cuts.len(), "not every operation is cut");
    let seal = stored.operations() - 1;
    let mut config = 0;
    let mut last = None;
    for (start, events) in starts.iter().enumerate() {
        let answers = answers(&events.split("watchdog started")?.1)?;
        let mut replies = answers.iter().map(|(.., reply)| reply);
        let status =
            replies.clone().find_map(|reply| if let Reply::Status(status) = reply { Some(status) } else { None });
        let fault = status.with_context(|| format!("no status after start {start}"))?.fault;
        let blocks = replies.find_map(|reply| match (stored.block, reply) {
            (Block::Settings, Reply::Settings(blocks)) | (Block::Model, Reply::Model(blocks)) => Some(blocks),
            _ => None,
        });
        let active = blocks.with_context(|| format!("not said what runs after start {start}"))?.active;
        let runs = if start <= cuts.len() { &stored.old } else { &stored.new };
        ensure!((active.length, active.checksum) == frame_of(runs), "{active:?} runs after start {start}");
        // In its last word it cannot be known what was stored, and nothing is armed until another block is.
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
        "reset in the middle of {} of the {} operations of the flash that store it: what was stored before ran each time, arming was \
         refused where it could not be known what was stored ({config} starts), and the next transfer was stored; DAC zero throughout",
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
pub(in crate::boot) fn protected(events: &Events) -> Result<String> {
    let (_, ticking) = events.split("watchdog started")?;
    ensure!(ticking.times("erased").is_empty() && ticking.times("programmed").is_empty(), "the page was changed");
    let old = BlockId::of(1, &schedule::old_model()?);
    let answers: Vec<Reply> = answers(&ticking)?.into_iter().skip(1).map(|(.., reply)| reply).collect();
    let armed = Reply::Ack { state: State::Armed, target: WireVolts::from_f64(0.0) };
    let expected = [Reply::Refused(Reason::NotStored), Reply::Model(Blocks { active: old, stored: old }), armed];
    ensure!(answers == expected, "answered with {answers:?}");
    Ok(format!("`{}`; the model before stays and can be armed", Reason::NotStored))
}
