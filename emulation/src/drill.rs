//! `cargo xtask drill`: injects each fault under QEMU and compares the decoded log with the approved one.
//!
//! That the voltage goes away is checked on the DAC's wire, not in the log. The approved logs are in
//! `test-bench/drills/`; values that depend on the build (revision, line numbers, lateness, digest, counts) are replaced
//! by `_`.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use firmware::LONGEST_HANG_MS;
use firmware::settings::WATCHDOG_MS;
use host_sim::log::{Event, Line};
use test_bench::script::{ARM_TICK, FAULT_TICK, FaultInjection};

use xtask::build::{self, Board, Opt};
use xtask::tally::Tally;
use xtask::{setup, shell};

use crate::qemu::emulator::{self, Run, SAFE, Written};

/// Options of `cargo xtask drill`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Approve the logs as they are now
    #[arg(long)]
    bless: bool,
    /// Only the drill of this name
    #[arg(long, value_name = "DRILL", value_parser = FaultInjection::ALL.map(FaultInjection::name))]
    only: Vec<String>,
}

/// Builds the image and runs the drills that are asked for, all of them without a name.
pub(crate) fn run(args: &Args) -> Result<()> {
    setup::emulator()?;
    let elf = build::image(Board::Mps2, Opt::S)?;
    if args.only.is_empty() {
        return all(&elf, args.bless);
    }
    let asked = |fault: &FaultInjection| args.only.iter().any(|name| name == fault.name());
    FaultInjection::ALL.into_iter().filter(asked).try_for_each(|fault| named(&elf, fault, args.bless))
}

/// Runs every drill. An error names the first that fails.
pub(crate) fn all(elf: &Path, bless: bool) -> Result<()> {
    FaultInjection::ALL.into_iter().try_for_each(|fault| named(elf, fault, bless))?;
    let faults =
        ("faults injected under QEMU, the voltage gone each time".to_owned(), FaultInjection::ALL.len() as u64);
    Tally::now([faults])?.write("drill")
}

/// Runs one drill. Line and error name it.
fn named(elf: &Path, fault: FaultInjection, bless: bool) -> Result<()> {
    let name = fault.name();
    one(elf, fault, bless).with_context(|| format!("drill {name}"))?;
    eprintln!("drill {name}: voltage gone, log as approved");
    Ok(())
}

fn one(elf: &Path, fault: FaultInjection, bless: bool) -> Result<()> {
    let run = emulator::play(elf, fault.name(), emulator::SHIFT, |_| {})?;
    ensure!(
        run.exit == 0,
        "the emulator's exit code is {}, the last line {:?}",
        run.exit,
        run.log.last().map(emulator::text)
    );
    voltage_goes(fault, &run.dac)?;
    if let Some(limit_us) = patience_us(fault) {
        found_within(&run.log, limit_us)?;
    }
    let text = golden_text(fault, &run);
    let path = approved(fault);
    if bless {
        return fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()));
    }
    let before = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    if before != text {
        bail!("the log is not the approved one.\n--- {}\n{before}--- now\n{text}", path.display());
    }
    Ok(())
}

/// Most ticks from the injected fault until the output is zero and disabled for good.
fn grace(fault: FaultInjection) -> usize {
    match fault {
        // No further code.
        FaultInjection::Panic
        | FaultInjection::HardFault
        | FaultInjection::StackOverflow
        | FaultInjection::FloatOverflow => 0,
        FaultInjection::Interlock | FaultInjection::TwoFaults | FaultInjection::Unguarded => 0,
        // The tick that overruns still ends; the next one detects it.
        FaultInjection::Overrun => 1,
        // Nothing is written while the control task hangs; the next write is the zero after its detection.
        FaultInjection::Hang | FaultInjection::Deaf => 0,
        // The task watchdog detects the stalled task after 50 ms and its own period.
        FaultInjection::Stall => 65,
        // A time-out of 500 ms, then a ramp of 300 V at 700 V/s.
        FaultInjection::Silence => 500 + 430,
    }
}

/// Longest time that a task may hang before the fault, in us. The wire cannot show it, because nothing is written
/// meanwhile.
fn patience_us(fault: FaultInjection) -> Option<u64> {
    match fault {
        FaultInjection::Hang => Some(u64::from(LONGEST_HANG_MS) * 1000),
        // The hardware watchdog.
        FaultInjection::Deaf => Some(u64::from(WATCHDOG_MS) * 1000),
        _ => None,
    }
}

/// An error unless the fault is logged within `limit_us` after its injection, whose time is counted from the tick that
/// armed.
fn found_within(log: &[Line], limit_us: u64) -> Result<()> {
    let time = |is: fn(&Event) -> bool| log.iter().find(|line| is(&line.event)).and_then(|line| line.time_us);
    let armed = time(|event| matches!(event, Event::State { to, .. } if to == "armed")).context("never armed")?;
    let fault = time(|event| matches!(event, Event::Fault { .. })).context("no fault")?;
    let injected = armed + u64::from(FAULT_TICK - ARM_TICK) * 1000;
    let hung = fault.saturating_sub(injected);
    // A log line is written up to 1 ms after the event.
    ensure!(hung <= limit_us + 1000, "the control task hangs for {hung} us");
    Ok(())
}

/// An error unless the output is zero before arming, carries voltage until the fault, is zero after it, and carries
/// voltage again only in the drills that arm a second time. Without guards it is zero throughout.
fn voltage_goes(fault: FaultInjection, dac: &[Written]) -> Result<()> {
    let zero = |from: usize, to: usize| match dac[from..to].iter().position(|written| *written != SAFE) {
        None => Ok(()),
        Some(index) => bail!("write {} is {:?} instead of zero", from + index, dac[from + index]),
    };
    if fault == FaultInjection::Unguarded {
        // The 200 ticks are those after the reset, in which nothing can be armed.
        ensure!(dac.len() > 200, "the wire ends after {} writes", dac.len());
        return zero(0, dac.len());
    }
    // One zero is written before the first tick.
    let (armed, fault_at) = (1 + ARM_TICK as usize, 1 + FAULT_TICK as usize);
    let gone = fault_at + grace(fault);
    // An overrun of 8 ms skips ticks but no command.
    let again = match fault {
        FaultInjection::Interlock | FaultInjection::Overrun => 1 + 1300,
        FaultInjection::TwoFaults => 1 + 1450,
        _ => dac.len(),
    };
    ensure!(dac.len() > gone + 100, "the wire ends after {} writes", dac.len());
    zero(0, armed)?;
    let driven = |from: usize, to: usize| dac[from..to].iter().all(|written| written.enabled && written.code > 0);
    ensure!(driven(armed, fault_at), "no voltage before the fault, so that the drill shows nothing");
    zero(gone, again)?;
    ensure!(again == dac.len() || driven(again, dac.len()), "no voltage after arming again");
    Ok(())
}

/// Log and wire as text, values that depend on the build replaced by `_`.
fn golden_text(fault: FaultInjection, run: &Run) -> String {
    // The tick of the detection depends on the phase of the stalled task's period of 10 ms.
    let any_tick = fault == FaultInjection::Stall;
    let mut text = String::new();
    for line in run.log.iter().map(emulator::text) {
        let words = line.split(' ').map(|word| match word.split_once('=') {
            Some((key @ ("git" | "worst_lateness_us" | "rms_lateness_us" | "digest" | "min" | "mean" | "max"), _)) => {
                format!("{key}=_")
            }
            Some(("tick", number)) if any_tick && number.len() > 2 => "tick=_".into(),
            _ => match word.rsplit_once(".rs:") {
                Some((file, _)) => format!("{file}.rs:_"),
                None => word.to_owned(),
            },
        });
        let _ = writeln!(text, "{}", words.collect::<Vec<_>>().join(" "));
    }
    for part in run.dac.chunk_by(|a, b| a.enabled == b.enabled) {
        let what = if part[0].enabled { "enabled" } else { "off" };
        let codes = part.iter().map(|written| written.code);
        let (low, high) = (codes.clone().min().unwrap_or(0), codes.max().unwrap_or(0));
        let length = if any_tick { "some".into() } else { part.len().to_string() };
        let _ = writeln!(text, "wire: {length} x {what}, code {low} to {high}");
    }
    text
}

fn approved(fault: FaultInjection) -> PathBuf {
    shell::root().join("test-bench/drills").join(fault.name()).with_extension("log")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voltage_after_the_fault_is_an_error() {
        let on = Written { code: 1755, enabled: true };
        let wire = |driven: usize| [vec![SAFE; 11], vec![on; driven], vec![SAFE; 1200]].concat();
        voltage_goes(FaultInjection::Panic, &wire(290)).unwrap();
        assert!(voltage_goes(FaultInjection::Panic, &wire(291)).is_err());
        let mut dip = wire(290);
        dip[700].code = 1;
        assert!(voltage_goes(FaultInjection::Panic, &dip).is_err());
        assert!(voltage_goes(FaultInjection::Panic, &vec![SAFE; 1200]).is_err(), "never armed shows nothing");
        voltage_goes(FaultInjection::Unguarded, &vec![SAFE; 1200]).unwrap();
        assert!(voltage_goes(FaultInjection::Unguarded, &wire(290)).is_err());
    }
}
