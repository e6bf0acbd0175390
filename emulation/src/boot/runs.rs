//! What each run without a host, or with a fault, must show. Every check returns a line for the report, or an error.

use anyhow::{Context, Result, ensure};
use firmware::settings::{LONGEST_STALL_MS, SUPERVISION, WATCHDOG_MS};
use link::frame::MAX_FRAME;
use link::{BrownOut, FaultReport, Reason, Reply};
use model::Amplifier;
use model::supervisor::{Fault, Mismatch};
use serde::Deserialize;
use xtask::variant::Variant;

use super::events::{BYTE_US, Event, Events, JITTER_US, PERIOD_US, jitter};
use super::host;
use super::schedule::{STORED_RESET_MS, later_us};
use crate::variant;

/// Timeout of the watchdog, in us.
const WATCHDOG_US: f64 = WATCHDOG_MS as f64 * 1000.0;
/// Longest time until the output is off after all tasks but the control task have stopped together, in us.
const STALL_US: f64 = LONGEST_STALL_MS as f64 * 1000.0 + 2.0 * PERIOD_US;
/// Longest time that the amplifier's monitors may disagree with the command, plus the tick that detects it, in us.
pub(super) const MONITOR_US: f64 = 1e6 * SUPERVISION.monitor_time_s + PERIOD_US;
/// Duration of the longest frame on the line, in us.
const FRAME_US: f64 = MAX_FRAME as f64 * BYTE_US;
/// Longest time from a panic or fault to zero volts, in us. An instruction takes 1/170 us.
pub(super) const KILL_US: f64 = 5.0;

/// A run without a host and without a fault: it boots, its output stays zero and disabled, its ticks keep their period,
/// and the watchdog is fed.
pub(super) fn quiet(events: &Events, image: &[u8], variant: Variant) -> Result<String> {
    events.safe()?;
    let log = events.log(image)?;
    let said = format!("controller={}", variant::controller(variant).name());
    for part in ["reset=power-on last_fault=0", &said] {
        ensure!(log.first().is_some_and(|line| line.contains(part)), "no `{part}` where the log begins, {log:?}");
    }
    // The report's amplifier is not logged.
    let limit_v = log.iter().find_map(|line| line.strip_prefix("amplifier limit_v=")?.parse().ok());
    let limit_v: f64 = limit_v.unwrap_or(Amplifier::PAPER.max_v);
    ensure!(
        limit_v == variant::settings(variant).amplifier.max_v,
        "an amplifier of {limit_v} V, says the log, {log:?}"
    );
    ensure!(log.iter().any(|line| line.contains("summary tick=1000 overruns=0")), "no summary in {log:?}");
    ensure!(!log.iter().any(|line| line.contains("brown-out level")), "an expected level is logged, {log:?}");
    ensure!(events.times("reset").len() == 1, "it was reset");
    // Start-up writes zero once, before the first tick.
    let (setup, ticking) = events.split("watchdog started")?;
    ensure!(!ticking.times("store read").is_empty(), "the store is read before the watchdog is started, or never");
    let ticks = ticking.times("dac");
    ensure!(ticks.len() > 1180, "{} ticks in 1.2 s", ticks.len());
    let latest_us = f64::from(20_000 + later_us(variant));
    ensure!(ticks.first().is_some_and(|first| *first < latest_us), "the first tick is later than {latest_us} us");
    let jitter = jitter(&ticks);
    ensure!(jitter < JITTER_US, "writes to the DAC are up to {jitter:.2} us off their grid of {PERIOD_US} us");
    ensure!(setup.0.iter().any(|Event(_, what, value)| what == "enable" && value == "off"), "the enable floats");
    let outputs: Vec<&Event> = setup.0.iter().filter(|event| event.1 == "output").collect();
    ensure!(outputs.last().is_some_and(|event| event.2 == "unbuffered"), "a buffer holds zero off zero: {outputs:?}");
    let fed = events.times("fed");
    ensure!(fed.len() > 10, "the watchdog is not fed");
    let longest = fed.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    ensure!(longest < WATCHDOG_US / 2.0, "{longest:.0} us without food for the watchdog");
    Ok(format!(
        "{} ticks, DAC zero and enable off throughout, written every 1000 us, {jitter:.2} us of jitter; \
         watchdog of {:.0} ms started, fed at least every {:.1} ms",
        ticks.len(),
        WATCHDOG_US / 1e3,
        longest / 1e3
    ))
}

/// A run with a panic, fault or hang: the output is zero and disabled within `within_us` and before the first byte of
/// the log, then a reset follows that logs its cause and keeps the output safe.
pub(super) fn stopped(events: &Events, image: &[u8], within_us: f64, line: &str) -> Result<String> {
    let (_, after) = injected(events)?;
    let (dying, restarted) = after.split("reset")?;
    let (silent, logging) = dying.split("log")?;
    let (gone, _) = let_go(&silent)?;
    logging.safe().context("while it logs")?;
    ensure!(gone <= within_us, "the voltage goes after {gone:.2} us");
    let log = dying.log(image)?;
    ensure!(log.iter().any(|said| said.contains(line)), "no `{line}` in {log:?}");
    let boot = restarted_safe(&restarted, image, "reset=software")?;
    let gone = if gone < 1e3 { format!("{gone:.2} us") } else { format!("{:.1} ms", gone / 1e3) };
    Ok(format!("DAC zero and enable off {gone} later, before anything is logged; `{boot}`"))
}

/// A run in which the stack overflows: it is [`stopped`] by the guard, before an access leaves the memory, which is a fault as well.
pub(super) fn overflowed(events: &Events, image: &[u8]) -> Result<String> {
    let fault = events.0.iter().find(|event| event.1 == "fault").context("no fault")?;
    ensure!(
        fault.2.as_str().is_some_and(|why| why.contains("the MPU guards")),
        "a fault without the guard: {}",
        fault.2
    );
    stopped(events, image, KILL_US, "name=hard-fault")
}

/// A run with a `fault` that the supervisor detects, of the monitors by this `mismatch`: the output is
/// zero and disabled within `within_us`, the ticks go on without voltage whatever the host sends, and the fault is
/// reported on the line, after at most so many `frames`, again and again, because this host does not say that it has heard of it.
pub(super) fn faulted(
    events: &Events,
    image: &[u8],
    within_us: f64,
    fault: Fault,
    mismatch: Option<Mismatch>,
    frames: u32,
) -> Result<String> {
    let (_, after) = injected(events)?;
    let (us, without) = let_go(&after)?;
    ensure!(us <= within_us, "the voltage goes after {us:.0} us");
    ensure!(without.times("dac").len() > 50 && without.times("reset").is_empty(), "it does not go on");
    let log = after.log(image)?;
    let said = match mismatch {
        None => format!("name={}", fault.name()),
        Some(mismatch) => format!("monitor {}", mismatch.name()),
    };
    let line = log.iter().find(|line| line.contains(&said)).with_context(|| format!("no `{said}` in {log:?}"))?;

    let (_, ticking) = events.split("watchdog started")?;
    let reports: Vec<(f64, FaultReport)> = host::answers(&ticking)?
        .into_iter()
        .filter_map(|(us, _, reply)| if let Reply::Fault(report) = reply { Some((us, report)) } else { None })
        .collect();
    ensure!(reports.len() >= 2, "the fault is reported {} times: {reports:?}", reports.len());
    let (first_us, first) = reports[0];
    let expected = (1, link::Fault::from(fault), mismatch.into());
    ensure!((first.number, first.fault, first.mismatch) == expected, "reported as {first:?}");
    ensure!(reports.iter().all(|(_, report)| *report == first), "the reports differ: {reports:?}");
    let late_us = first_us - (after.0[0].0 + us);
    // The server looks once per tick.
    ensure!(
        late_us <= f64::from(frames) * FRAME_US + 2.0 * PERIOD_US,
        "reported {late_us:.0} us after the voltage has gone"
    );
    let between = reports.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max);
    ensure!(between < 110_000.0, "{between:.0} us between two reports");
    Ok(format!(
        "DAC zero and enable off {:.1} ms later; `{line}`; reported {:.1} ms after that, {} times",
        us / 1e3,
        late_us / 1e3,
        reports.len()
    ))
}

/// A run with words of the store that a power cut left half written: uncorrectable errors there are accepted.
pub(super) fn torn(events: &Events, image: &[u8]) -> Result<String> {
    let boot = restarted_safe(events, image, "reset=power-on last_fault=0")?;
    Ok(format!("words with two wrong bits are forgiven there alone; `{boot}`"))
}

/// A start with stored settings, which run: the time of the watchdog is theirs.
pub(super) fn stored(events: &Events, image: &[u8]) -> Result<String> {
    let log = events.log(image)?;
    ensure!(
        !log.iter().any(|line| line.contains("refused") || line.contains("fault code")),
        "they are refused: {log:?}"
    );
    let expected_us = u64::from(STORED_RESET_MS) * 1000;
    let mut fed = events.0.iter().filter(|event| event.1 == "fed").map(|event| &event.2).peekable();
    ensure!(fed.peek().is_some(), "the watchdog is not fed");
    let other = fed.find(|time| time.as_u64() != Some(expected_us));
    ensure!(other.is_none(), "a watchdog of {other:?} us, {expected_us} us in the settings");
    ensure!(events.times("reset").len() == 1, "it was reset");
    Ok(format!("they run: the watchdog, started with {WATCHDOG_MS} ms, has {STORED_RESET_MS} ms"))
}

/// A start with stored settings of which a bit is wrong: the built-in ones run, nothing is armed, and the host hears why.
pub(super) fn damaged(events: &Events, image: &[u8]) -> Result<String> {
    let line = "config refused field=damaged settings";
    not_armed(events, image, line, Fault::Config)?;
    Ok(format!("`{line}`; reported on the line, arming is refused, DAC zero and enable off throughout"))
}

/// A run with a reset from outside: a dip of the supply is a fault of its own, and an earlier fault still has to be
/// acknowledged after the reset.
pub(super) fn cut(events: &Events, image: &[u8], cause: &str) -> Result<String> {
    let (_, after) = injected(events)?;
    let (_, restarted) = after.split("reset")?;
    Ok(format!("no voltage until it is acknowledged; `{}`", restarted_safe(&restarted, image, cause)?))
}

/// A run in which no task but the control task goes on: the output is zero and disabled within the time of the task watchdog, and the
/// chip's watchdog, which is not fed any more, resets the chip.
pub(super) fn stalled(events: &Events, image: &[u8]) -> Result<String> {
    let (_, after) = injected(events)?;
    let (dying, restarted) = after.split("reset")?;
    let (us, _) = let_go(&dying)?;
    ensure!(us <= STALL_US, "the voltage goes after {us:.0} us");
    let reset_us = restarted.0[0].0 - after.0[0].0;
    ensure!(reset_us <= WATCHDOG_US + PERIOD_US, "the watchdog waits for {reset_us:.0} us");
    let boot = restarted_safe(&restarted, image, "reset=watchdog last_fault=5")?;
    Ok(format!(
        "DAC zero and enable off {:.1} ms later; the watchdog resets the chip after {:.0} ms; `{boot}`",
        us / 1e3,
        reset_us / 1e3
    ))
}

/// A run that hangs with interrupts disabled: the watchdog resets the chip in time.
pub(super) fn deaf(events: &Events, image: &[u8]) -> Result<String> {
    let (_, after) = injected(events)?;
    let (_, restarted) = after.split("reset")?;
    let us = restarted.0[0].0 - after.0[0].0;
    ensure!(us <= WATCHDOG_US, "the watchdog waits for {us:.0} us");
    let boot = restarted_safe(&restarted, image, "reset=watchdog last_fault=5")?;
    Ok(format!("the voltage stays until the watchdog resets the chip {:.0} ms later; `{boot}`", us / 1e3))
}

/// A start that is refused because of `field`, the guards of stack and control task or the image: no tick runs, the log
/// says so, and the watchdog resets the chip into a fault.
pub(super) fn refused(events: &Events, image: &[u8], field: &str) -> Result<String> {
    events.safe()?;
    let log = events.log(image)?;
    let line = format!("config refused field={field}");
    ensure!(log.contains(&line), "it does not say so: {log:?}");
    let (_, start) = events.split("watchdog started")?;
    let (refused, restarted) = start.split("reset")?;
    ensure!(refused.times("dac").is_empty(), "it ticks");
    let us = restarted.0[0].0 - start.0[0].0;
    ensure!(us <= WATCHDOG_US, "the watchdog waits for {us:.0} us");
    let boot = restarted_safe(&restarted, image, "reset=watchdog last_fault=7")?;
    Ok(format!("nothing starts, the log says so, and the watchdog resets the chip after {:.0} ms; `{boot}`", us / 1e3))
}

/// A run in which a recorded session is played to the chip: its frames are answered, and none arms it.
pub(super) fn replayed(events: &Events, image: &[u8]) -> Result<String> {
    events.safe()?;
    let answered = events.times("sent").len();
    ensure!(answered > 100, "{answered} bytes of answers show little");
    ensure!(events.log(image)?.iter().all(|line| !line.contains("-> armed")), "it was armed");
    ensure!(events.times("dac").len() > 500, "it does not tick");
    Ok("a session recorded with another chip is answered and does not arm it; DAC zero and enable off throughout"
        .into())
}

/// A run in which the random number generator delivers nothing: no session could be distinguished from a recorded one, so that
/// the chip does not talk.
pub(super) fn unrandom(events: &Events, image: &[u8]) -> Result<String> {
    events.safe()?;
    let log = events.log(image)?;
    ensure!(log.iter().any(|line| line == "config refused field=random"), "it does not say so: {log:?}");
    ensure!(events.times("sent").is_empty(), "it talks");
    ensure!(events.times("dac").len() > 50 && events.times("reset").len() == 1, "it does not tick");
    Ok("the log says so, nothing is armed, DAC zero and enable off throughout".into())
}

/// The instructions of the ticks with voltage, from a run with a host, within the bounds of the variant.
pub(super) fn instructions(events: &Events, variant: Variant) -> Result<String> {
    let mut counts = Vec::new();
    let mut ticked = None;
    for Event(_, what, value) in &events.0 {
        match what.as_str() {
            "ticked" => ticked = value.as_u64(),
            "dac" => counts.extend(ticked.take().filter(|_| *value != 0)),
            _ => {}
        }
    }
    ensure!(counts.len() > 1000, "{} ticks with voltage show little", counts.len());
    let (lowest, highest) = (counts.iter().min().copied().unwrap_or(0), counts.iter().max().copied().unwrap_or(0));
    let mean = counts.iter().sum::<u64>() / counts.len() as u64;
    let bounds = variant::instructions(variant);
    let within = bounds.contains(&lowest) && bounds.contains(&highest);
    ensure!(within, "{lowest} to {highest} instructions, expected {} to {}", bounds.start(), bounds.end());
    Ok(format!(
        "{lowest} to {highest} instructions, mean {mean}, supervisor included, in {} ticks with voltage; {} to {} are allowed",
        counts.len(),
        bounds.start(),
        bounds.end()
    ))
}

/// The greatest depth of the stack in any of the runs, which must not exceed the `worst` one that is computed, and the
/// name of that run. `None` if each of them has a RAM that fails its test.
pub(super) fn stack(output: &serde_json::Value, worst: u32) -> Result<Option<String>> {
    let depth = |(name, value): (&String, &serde_json::Value)| {
        let events = Events::deserialize(value).ok()?;
        events.0.iter().rfind(|event| event.1 == "stack").and_then(|event| Some((event.2.as_u64()?, name.clone())))
    };
    // A RAM that fails its test is left full of patterns.
    let sound = |(name, _): &(&String, &serde_json::Value)| !["stuck bit", "coupled bits"].contains(&name.as_str());
    let mut runs = output.as_object().context("no runs")?.iter().filter(sound).peekable();
    if runs.peek().is_none() {
        return Ok(None);
    }
    let (deepest, name) = runs.filter_map(depth).max().context("no depth of the stack")?;
    ensure!(
        deepest <= u64::from(worst),
        "{deepest} bytes of stack in the run `{name}`, and {worst} were computed as the most"
    );
    Ok(Some(format!("at most {deepest} bytes in any run (`{name}`); {worst} are computed as the most")))
}

/// A start with a RAM that fails its test: nothing starts, the log says so, and the watchdog resets the chip into the
/// same again.
pub(super) fn unfit(events: &Events, image: &[u8]) -> Result<String> {
    events.safe()?;
    let log = events.log(image)?;
    let line = "self-test failed part=ram value=536871936";
    ensure!(log.iter().any(|said| said == line), "it does not say so: {log:?}");
    ensure!(log.iter().any(|said| said.contains("reset=watchdog last_fault=9")), "no fault is kept: {log:?}");
    ensure!(events.times("ticked").is_empty() && events.times("sent").is_empty(), "it ticks or talks");
    let resets = events.times("reset").len();
    ensure!(resets >= 3, "it is reset {resets} times");
    Ok(format!("`{line}`; nothing starts, and the watchdog resets the chip into the same again"))
}

/// A start with a processor whose clock is not what it should be compared with the watchdog's, which it sees as
/// `seen_hz`: nothing is armed, and the host hears why.
pub(super) fn wrong_clock(events: &Events, image: &[u8], seen_hz: u32) -> Result<String> {
    let line = format!("self-test failed part=clock value={seen_hz}");
    not_armed(events, image, &line, Fault::SelfTest)?;
    Ok(format!("`{line}`; reported on the line, arming is refused, DAC zero and enable off throughout"))
}

/// An error unless the start logs `line` and `fault`, the host hears of the fault, and arming is refused.
fn not_armed(events: &Events, image: &[u8], line: &str, fault: Fault) -> Result<()> {
    events.safe()?;
    let log = events.log(image)?;
    for part in [line, &format!("fault code={} name={}", fault.code(), fault.name())] {
        ensure!(log.iter().any(|said| said.contains(part)), "no `{part}` in {log:?}");
    }
    let answers = answers(events)?;
    ensure!(answers.contains(&Reply::Refused(Reason::Faulted(fault.into()))), "arming is not refused: {answers:?}");
    let reported = |reply: &Reply| matches!(reply, Reply::Fault(report) if report.fault == link::Fault::from(fault));
    ensure!(answers.iter().any(reported), "the host does not hear of it: {answers:?}");
    Ok(())
}

/// A start with the brown-out level of a new chip, which log and link say.
pub(super) fn delivered(events: &Events, image: &[u8]) -> Result<String> {
    let boot = restarted_safe(events, image, "reset=power-on last_fault=0")?;
    let log = events.log(image)?;
    let line = "brown-out level=0 expected=4";
    ensure!(log.iter().any(|said| said == line), "it does not say so: {log:?}");
    let answers = answers(events)?;
    let level = Some(BrownOut { level: 0, expected: 4 });
    ensure!(answers.contains(&Reply::BrownOut(level)), "the host does not hear of it: {answers:?}");
    Ok(format!("`{line}`, which the host hears as well; `{boot}`"))
}

/// A start with a voltage at the monitor although the amplifier is off: arming is refused, and after the discharge time
/// it is a fault.
pub(super) fn held(events: &Events, image: &[u8]) -> Result<String> {
    events.safe()?;
    let log = events.log(image)?;
    let line = format!("monitor {}", Mismatch::Held.name());
    ensure!(log.iter().any(|said| said.contains(&line)), "no `{line}` in {log:?}");
    let answers = answers(events)?;
    ensure!(answers.contains(&Reply::Refused(Reason::Live)), "arming is not refused: {answers:?}");
    Ok(format!("arming is refused, and after a second `{line}`; DAC zero and enable off throughout"))
}

/// Everything that the chip sends from its start on.
fn answers(events: &Events) -> Result<Vec<Reply>> {
    let (_, ticking) = events.split("watchdog started")?;
    Ok(host::answers(&ticking)?.into_iter().map(|(_, _, reply)| reply).collect())
}

/// The events before the injected fault and those from it on. An error if there was no voltage before it.
fn injected(events: &Events) -> Result<(Events, Events)> {
    let (before, after) = events.split("injected")?;
    ensure!(before.safe().is_err(), "no voltage before the injected fault, so that it shows nothing");
    Ok((before, after))
}

/// The time from the first event until the voltage is gone for good, in us, and the events from then on. A tick that had begun before
/// may still write once.
fn let_go(events: &Events) -> Result<(f64, Events)> {
    let after_last = events.0.iter().rposition(Event::drives).map_or(0, |last| last + 1);
    let without = Events(events.0[after_last..].to_vec());
    Ok((gone(&without)? + without.0[0].0 - events.0[0].0, without))
}

/// The time from the first event until the output was both zero and disabled, in us.
fn gone(events: &Events) -> Result<f64> {
    events.safe()?;
    let when = |what: &str, is: serde_json::Value| {
        let event = events.0.iter().find(|Event(_, name, value)| name == what && *value == is);
        event.map(|event| event.0).with_context(|| format!("no {what} {is} before the log"))
    };
    Ok(when("dac", 0.into())?.max(when("enable", "off".into())?) - events.0[0].0)
}

/// An error unless the output stays safe for at least 50 ticks after the reset. Returns the boot line from `cause` on.
fn restarted_safe(events: &Events, image: &[u8], cause: &str) -> Result<String> {
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
    fn a_log_line_before_the_output_is_safe_is_an_error() {
        let dying = |list: &[(&str, serde_json::Value)]| gone(&events(list).split("log").unwrap().0);
        let (injection, log) = (("injected", 300.into()), ("log", "00".into()));
        let (zero, off) = (("dac", 0.into()), ("enable", "off".into()));
        assert_eq!(dying(&[injection.clone(), off.clone(), zero.clone(), log.clone()]).unwrap(), 2.0);
        assert!(dying(&[injection.clone(), off.clone(), log.clone(), zero.clone()]).is_err());
        assert!(dying(&[injection.clone(), zero.clone(), log.clone(), off.clone()]).is_err());
        assert!(dying(&[injection, ("dac", 1755.into()), off, zero, log]).is_err());
    }

    #[test]
    fn a_voltage_that_is_written_once_more_goes_later_and_one_that_stays_is_an_error() {
        let (injection, written) = (("injected", 300.into()), ("dac", 1755.into()));
        let (zero, off) = (("dac", 0.into()), ("enable", "off".into()));
        let gone = |list: &[(&str, serde_json::Value)]| let_go(&events(list)).map(|(us, _)| us);
        assert_eq!(gone(&[injection.clone(), off.clone(), zero.clone()]).unwrap(), 2.0);
        assert_eq!(gone(&[injection.clone(), written.clone(), off.clone(), zero.clone()]).unwrap(), 3.0);
        assert!(gone(&[injection.clone(), off, zero, written.clone()]).is_err());
        assert!(gone(&[injection, written]).is_err());
    }
}
