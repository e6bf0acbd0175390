//! The line is flooded, or ticks are late.

use anyhow::{Context, Result, ensure};
use link::{Fault, Reply};
use xtask::variant::Variant;

use super::answers::answers;
use super::codes::{control, drives, equal, orders, written};
use crate::boot::events::{Events, JITTER_US, PERIOD_US, jitter};
use crate::boot::schedule::{self, EVERY_TICKS};

/// A run in which valid frames fill the line from the host, until the interlock opens: every tick comes in time and writes the host's code,
/// and telemetry goes on.
pub(in crate::boot) fn flood(events: &Events, variant: Variant) -> Result<String> {
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

/// A run in which one tick takes so long that the five that are tolerated are missed: they are counted, the voltage stays, and the grid too.
pub(in crate::boot) fn late(events: &Events, missed: u32) -> Result<String> {
    let (_, ticking) = events.split("watchdog started")?;
    let (before, after) = events.split("injected")?;
    let dac: Vec<f64> = before.times("dac").into_iter().rev().take(1).chain(after.times("dac")).collect();
    let longest = dac.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let missed_us = f64::from(missed) * PERIOD_US;
    ensure!((missed_us..missed_us + 3.0 * PERIOD_US).contains(&longest), "the longest pause was {longest:.0} us");
    // But for the late tick and the one that follows it immediately.
    let off_grid = |us: &f64| (us - dac[0] - ((us - dac[0]) / PERIOD_US).round() * PERIOD_US).abs();
    let shifted = dac.iter().skip(3).map(off_grid).fold(0.0, f64::max);
    ensure!(dac.len() > 50 && shifted < JITTER_US, "{} ticks, then up to {shifted:.2} us off their grid", dac.len());
    ensure!(after.0.iter().filter(|event| event.1 == "dac").all(|event| event.2 != 0), "the voltage does not stay");
    ensure!(!after.0.iter().any(|event| event.2 == "off") && after.times("reset").is_empty(), "it is switched off");
    let last = answers(&ticking)?.into_iter().rev().find_map(|(.., reply)| match reply {
        Reply::Status(status) => Some((status.overruns, status.fault)),
        _ => None,
    });
    ensure!(last == Some((missed, Fault::NONE)), "{last:?} instead of {missed} missed ticks and no fault");
    Ok(format!(
        "{missed} missed ticks are counted in the status and tolerated, the longest pause was {:.1} ms, and the next ticks are at most \
         {shifted:.2} us off the grid before",
        longest / 1e3
    ))
}
