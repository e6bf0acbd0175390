//! `vsj link`: the MCU over its serial link.

mod capture;
mod model;
pub(super) mod record;
pub(super) mod schedule;
pub(super) mod session;
mod settings;
mod watch;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand, ValueEnum};
use host_sim::link::{Client, Patience, Port, desired, fault as parse_fault};
use host_sim::output::terminal::remark;
use link::adaptation::Adaptation;
use link::isolation::Isolation;
use link::{Desired, Fault, Request};
use session::{Answer, Session, seconds, stopped};

/// Communicate with the MCU over its serial link: status, set, arm, disarm, isolation, adaptation, watch, record, capture, model, settings
#[derive(Args, Debug)]
#[command(
    arg_required_else_help = false,
    after_help = "\
Examples:
  vsj link /dev/ttyACM0 status
  vsj link /dev/ttyACM0 set 300 --arm --keep 60         arm, 300 V for a minute
  vsj link /dev/ttyACM0 set 0.25N/m --keep 5
  vsj link unix:/tmp/mcu.sock watch                     the emulator
  vsj link /dev/ttyACM0 watch --udp                     live in PlotJuggler
  vsj link /dev/ttyACM0 record out.csv --input stair --arm
  vsj link /dev/ttyACM0 record out.mcap                 for Foxglove
  vsj link /dev/ttyACM0 capture --input steps.csv --arm --out every-tick.csv
  vsj link /dev/ttyACM0 model out/diagnosis/plant.toml  run the identified model
  vsj link /dev/ttyACM0 settings amplifier.toml         range, gains, rate
  vsj link /dev/ttyACM0 adaptation --off                back to the stored model

The MCU ramps the voltage down when the host is silent for longer than its limit (see `status`): a target is kept only while \
a command stays connected: --keep, watch or record. A request is repeated every 0.1 s until it is answered, for --timeout \
seconds; the MCU applies it once.

Exit codes: 0 success, 1 request rejected, no answer, connection lost or a fault while armed, 2 bad arguments, a port that cannot be opened, a \
stiffness out of reach, 128 + number after a signal: set, arm, watch, record and capture disable the output first. Ctrl-C is the usual \
end of watch, record and --keep: exit code 0, unless a request waits for an answer."
)]
pub(crate) struct Arguments {
    /// A serial device, unix:PATH or tcp:HOST:PORT
    #[arg(value_name = "PORT")]
    port: String,
    #[command(subcommand)]
    command: Command,
    /// Baud rate of a serial device, in bit/s
    #[arg(long, global = true, default_value_t = 115_200, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(300..=12_000_000))]
    baud: u32,
    /// How long to wait for the port to open, and for an answer, in s
    #[arg(long, global = true, default_value_t = 1.0, value_name = "S", allow_negative_numbers = true)]
    timeout: f64,
    /// One JSON object on stdout
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Show the status of the MCU
    Status,
    /// Set the desired stiffness of an armed MCU
    Set(Set),
    /// Enable the output; the target starts at 0 V
    Arm {
        /// Stay connected for this many seconds, `inf` until Ctrl-C
        #[arg(long, value_name = "S", allow_negative_numbers = true)]
        keep: Option<f64>,
    },
    /// Disable the output immediately
    Disarm,
    /// Acknowledge a fault by the name or number that `status` shows; after the last one the MCU is disarmed
    Acknowledge {
        /// Name or number of the fault
        fault: String,
    },
    /// Show what the isolation bank says of the spring and its sensor
    Isolation {
        /// End its alarm first: it looks for a fault anew
        #[arg(long)]
        acknowledge: bool,
    },
    /// Show what the adaptation does, with the parameters in use and their bounds
    Adaptation {
        /// Switch it off first: the model goes back to the stored one, step by step while it is armed and near its target
        #[arg(long)]
        off: bool,
        /// Switch it on first, also after it has stopped by itself
        #[arg(long, conflicts_with = "off")]
        on: bool,
    },
    /// Show the running loop, and keep the MCU from detecting a silent host
    Watch(watch::Arguments),
    /// Record time, voltage and stiffness as CSV, MCAP or Parquet for `vsj diagnose`
    Record(record::Arguments),
    /// Record every tick of a few seconds in the MCU's RAM, then send it as CSV for `vsj diagnose`
    Capture(capture::Arguments),
    /// Show the MCU's model of the spring; with a plant file, send it to be checked and stored, and restart
    Model(model::Arguments),
    /// Show the MCU's settings; with a settings file, send it to be checked and stored, and restart
    Settings(settings::Arguments),
}

#[derive(Args, Debug)]
struct Set {
    /// The desired stiffness, alone or with its unit: 300, 1.5e9Pa, 0.25N/m
    #[arg(allow_negative_numbers = true)]
    value: String,
    /// Unit of a value without one: V of equivalent static voltage, Pa of Young's modulus, N/m at the tip; default: v
    #[arg(long, value_enum, ignore_case = true)]
    unit: Option<Unit>,
    /// Arm the MCU first
    #[arg(long)]
    arm: bool,
    /// Stay connected for this many seconds, `inf` until Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    keep: Option<f64>,
}

impl Set {
    fn desired(&self) -> Result<Desired> {
        let unit = match self.unit {
            None => "",
            Some(Unit::V) => "V",
            Some(Unit::Pa) => "Pa",
            Some(Unit::NPerM) => "N/m",
        };
        desired(&format!("{}{unit}", self.value))
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Unit {
    V,
    Pa,
    #[value(alias = "N/m")]
    NPerM,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let json = arguments.json;
    let timeout = seconds("--timeout", arguments.timeout, 3600.0)?;
    let (patience, baud) = (Patience::of(timeout), arguments.baud);
    // The arguments are checked before anything is sent.
    let fault = match &arguments.command {
        Command::Acknowledge { fault } => parse_fault(fault)?,
        _ => Fault::NONE,
    };
    let target = match &arguments.command {
        Command::Set(set) => set.desired()?,
        _ => Desired::ScaledVolts(0.0),
    };
    let keep = match &arguments.command {
        Command::Set(Set { keep, .. }) | Command::Arm { keep } => keep.map(|s| seconds("--keep", s, f64::INFINITY)),
        _ => None,
    };
    let keep = keep.transpose()?;
    match &arguments.command {
        Command::Record(arguments) => arguments.check()?,
        Command::Capture(arguments) => arguments.check()?,
        Command::Watch(arguments) => arguments.check()?,
        _ => (),
    }
    let model = match &arguments.command {
        Command::Model(arguments) => arguments.read()?,
        _ => None,
    };
    let source = match &arguments.command {
        Command::Settings(arguments) => arguments.read()?,
        _ => None,
    };
    let port = Port::open(&arguments.port, baud, timeout)?;
    let (client, status) = Client::greet(port, patience).with_context(|| arguments.port.clone())?;
    let mut session = Session { client, status, json, brown_out: None };
    // The other commands leave the output as it is, and may end anywhere.
    if let Command::Set(_) | Command::Arm { .. } | Command::Watch(_) | Command::Record(_) | Command::Capture(_) =
        arguments.command
    {
        session.stop_on_signal();
    }
    let mut execute = || match &arguments.command {
        Command::Status => session.show_status(),
        Command::Set(Set { arm, .. }) => {
            let done = set(&mut session, &arguments.port, *arm, target)?;
            session.show_and_keep(done, keep)
        }
        Command::Arm { .. } => {
            let done = session.order(Request::Arm)?;
            session.show_and_keep(done, keep)
        }
        Command::Disarm => {
            let done = session.order(Request::Disarm)?;
            session.show(done)
        }
        Command::Acknowledge { .. } => {
            let done = acknowledge(&mut session, &arguments.port, fault)?;
            session.show(done)
        }
        Command::Isolation { acknowledge } => {
            session.show_isolation(if *acknowledge { Isolation::Acknowledge } else { Isolation::Read })
        }
        Command::Adaptation { off, on } => session.show_adaptation(match (off, on) {
            (true, _) => Adaptation::Off,
            (_, true) => Adaptation::On,
            _ => Adaptation::Read,
        }),
        Command::Watch(arguments) => watch::run(&mut session, arguments, baud),
        Command::Record(record) => record::run(&mut session, record, baud),
        Command::Capture(arguments) => capture::run(&mut session, arguments),
        Command::Model(arguments) => model::run(&mut session, arguments, model.as_ref()),
        Command::Settings(arguments) => settings::run(&mut session, arguments, source.as_ref()),
    };
    let done = execute();
    let ctrl_c_is_usual = keep.is_some() || matches!(arguments.command, Command::Watch(_) | Command::Record(_));
    session.finish(done, ctrl_c_is_usual)
}

/// Sets the target, after arming the MCU if that is asked for.
fn set(session: &mut Session, port: &str, arm: bool, target: Desired) -> Result<Answer> {
    let arms = arm && session.status.sample.state == link::State::Disarmed;
    if arm {
        session.order(Request::Arm)?;
        if stopped() {
            bail!("{port}: no target is set");
        }
    }
    let done = session.order(Request::Set(target));
    // After a signal the end of the session does it.
    if done.is_err() && arms && !stopped() {
        // What this command has armed does not stay so without the stiffness that it was armed for.
        // Without its host the MCU ramps down by itself.
        let _ = session.client.leave();
    }
    done
}

/// Acknowledges a fault, and remarks on one that still stands and on none that stood.
fn acknowledge(session: &mut Session, port: &str, fault: Fault) -> Result<Answer> {
    let stood = session.status.fault;
    let done = session.order(Request::Acknowledge(fault))?;
    if done.0 == link::State::Faulted {
        let next = session.refresh()?.fault;
        remark(&format!("{port}: {fault} is acknowledged; another fault stands: {next}"));
    } else if stood == Fault::NONE {
        remark(&format!("{port}: no fault stands, so none was acknowledged"));
    }
    Ok(done)
}
