//! `vsj link`: the MCU over its serial link.

mod model;
mod record;
mod session;
mod watch;

use anyhow::{Context, Result};
use clap::{Args, Subcommand, ValueEnum};
use host_sim::link::{Client, Patience, Port};
use link::{Desired, Fault, Request};
use session::{Session, seconds};
use simulation::bad_input;

/// Talk to the MCU over its serial link: status, set, arm, disarm, watch, record, model
#[derive(Args, Debug)]
#[command(
    arg_required_else_help = false,
    after_help = "\
Examples:
  vsj link /dev/ttyACM0 status
  vsj link /dev/ttyACM0 set 300 --arm --keep 60         arm, 300 V for a minute
  vsj link /dev/ttyACM0 set 1.5e9 --unit pa --keep 5
  vsj link unix:/tmp/mcu.sock watch                     the emulator
  vsj link /dev/ttyACM0 record out.csv --input stair --arm
  vsj link /dev/ttyACM0 model out/diagnosis/plant.toml  run what was found

The MCU leads the voltage down when it has not heard the host for longer than its limit (see `status`): a target lives as \
long as a command that keeps sessioning, --keep, watch or record. Each request is sent every 0.1 s until it is answered, for \
--timeout seconds; the MCU applies it once.

Exit codes: 0 done, 1 refused, no answer or connection lost, 2 bad arguments, a port that cannot be opened, a stiffness \
out of reach."
)]
pub(crate) struct Arguments {
    /// A serial device, unix:PATH or tcp:HOST:PORT
    #[arg(value_name = "PORT")]
    port: String,
    #[command(subcommand)]
    command: Command,
    /// Speed of a serial device, in bit/s
    #[arg(long, global = true, default_value_t = 115_200, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(300..=12_000_000))]
    baud: u32,
    /// How long to wait for an answer, in s
    #[arg(long, global = true, default_value_t = 1.0, value_name = "S", allow_negative_numbers = true)]
    timeout: f64,
    /// One JSON object on stdout
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Everything about the MCU
    Status,
    /// Set the desired stiffness of an armed MCU
    Set(Set),
    /// Let voltage out; the target starts at 0 V
    Arm {
        /// Stay connected for so many seconds, `inf` until Ctrl-C
        #[arg(long, value_name = "S", allow_negative_numbers = true)]
        keep: Option<f64>,
    },
    /// Take the voltage away at once
    Disarm,
    /// Acknowledge a fault, by its name or number as `status` says it; the MCU is disarmed then
    Acknowledge {
        /// Name or number of the fault
        fault: String,
    },
    /// Show the loop while it runs, and keep the MCU from thinking the host silent
    Watch(watch::Arguments),
    /// Record time, voltage and stiffness as CSV, as `vsj diagnose` reads them
    Record(record::Arguments),
    /// Which model of the spring the MCU runs; with a plant file, send it, have it checked and stored, and restart
    Model(model::Arguments),
}

#[derive(Args, Debug)]
struct Set {
    /// The stiffness
    #[arg(allow_negative_numbers = true)]
    value: f64,
    /// Its unit: volts of equivalent static voltage, Pa of Young's modulus, N/m at the tip
    #[arg(long, value_enum, default_value_t)]
    unit: Unit,
    /// Arm first
    #[arg(long)]
    arm: bool,
    /// Stay connected for so many seconds, `inf` until Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    keep: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum Unit {
    #[default]
    V,
    Pa,
    NPerM,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let json = arguments.json;
    let patience = Patience::of(seconds("--timeout", arguments.timeout, 3600.0)?);
    // What can be wrong with the arguments, before anything is sent.
    let fault = match &arguments.command {
        Command::Acknowledge { fault } => parse_fault(fault)?,
        _ => Fault::NONE,
    };
    if let Command::Set(Set { value, .. }) = &arguments.command
        && !value.is_finite()
    {
        bad_input!("{value} is no stiffness; expected a finite number");
    }
    let keep = match &arguments.command {
        Command::Set(Set { keep, .. }) | Command::Arm { keep } => keep.map(|s| seconds("--keep", s, f64::INFINITY)),
        _ => None,
    };
    let keep = keep.transpose()?;
    if let Command::Record(arguments) = &arguments.command {
        arguments.check()?;
    }
    if let Command::Watch(arguments) = &arguments.command {
        arguments.check()?;
    }

    let model = match &arguments.command {
        Command::Model(arguments) => arguments.read()?,
        _ => None,
    };

    let port = Port::open(&arguments.port, arguments.baud)?;
    let (client, status) = Client::greet(port, patience).with_context(|| arguments.port.clone())?;
    let mut session = Session { client, status, json };
    match &arguments.command {
        Command::Status => session.show_status(),
        Command::Set(set) => {
            let desired = match set.unit {
                Unit::V => Desired::ScaledVolts(set.value),
                Unit::Pa => Desired::Pascal(set.value),
                Unit::NPerM => Desired::NewtonPerMetre(set.value),
            };
            if set.arm {
                session.order(Request::Arm)?;
            }
            let done = session.order(Request::Set(desired))?;
            session.show(done)?;
            session.keep(keep)
        }
        Command::Arm { .. } => {
            let done = session.order(Request::Arm)?;
            session.show(done)?;
            session.keep(keep)
        }
        Command::Disarm => {
            let done = session.order(Request::Disarm)?;
            session.show(done)
        }
        Command::Acknowledge { .. } => {
            let done = session.order(Request::Acknowledge(fault))?;
            session.show(done)
        }
        Command::Watch(arguments) => watch::run(&mut session, arguments),
        Command::Record(arguments) => record::run(&mut session, arguments),
        Command::Model(arguments) => model::run(&mut session, arguments, model.as_ref()),
    }
}

fn parse_fault(text: &str) -> Result<Fault> {
    let known = (1..=u8::MAX).map(Fault).filter(|fault| fault.name() != "unknown");
    if let Some(fault) = known.clone().find(|fault| fault.name() == text) {
        return Ok(fault);
    }
    match text.parse() {
        Ok(code) if code > 0 => Ok(Fault(code)),
        _ => {
            let names: Vec<_> = known.map(Fault::name).collect();
            bad_input!("{text} is no fault; expected {} or a number of 1 to 255", names.join(", "))
        }
    }
}
