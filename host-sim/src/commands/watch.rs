//! `vsj watch`: arguments of the full screen.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;
use host_sim::output::terminal::{print, remark};
use host_sim::signals;
use host_sim::watch::emulated::Emulated;
use host_sim::watch::session::Options;
use host_sim::watch::{Names, Settings, terminal};
use simulation::schedule::Between;

use super::choice::{BETWEEN, one_of};
use super::link::record::rows_hz;
use super::link::schedule::schedule;
use super::link::session::seconds;

/// Show and command the running MCU on a full screen, with plots; --emulated needs no board
///
/// Stiffness, voltage, state, limits, faults with their remedy and tick statistics, live. Keys arm, set and step the target, play
/// a schedule, record, acknowledge; `?` lists them. Space disarms immediately; `q` and Ctrl-C disarm and end.
#[derive(Args, Debug)]
#[command(
    arg_required_else_help = false,
    after_help = "\
Examples:
  vsj watch --emulated                                 an emulated board: try it
  vsj watch /dev/ttyACM0
  vsj watch /dev/ttyACM0 --record out.csv              record from the beginning
  vsj watch /dev/ttyACM0 --input step                  p plays ideal steps
  vsj watch tcp:lab:5000 --lines --seconds 60          a line per second

A recording has the columns of `vsj link PORT record`. A lost port or MCU is connected again as soon as it is back. Where \
there is no full screen (a pipe, TERM=dumb), each second is a line and no key is read. The MCU is disarmed at the end, \
also after a signal.

Exit codes: 0 success, 1 no answer, a recording that failed, an MCU that could not be disarmed, 2 bad arguments, a port \
that cannot be opened; 128 + number after SIGTERM or SIGHUP."
)]
pub(crate) struct Arguments {
    /// A serial device, unix:PATH or tcp:HOST:PORT
    #[arg(value_name = "PORT", required_unless_present = "emulated", conflicts_with = "emulated")]
    port: Option<String>,
    /// Start an emulated board and watch it; needs QEMU, and its image or the sources to build it
    #[arg(long)]
    emulated: bool,
    /// Image of the emulated board, as `cargo xtask image` prints it
    #[arg(long, value_name = "ELF", requires = "emulated")]
    firmware: Option<PathBuf>,
    /// Record to this file from the beginning; a second recording takes FILE-2.csv
    #[arg(long, value_name = "FILE.csv")]
    record: Option<PathBuf>,
    /// Overwrite an existing FILE.csv
    #[arg(long, requires = "record")]
    force: bool,
    /// Rows per second of a recording; 115 200 bit/s suffice for about 250
    #[arg(long, default_value_t = 100.0, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: f64,
    /// What `p` plays: the report's stair, its ideal steps, or a file of at most 1 000 000 rows and 512 MiB with columns
    /// time_s,voltage_v
    #[arg(long, default_value = "stair", value_name = "stair|step|FILE.csv")]
    input: String,
    /// Interpolation of the voltage between two rows of an input file
    #[arg(long, default_value = "hold", value_parser = one_of(BETWEEN))]
    between: Between,
    /// Print lines instead of a full screen
    #[arg(long)]
    lines: bool,
    /// Time between two lines, in s
    #[arg(long, default_value_t = 1.0, value_name = "S", allow_negative_numbers = true)]
    every: f64,
    /// End after this many seconds
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Baud rate of a serial device, in bit/s
    #[arg(long, default_value_t = 115_200, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(300..=12_000_000))]
    baud: u32,
    /// How long to wait for the port to open, and for an answer, in s
    #[arg(long, default_value_t = 1.0, value_name = "S", allow_negative_numbers = true)]
    timeout: f64,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut options = Options {
        whole: arguments.seconds.map_or(Ok(Duration::MAX), |s| seconds("--seconds", s, f64::INFINITY))?,
        every: seconds("--every", arguments.every, 3600.0)?,
        record: arguments.record.is_some(),
        lines: arguments.lines,
    };
    let names = arguments.record.clone().map(|first| Names { first, force: arguments.force, is_given: true });
    let mut settings = Settings {
        port: arguments.port.clone().unwrap_or_default(),
        baud: arguments.baud,
        timeout: seconds("--timeout", arguments.timeout, 3600.0)?,
        rows_hz: rows_hz(arguments.rate_hz)?,
        schedule: (arguments.input.clone(), schedule(&arguments.input, arguments.between)?),
        names: names.unwrap_or_else(Names::default_names),
    };
    if let Some(why) = terminal::obstacle().filter(|_| !options.lines) {
        remark(&format!("no full screen ({why}): lines instead, Ctrl-C ends"));
        options.lines = true;
    }
    let board = arguments.emulated.then(|| Emulated::start(arguments.firmware.as_deref(), remark)).transpose()?;
    if let Some(board) = &board {
        settings.port.clone_from(&board.port);
    }
    let connection = settings.connect()?;
    let (lowest_v, highest_v) = (connection.1.lowest.to_f64(), connection.1.highest.to_f64());
    if arguments.input != "stair" {
        settings.schedule.1.check_range(&arguments.input, lowest_v, highest_v)?;
    }
    let (outcome, signal) = host_sim::watch::run(&settings, connection, options)?;
    drop(board);
    let printed = outcome.wrote.iter().try_for_each(|wrote| print(&format!("{wrote}\n")));
    if let Some(signal) = signal.filter(|signal| *signal != SIGINT) {
        outcome.failures.iter().for_each(|failure| remark(failure));
        signals::end(signal);
    }
    printed?;
    if !outcome.failures.is_empty() {
        bail!("{}", outcome.failures.join("; "));
    }
    Ok(())
}

/// Number of the signal of Ctrl-C, which is an ordinary end.
const SIGINT: i32 = 2;
