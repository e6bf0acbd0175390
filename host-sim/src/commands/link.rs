//! `vsj link`: the MCU over its serial link.

mod model;
mod record;
mod watch;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand, ValueEnum};
use host_sim::link::{Client, Failure, Patience, Port, StatusReport};
use link::{Desired, Fault, Reason, Request, State, Status, WireVolts};
use serde::Serialize;
use simulation::bad_input;
use simulation::bad_input::number;

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
long as a command that keeps talking, --keep, watch or record. Each request is sent every 0.1 s until it is answered, for \
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

/// What `set`, `arm`, `disarm` and `acknowledge` print with `--json`.
#[derive(Serialize)]
struct Done {
    state: &'static str,
    target_v: f64,
}

/// An open connection, and what all commands need of it.
struct Talk {
    client: Client,
    status: Status,
    json: bool,
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
    let mut talk = Talk { client, status, json };
    match &arguments.command {
        Command::Status => talk.show_status(),
        Command::Set(set) => {
            let desired = match set.unit {
                Unit::V => Desired::ScaledVolts(set.value),
                Unit::Pa => Desired::Pascal(set.value),
                Unit::NPerM => Desired::NewtonPerMetre(set.value),
            };
            if set.arm {
                talk.order(Request::Arm)?;
            }
            let done = talk.order(Request::Set(desired))?;
            talk.show(done)?;
            talk.keep(keep)
        }
        Command::Arm { .. } => {
            let done = talk.order(Request::Arm)?;
            talk.show(done)?;
            talk.keep(keep)
        }
        Command::Disarm => {
            let done = talk.order(Request::Disarm)?;
            talk.show(done)
        }
        Command::Acknowledge { .. } => {
            let done = talk.order(Request::Acknowledge(fault))?;
            talk.show(done)
        }
        Command::Watch(arguments) => watch::run(&mut talk, arguments),
        Command::Record(arguments) => record::run(&mut talk, arguments),
        Command::Model(arguments) => model::run(&mut talk, arguments, model.as_ref()),
    }
}

impl Talk {
    /// A stiffness out of reach is the caller's to mend; everything else failed.
    fn order(&mut self, request: Request) -> Result<(State, WireVolts)> {
        match self.client.order(request) {
            Ok(done) => Ok(done),
            Err(Failure::Refused(reason @ Reason::OutOfRange { .. })) => {
                let unit = match request {
                    Request::Set(Desired::Pascal(_)) => "Pa",
                    Request::Set(Desired::NewtonPerMetre(_)) => "N/m",
                    _ => "V",
                };
                bad_input!("{}: {reason} {unit}", self.client.name())
            }
            Err(failure) => Err(failure).with_context(|| self.client.name().to_owned()),
        }
    }

    fn refresh(&mut self) -> Result<Status> {
        self.status = self.client.status().with_context(|| self.client.name().to_owned())?;
        Ok(self.status)
    }

    fn show_status(&self) -> Result<()> {
        let report = StatusReport::new(&self.status);
        if self.json {
            println!("{}", serde_json::to_string(&report)?);
        } else {
            print!("{}", report.text());
        }
        Ok(())
    }

    fn show(&self, (state, target): (State, WireVolts)) -> Result<()> {
        let done = Done { state: state.name(), target_v: target.to_f64() };
        if self.json {
            println!("{}", serde_json::to_string(&done)?);
        } else {
            println!("{}, target {:.3} V", done.state, done.target_v);
        }
        Ok(())
    }

    /// How often the MCU has to hear us: five times within its limit.
    fn heartbeat(&self) -> Duration {
        let limit_s = f64::from(self.status.silence_limit_ticks) / f64::from(self.status.rate_hz.max(1));
        Duration::from_secs_f64((limit_s / 5.0).clamp(0.01, 1.0))
    }

    /// An error unless armed. Ramping is: the frame that told us so has just ended it.
    fn still_armed(&mut self, state: State) -> Result<()> {
        if !matches!(state, State::Armed | State::Ramping) {
            self.refresh()?;
            bail!("{}: no longer armed: {state}, fault {}", self.client.name(), self.status.fault);
        }
        Ok(())
    }

    /// Stays connected, and says when the MCU no longer does what it was told.
    fn keep(&mut self, time: Option<Duration>) -> Result<()> {
        let Some(time) = time else { return Ok(()) };
        stop_on_interrupt()?;
        let (start, pause) = (Instant::now(), self.heartbeat());
        while start.elapsed() < time && !stopped() {
            let (state, _) = self.order(Request::Heartbeat)?;
            self.still_armed(state)?;
            std::thread::sleep(pause.min(time.saturating_sub(start.elapsed())));
        }
        Ok(())
    }
}

static STOP: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C only ends the loop that asks [`stopped`]; a second one ends the program.
fn stop_on_interrupt() -> Result<()> {
    Ok(ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })?)
}

fn stopped() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// A positive time, `most` seconds at the most; an infinite one is as long as a `Duration` goes.
fn seconds(option: &str, value: f64, most: f64) -> Result<Duration> {
    if !(value > 0.0 && value <= most) {
        bad_input!("{option} {}: expected a positive number of seconds", number(value));
    }
    Ok(Duration::try_from_secs_f64(value).unwrap_or(Duration::MAX))
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
