//! A host arms the image and sets targets.

use anyhow::{Result, ensure};
use link::{Reply, Request};
use xtask::variant::Variant;

use super::answers::{answers, expect, greets};
use super::codes::{control, differ, driven, drives, equal, inside, orders, written};
use crate::boot::events::Events;
use crate::boot::schedule::{self, TARGETS_V};

/// An error unless every answer is the expected one and every DAC code is the host's for `variant`. Returns a line for
/// the report.
pub(in crate::boot) fn check(events: &Events, variant: Variant) -> Result<String> {
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
    let inside = inside(&on_host, variant);
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
