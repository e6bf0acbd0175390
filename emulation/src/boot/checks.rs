//! The runs of an image, and what each has to show.

use anyhow::Result;
use firmware::LONGEST_HANG_MS;
use firmware::settings::SUPERVISION;
use model::supervisor::{Fault, Mismatch};
use xtask::variant::{Limit, Variant};

use super::events::{Events, JITTER_US, PERIOD_US};
use super::runs::{KILL_US, MONITOR_US};
use super::schedule::Replacement;
use super::{host, runs};

/// Returns a line for the report, or an error that says what a run does not show.
type Shows<'a> = Box<dyn Fn(&Events) -> Result<String> + 'a>;

/// One check of one run.
pub(super) struct Check<'a> {
    /// Name of the run.
    pub(super) run: &'static str,
    /// Number of faults that are injected in the run.
    pub(super) faults: usize,
    /// True if the run depends on controller or amplifier more than on the rest of the image.
    pub(super) is_of_variant: bool,
    /// What it has to show.
    pub(super) shows: Shows<'a>,
}

impl Check<'_> {
    /// Returns this check for a run in which `faults` faults are injected.
    fn with_faults(self, faults: usize) -> Self {
        Self { faults, ..self }
    }

    /// Returns this check for a run that depends on controller or amplifier more than on the rest of the image.
    fn of_variant(self) -> Self {
        Self { is_of_variant: true, ..self }
    }
}

/// The checks of an image. `settings` and `model` are what a host stores while the chip is reset, and the operations of the flash in which
/// it is.
pub(super) fn of<'a>(
    image: &'a [u8],
    variant: Variant,
    settings: (&'a Replacement, &'a [usize]),
    model: (&'a Replacement, &'a [usize]),
) -> Vec<Check<'a>> {
    fn check<'a>(run: &'static str, shows: impl Fn(&Events) -> Result<String> + 'a) -> Check<'a> {
        Check { run, faults: 1, is_of_variant: false, shows: Box::new(shows) }
    }
    let hang_us = f64::from(LONGEST_HANG_MS) * 1e3;
    let stopped = |run, within_us, log| check(run, move |it| runs::stopped(it, image, within_us, log));
    let faulted = |run, within_us, fault, mismatch, frames| {
        check(run, move |it| runs::faulted(it, image, within_us, fault, mismatch, frames))
    };
    let monitor = |run, mismatch| faulted(run, MONITOR_US + JITTER_US, Fault::Monitor, Some(mismatch), 1);
    let in_next_us = PERIOD_US + JITTER_US;
    let reset = |run, cause| check(run, move |it| runs::cut(it, image, cause));
    let clock = |run, seen_hz| check(run, move |it| runs::wrong_clock(it, image, seen_hz));
    let refused = |run, field| check(run, move |it| runs::refused(it, image, field));
    let mut checks = vec![
        check("quiet", move |it| runs::quiet(it, image, variant)).with_faults(0).of_variant(),
        check("host", move |it| Ok(host::check(it, variant)? + "; " + &runs::instructions(it, variant)?))
            .with_faults(0)
            .of_variant(),
        stopped("panic", KILL_US, "panic at injected.rs:7"),
        stopped("hard fault", KILL_US, "name=hard-fault"),
        stopped("two wrong bits", KILL_US, "name=hard-fault"),
        check("stack overflow", move |it| runs::overflowed(it, image)),
        stopped("hang", hang_us + KILL_US, "name=watchdog").of_variant(),
        stopped("stopped timer", hang_us + KILL_US, "name=watchdog"),
        check("late tick", |it| host::late(it, SUPERVISION.missed_ticks_allowed)),
        faulted("interlock", in_next_us, Fault::Interlock, None, 1).of_variant(),
        // The buffer of the line is full, and a frame waits for room in it.
        check("flood", move |it| {
            let faulted = runs::faulted(it, image, in_next_us, Fault::Interlock, None, 2)?;
            Ok(host::flood(it, variant)? + "; " + &faulted)
        }),
        // The tick that takes 7.4 ms still ends; the next one, which follows it immediately, detects it.
        faulted("overrun", 8.0 * PERIOD_US + JITTER_US, Fault::Overrun, None, 1),
        monitor("no voltage", Mismatch::Open).of_variant(),
        monitor("too low", Mismatch::Limit),
        monitor("short circuit", Mismatch::Short),
        monitor("slow amplifier", Mismatch::Slew),
        monitor("current", Mismatch::Leakage),
        monitor("supply of 3.6 V", Mismatch::Reference),
        check("torn", move |it| runs::torn(it, image)),
        check("stored settings", move |it| runs::stored(it, image)).with_faults(0),
        check("damaged settings", move |it| runs::damaged(it, image)),
        reset("dip", "reset=brown-out last_fault=8"),
        reset("button", "reset=pin last_fault=4"),
        reset("button while armed", "reset=pin last_fault=8"),
        check("deaf", move |it| runs::deaf(it, image)),
        check("halted", move |it| runs::deaf(it, image)),
        check("stalled tasks", move |it| runs::stalled(it, image)),
        check("sent", move |it| host::sent(it, variant)).with_faults(0).of_variant(),
        check("cut settings", move |it| host::cut(it, settings.0, settings.1)).with_faults(settings.1.len()),
        check("cut model", move |it| host::cut(it, model.0, model.1)).with_faults(model.1.len()),
        check("protected page", host::protected),
        check("replayed", move |it| runs::replayed(it, image)),
        check("no random number", move |it| runs::unrandom(it, image)),
        refused("unguarded", "guards"),
        refused("wrong image", "image"),
        check("stuck bit", move |it| runs::unfit(it, image)),
        check("coupled bits", move |it| runs::unfit(it, image)),
        clock("slow processor", 64_000),
        clock("no low-speed clock", 0),
        check("brown-out level", move |it| runs::delivered(it, image)),
        check("voltage at the start", move |it| runs::held(it, image)),
    ];
    // An amplifier below the image's limit is no danger.
    if variant.limit_v != Limit::Kilovolt {
        checks.push(monitor("other amplifier", Mismatch::Reference).of_variant());
    }
    checks
}
