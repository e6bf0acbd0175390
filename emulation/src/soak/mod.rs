//! `cargo xtask soak`: random ticks of the firmware's control on the host, with every invariant checked in each.
//!
//! In: a number of ticks. Out: counts on stdout; an error that names run and tick of the first violation. It is built
//! with overflow checks, as the tests are: a wrap panics.
//!
//! - [`setup`] makes random settings that the controller accepts.
//! - [`events`] makes commands, readings and disturbances, in phases.
//! - [`invariants`] is what must hold after each tick.
//! - [`hour`] is an hour of the emulated board instead, with its tasks, timers, log and DAC.

mod events;
mod hour;
mod invariants;
mod setup;

use anyhow::{Result, bail};
use firmware::control::Untimed;
use firmware::mailbox::Mailbox;
use firmware::pace::Pace;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use xtask::tally::Tally;

use events::Events;
use invariants::{Counts, Watch};
use setup::Setup;

/// Ticks of one run: each has settings of its own, and 17 minutes at 1 kHz let every 8-bit and 16-bit counter wrap.
const RUN_TICKS: u64 = 1_000_000;

/// Arguments of `cargo xtask soak`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Number of ticks, in runs of at most one million
    #[arg(long, default_value_t = 100_000_000)]
    ticks: u64,
    /// First run; a failure names the run to repeat
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Instead, an hour of random commands on the emulated board, in about ten minutes: every code and estimate as on the host
    #[arg(long, conflicts_with_all = ["ticks", "from"])]
    emulated: bool,
}

/// Runs all ticks and prints what they covered.
pub(crate) fn run(args: &Args) -> Result<()> {
    if args.emulated {
        return hour::run();
    }
    let runs = args.ticks.div_ceil(RUN_TICKS);
    let counts = (args.from..args.from.saturating_add(runs))
        .into_par_iter()
        .map(|run| one_run(run, RUN_TICKS.min(args.ticks - (run - args.from) * RUN_TICKS)))
        .try_reduce(Counts::default, |one, other| Ok(one.and(&other)))?;
    println!("{counts}");
    if let Some(missing) = counts.missing() {
        bail!("no tick {missing}: too few ticks to show anything about it");
    }
    Tally::now(counts.tallied())?.write("soak")
}

/// Runs `ticks` ticks with the settings and events that the number of the run stands for.
fn one_run(run: u64, ticks: u64) -> Result<Counts> {
    let mut random = ChaCha8Rng::seed_from_u64(run);
    let Setup { mut control, limits } = Setup::random(run, &mut random);
    let mut events = Events::new(&limits, &mut random);
    let mut watch = Watch::new(limits);
    let mut mailbox = Mailbox::EMPTY;
    // From 0 to a minute before the microseconds of the clock pass 2^32.
    let start_us = (1u64 << 32).saturating_sub(random.random_range(0..120_000_000));
    let mut pace = Pace::new(start_us, 1000);
    for tick in 0..ticks {
        let event = events.next();
        if let Some(command) = event.command {
            mailbox.put(command, control.supervisor().state());
        }
        if event.heard {
            mailbox.hear();
        }
        let state = control.supervisor().state();
        let (command, _) = mailbox.take(state);
        let due_us = pace.due_us();
        let arrival = pace.arrive(due_us + u64::from(event.late_us));
        let sensors = event.sensors(arrival.missed_ticks);
        let result = control.tick(&command, &sensors, &mut Untimed);
        events.observe(&result);
        let seen = watch
            .pace(due_us, &event, &arrival, pace.due_us())
            .and_then(|()| watch.tick(state, &command, &sensors, &result, control.supervisor()));
        if let Err(what) = seen {
            bail!("run {run}, tick {tick}: {what} (repeat with --from {run} --ticks {})", tick + 1);
        }
    }
    Ok(watch.counts())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of every test run: one run with each kind of spring, sensor and controller.
    #[test]
    fn every_invariant_holds_in_random_ticks() {
        let counts =
            (0..12).map(|run| one_run(run, 100_000).unwrap()).fold(Counts::default(), |sum, one| sum.and(&one));
        assert_eq!(counts.missing(), None, "{counts}");
    }

    #[test]
    fn a_run_is_repeatable() {
        assert_eq!(one_run(3, 20_000).unwrap(), one_run(3, 20_000).unwrap());
    }
}
