//! The very image that is flashed to the STM32G474, on models of the chip's registers: see `xtask/image/`.
//!
//! What happened is judged by what left the chip (DAC's register, enable's wire, log), not by what the log says of it.

mod host;

use std::fs;

use anyhow::{Context, Result, bail, ensure};
use firmware::settings::SUPERVISION;
use host_sim::log::Formats;
use model::{Amplifier, Settings};
use serde::Deserialize;

use crate::image::{self, Board, Opt};
use crate::variant::Variant;
use crate::{audit, elf, emulator, python, shell, size};

/// Between two ticks, in us.
const PERIOD_US: f64 = 1000.0;
/// Between the earliest and the latest on the grid, in us: a logger holds interrupts off for a moment.
const JITTER_US: f64 = 20.0;
/// Of the watchdog, in us.
const WATCHDOG_US: f64 = 100_000.0;
/// That the amplifier's monitors may disagree for, with the tick that finds it, in us.
const MONITOR_US: f64 = 1e6 * SUPERVISION.monitor_time_s + PERIOD_US;
/// From a panic or fault to zero volts, in us; one instruction is 1/170.
const KILL_US: f64 = 5.0;

const CANNOT_SHOW: &str = "\
not shown: real time (an instruction is one cycle here; no wait states, no conversion times), analogue behaviour (DAC, monitors,
  the amplifier's pull-down), the memory protection unit, silicon errata, a chip that differs from its manual";

/// Something that happened outside of the core.
#[derive(Clone, Debug, PartialEq, Deserialize)]
struct Event(f64, String, serde_json::Value);

impl Event {
    /// Lets voltage out.
    fn drives(&self) -> bool {
        let Self(_, what, value) = self;
        (what == "dac" && value != 0) || value == "on"
    }
}

/// The events of one run.
#[derive(Clone, Debug, Deserialize)]
struct Events(Vec<Event>);

impl Events {
    fn times(&self, what: &str) -> Vec<f64> {
        self.0.iter().filter(|event| event.1 == what).map(|event| event.0).collect()
    }

    /// The parts before and from the first `what` on.
    fn split(&self, what: &str) -> Result<(Self, Self)> {
        let at = self.0.iter().position(|event| event.1 == what).with_context(|| format!("no {what}"))?;
        Ok((Self(self.0[..at].to_vec()), Self(self.0[at..].to_vec())))
    }

    /// Nothing but zero on the DAC, never enabled.
    fn safe(&self) -> Result<()> {
        match self.0.iter().find(|event| event.drives()) {
            Some(Event(us, what, value)) => bail!("{what} {value} at {us:.2} us"),
            None => Ok(()),
        }
    }

    fn log(&self, image: &[u8]) -> Result<Vec<String>> {
        let mut bytes = Vec::new();
        for Event(_, _, value) in self.0.iter().filter(|event| event.1 == "log") {
            let hex = value.as_str().context("a log that is no text")?;
            for at in (0..hex.len()).step_by(2) {
                bytes.push(u8::from_str_radix(hex.get(at..at + 2).context("half a byte")?, 16)?);
            }
        }
        let lines = emulator::decode(Formats::parse(image)?, &mut bytes.as_slice(), |_| {})?.whole()?;
        Ok(lines.into_iter().map(|line| line.message).collect())
    }
}

/// `cargo xtask boot`.
pub(crate) fn run(variant: Variant) -> Result<()> {
    let Settings { amplifier, .. } = variant.settings();
    println!("image of the {} controller, {} to {} V", variant.leader().name(), amplifier.min_v, amplifier.max_v);
    let elf = image::build_with(&variant.features(), Board::Nucleo, Opt::S)?;
    let bytes = image::read(&elf)?;
    let flash = elf::flash(&bytes)?;
    ensure!(flash.address == 0x0800_0000, "the image begins at {:#x}", flash.address);
    let size = size::measure(variant, &[], Board::Nucleo)?;
    size.check()?;
    println!(
        "size: {size}; no way into a panic from the control tick ({} functions), no float in it, no heap",
        audit::run(&bytes)?
    );
    let bin = elf.with_extension("boot.bin");
    fs::write(&bin, &flash.bytes).with_context(|| format!("cannot write {}", bin.display()))?;

    let functions = elf::functions(&bytes)?;
    let ticks = audit::ticks(&functions)?;
    ensure!(ticks.len() == 1, "{} control ticks in the image", ticks.len());
    let panic = functions.iter().find(|f| f.name == "core::panicking::panic").context("no `panic` in the image")?;
    let rtt = elf::symbol(&bytes, "_SEGGER_RTT")?;
    let python = python::with(&image::target_directory()?, "image")?;
    let output = shell::json(
        shell::command(python)
            .args(["-B", "xtask/image/boot.py"])
            .arg(&bin)
            .args([ticks[0].address, panic.address, rtt].map(|address| format!("{address:#x}")))
            .arg(amplifier.full_scale_v.to_string())
            .arg(host::frames().to_string()),
    )?;
    let events = |name: &str| Events::deserialize(&output[name]).with_context(|| format!("no run `{name}`"));

    println!("{}", quiet(&events("quiet")?, &bytes, variant).context("without a mishap")?);
    println!("host: {}", host::check(&events("host")?, variant).context("with a host")?);
    let hang_us = f64::from(firmware::LONGEST_HANG_MS) * 1e3;
    for (name, within_us, log) in [
        ("panic", KILL_US, "panic at injected.rs:7"),
        ("hard fault", KILL_US, "name=hard-fault"),
        ("two wrong bits", KILL_US, "name=hard-fault"),
        ("hang", hang_us + KILL_US, "name=watchdog"),
    ] {
        println!("{name}: {}", stopped(&events(name)?, &bytes, within_us, log).context(name)?);
    }
    for (name, within_us, fault) in [
        ("interlock", PERIOD_US + JITTER_US, "name=interlock"),
        ("no voltage", MONITOR_US + JITTER_US, "name=monitor"),
        ("current", MONITOR_US + JITTER_US, "name=monitor"),
        ("other amplifier", MONITOR_US + JITTER_US, "name=monitor"),
    ] {
        // One of less than the image's leads nobody into danger.
        if output[name].is_null() {
            continue;
        }
        println!("{name}: {}", faulted(&events(name)?, &bytes, within_us, fault).context(name)?);
    }
    println!("torn store: {}", torn(&events("torn")?, &bytes).context("torn")?);
    for (name, cause) in [("dip", "reset=brown-out last_fault=8"), ("button", "reset=pin last_fault=4")] {
        println!("{name}: {}", cut(&events(name)?, &bytes, cause).context(name)?);
    }
    println!("hang with interrupts off: {}", deaf(&events("deaf")?, &bytes).context("deaf")?);
    println!("{CANNOT_SHOW}");
    Ok(())
}

/// Boots, stays safe without a host, keeps its pace and feeds the watchdog.
fn quiet(events: &Events, image: &[u8], variant: Variant) -> Result<String> {
    events.safe()?;
    let log = events.log(image)?;
    let said = format!("controller={}", variant.leader().name());
    for part in ["reset=power-on last_fault=0", &said] {
        ensure!(log.first().is_some_and(|line| line.contains(part)), "no `{part}` where the log begins, {log:?}");
    }
    // The report's goes without saying.
    let limit_v = log.iter().find_map(|line| line.strip_prefix("amplifier limit_v=")?.parse().ok());
    let limit_v: f64 = limit_v.unwrap_or(Amplifier::PAPER.max_v);
    ensure!(limit_v == variant.settings().amplifier.max_v, "an amplifier of {limit_v} V, says the log, {log:?}");
    ensure!(log.iter().any(|line| line.contains("summary tick=1000 overruns=0")), "no summary in {log:?}");
    ensure!(events.times("reset").len() == 1, "it was reset");
    // Start-up writes zero once; the first tick's place depends on it.
    let (setup, ticking) = events.split("watchdog started")?;
    let ticks = ticking.times("dac");
    ensure!(ticks.len() > 1190, "{} ticks in 1.2 s", ticks.len());
    // Ticks neither drift nor fail: each keeps its place on the grid.
    let late: Vec<f64> =
        ticks.iter().zip(0u32..).map(|(us, tick)| us - ticks[0] - f64::from(tick) * PERIOD_US).collect();
    let jitter = late.iter().copied().fold(0.0, f64::max) - late.iter().copied().fold(0.0, f64::min);
    ensure!(jitter < JITTER_US, "writes to the DAC are up to {jitter:.2} us off their grid of {PERIOD_US} us");
    ensure!(setup.0.iter().any(|Event(_, what, value)| what == "enable" && value == "off"), "the enable floats");
    let outputs: Vec<&Event> = setup.0.iter().filter(|event| event.1 == "output").collect();
    ensure!(outputs.last().is_some_and(|event| event.2 == "unbuffered"), "a buffer holds zero off zero: {outputs:?}");
    let fed = events.times("fed");
    ensure!(fed.len() > 10, "the watchdog is not fed");
    let longest = fed.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    ensure!(longest < WATCHDOG_US / 2.0, "{longest:.0} us without food for the watchdog");
    Ok(format!(
        "boot: {} ticks, DAC zero and enable off throughout, written every 1000 us, {jitter:.2} us of jitter; \
         watchdog of {:.0} ms started, fed at least every {:.1} ms",
        ticks.len(),
        WATCHDOG_US / 1e3,
        longest / 1e3
    ))
}

/// Zero and off in time, and before the first byte of log; then a reset that knows why, and stays safe.
fn stopped(events: &Events, image: &[u8], within_us: f64, line: &str) -> Result<String> {
    let (_, after) = mishap(events)?;
    let (dying, reborn) = after.split("reset")?;
    let (silent, _) = dying.split("log")?;
    let gone = gone(&silent)?;
    ensure!(gone <= within_us, "the voltage goes after {gone:.2} us");
    let log = dying.log(image)?;
    ensure!(log.iter().any(|said| said.contains(line)), "no `{line}` in {log:?}");
    let boot = reborn_safe(&reborn, image, "reset=software")?;
    let gone = if gone < 1e3 { format!("{gone:.2} us") } else { format!("{:.1} ms", gone / 1e3) };
    Ok(format!("DAC zero and enable off {gone} later, before anything is logged; `{boot}`"))
}

/// The supervisor takes the voltage away in time, and goes on without it whatever the host sends.
fn faulted(events: &Events, image: &[u8], within_us: f64, fault: &str) -> Result<String> {
    let (_, after) = mishap(events)?;
    let last = after.0.iter().rposition(Event::drives).context("the voltage had gone before")?;
    let without = Events(after.0[last + 1..].to_vec());
    let us = gone(&without)? + without.0[0].0 - after.0[0].0;
    ensure!(us <= within_us, "the voltage goes after {us:.0} us");
    ensure!(without.times("dac").len() > 50 && without.times("reset").is_empty(), "it does not go on");
    let log = after.log(image)?;
    let line = log.iter().find(|line| line.contains(fault)).with_context(|| format!("no `{fault}` in {log:?}"))?;
    Ok(format!("DAC zero and enable off {:.1} ms later; `{line}`", us / 1e3))
}

/// Words of the store that a power cut tore are read and forgiven.
fn torn(events: &Events, image: &[u8]) -> Result<String> {
    let boot = reborn_safe(events, image, "reset=power-on last_fault=0")?;
    Ok(format!("words with two wrong bits are forgiven there alone; `{boot}`"))
}

/// A reset from outside takes no fault away: a dip of the supply is one, and one that was there is still to be acknowledged.
fn cut(events: &Events, image: &[u8], cause: &str) -> Result<String> {
    let (_, after) = mishap(events)?;
    let (_, reborn) = after.split("reset")?;
    Ok(format!("no voltage until it is acknowledged; `{}`", reborn_safe(&reborn, image, cause)?))
}

/// Only the watchdog ends it.
fn deaf(events: &Events, image: &[u8]) -> Result<String> {
    let (_, after) = mishap(events)?;
    let (_, reborn) = after.split("reset")?;
    let us = reborn.0[0].0 - after.0[0].0;
    ensure!(us <= WATCHDOG_US, "the watchdog waits for {us:.0} us");
    let boot = reborn_safe(&reborn, image, "reset=watchdog")?;
    Ok(format!("the voltage stays until the watchdog resets the chip {:.0} ms later; `{boot}`", us / 1e3))
}

/// Before and from the mishap on; before it voltage was put out.
fn mishap(events: &Events) -> Result<(Events, Events)> {
    let (before, after) = events.split("mishap")?;
    ensure!(before.safe().is_err(), "no voltage before the mishap, so that it shows nothing");
    Ok((before, after))
}

/// When both zero and off were there, in us after the first event.
fn gone(events: &Events) -> Result<f64> {
    events.safe()?;
    let when = |what: &str, is: serde_json::Value| {
        let event = events.0.iter().find(|Event(_, name, value)| name == what && *value == is);
        event.map(|event| event.0).with_context(|| format!("no {what} {is} before the log"))
    };
    Ok(when("dac", 0.into())?.max(when("enable", "off".into())?) - events.0[0].0)
}

/// Safe for at least 50 ticks; returns the boot line from the cause on.
fn reborn_safe(events: &Events, image: &[u8], cause: &str) -> Result<String> {
    events.safe()?;
    ensure!(events.times("reset").len() == 1, "it is reset again");
    ensure!(events.times("dac").len() > 50, "it does not tick again");
    let log = events.log(image)?;
    let line = log.iter().find_map(|line| line.find(cause).map(|at| line[at..].to_owned()));
    line.with_context(|| format!("no `{cause}` in {log:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn events(list: &[(&str, serde_json::Value)]) -> Events {
        Events(
            list.iter()
                .zip(0u32..)
                .map(|((what, value), us)| Event(us.into(), (*what).into(), value.clone()))
                .collect(),
        )
    }

    #[test]
    fn a_log_before_zero_is_found() {
        let dying = |list: &[(&str, serde_json::Value)]| gone(&events(list).split("log").unwrap().0);
        let (mishap, log) = (("mishap", 300.into()), ("log", "00".into()));
        let (zero, off) = (("dac", 0.into()), ("enable", "off".into()));
        assert_eq!(dying(&[mishap.clone(), off.clone(), zero.clone(), log.clone()]).unwrap(), 2.0);
        assert!(dying(&[mishap.clone(), off.clone(), log.clone(), zero.clone()]).is_err());
        assert!(dying(&[mishap.clone(), zero.clone(), log.clone(), off.clone()]).is_err());
        assert!(dying(&[mishap, ("dac", 1755.into()), off, zero, log]).is_err());
    }
}
