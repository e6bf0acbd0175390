//! `cargo xtask talk`: a host commands the emulated firmware. Valid requests are followed, hostile frames are not, no
//! tick is missed, a model and settings that `vsj link` sends are run after the restart, and a capture has every tick at the
//! highest rate.

mod hostile;

use std::fmt;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail, ensure};
use host_sim::link::{Client, Failure, Patience, Port};
use host_sim::log::{Item, Level, Summary};
use link::{
    BlockId, Desired, Fault, Frame, Nonce, Reason, Receiver, Reply, Request, Sequence, State, Status, WireVolts,
};
use simulation::plant_file;

use xtask::build::{self, Board, Opt};
use xtask::tally::Tally;
use xtask::{setup, shell};

use crate::qemu::emulator::{self, SAFE, Written};
use hostile::{Dice, HOSTILE, hostile};

/// Longest time for all hostile frames. They usually need a minute, because the emulated line transfers single bytes.
const TIME: Duration = Duration::from_secs(300);
/// Hostile frames between two valid ones, one of each kind. The valid ones keep the host's time-out from expiring.
const BATCH: u32 = 9;
/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time since the last valid frame after which the host's time-out of 0.5 s may have expired on a busy machine. It is
/// no error of the board then.
const LATE: Duration = Duration::from_millis(400);
/// A model for `vsj link`.
const PLANT: &str = "docs/plant.toml";
/// The target that hostile frames must not change, in V.
const TARGET_V: f64 = 300.0;

/// Builds the image, talks to it and prints the result.
pub(crate) fn command() -> Result<()> {
    setup::emulator()?;
    println!("{}", run(&build::image(Board::Mps2, Opt::S)?)?);
    Ok(())
}

/// Attempts to talk to a board that is never late. Its clock follows the host's, and a busy machine delays it.
const ATTEMPTS: u32 = 3;

/// The board was late. If it is so in each attempt, that is the image's fault.
#[derive(Debug)]
struct Delayed;

impl fmt::Display for Delayed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("ticks were missed, or a task its watchdog")
    }
}

/// Starts the board, talks to it and returns the result in one line.
pub(crate) fn run(elf: &Path) -> Result<String> {
    for _ in 1..ATTEMPTS {
        match attempt(elf) {
            Err(error) if error.is::<Delayed>() => eprintln!("link: once more, {error:#}"),
            done => return done,
        }
    }
    attempt(elf)
}

fn attempt(elf: &Path) -> Result<String> {
    let vsj = build::vsj()?;
    let socket = elf.with_file_name(format!("link-{}", std::process::id()));
    let name = format!("unix:{}", socket.display());
    let ((said, armed), run) = emulator::obey(
        elf,
        &socket,
        |_| {},
        || {
            let work = || {
                let polite = courtesy(&name)?;
                let (hostile, armed) = hostility(&name)?;
                let old = recording(&name)?;
                let kept = model(&vsj, &name)?;
                let fast = settings(&vsj, &name)?;
                Ok((format!("{polite}; {hostile}; {old}; {kept}; {fast}"), 5 + armed))
            };
            work().map_err(|error: anyhow::Error| if delayed(&name) { error.context(Delayed) } else { error })
        },
    )?;
    let mut summary = Summary::default();
    for line in run.log {
        ensure!(line.level < Some(Level::Error), "the log says {:?}", line.message);
        summary.add(&Item::Line(line));
    }
    let missed = summary.overruns.context("the log has no summary")?;
    if missed > 0 {
        return Err(anyhow!("the log says {missed}").context(Delayed));
    }
    let driven = wire(&run.dac, armed)?;
    let count = |what: &str, count| (what.to_owned(), count);
    Tally::now([
        count("hostile frames to the emulated board", u64::from(HOSTILE)),
        count("ticks on the wire meanwhile", run.dac.len() as u64),
        count("ticks missed meanwhile", missed),
    ])?
    .write("talk")?;
    Ok(format!("{said}; {} ticks on the wire, {driven} with voltage, {missed} missed", run.dac.len()))
}

/// Whether the board says that it has missed ticks, or a task its watchdog.
fn delayed(name: &str) -> bool {
    let status = || {
        let mut line = Line::open(name)?;
        line.greet()?;
        line.status()
    };
    let late = [Fault::from(model::supervisor::Fault::Overrun), model::supervisor::Fault::Watchdog.into()];
    status().is_ok_and(|status| status.overruns > 0 || late.contains(&status.fault))
}

/// The number of writes with voltage on the DAC's wire. An error unless the wire begins and ends with zero and the
/// amplifier was enabled `armed` times.
fn wire(dac: &[Written], armed: usize) -> Result<usize> {
    ensure!(dac.first() == Some(&SAFE) && dac.last() == Some(&SAFE), "the wire does not begin and end with zero");
    let parts = dac.chunk_by(|a, b| a.enabled == b.enabled).filter(|part| part[0].enabled).count();
    ensure!(parts == armed, "the board was armed {armed} times, its amplifier enabled {parts} times");
    ensure!(dac.iter().all(|written| written.enabled || *written == SAFE), "a voltage without enable");
    Ok(dac.iter().filter(|written| written.enabled).count())
}

/// Valid requests through the host's library, which `vsj link` uses.
fn courtesy(name: &str) -> Result<String> {
    let (mut client, status) = Client::greet(open(name)?, Patience::of(PATIENCE))?;
    expect(&status, State::Disarmed, 0.0)?;
    ensure!(status.rate_hz == 1000 && status.last_fault == Fault::NONE, "{status:?}");

    let set = |volts| Request::Set(Desired::ScaledVolts(volts));
    refused(client.order(set(TARGET_V)), |reason| matches!(reason, Reason::NotArmed))?;
    ensure!(client.order(Request::Arm)? == (State::Armed, WireVolts(0)), "arming starts at zero");
    ensure!(
        client.order(set(TARGET_V))? == (State::Armed, WireVolts::from_f64(TARGET_V)),
        "the target is not followed"
    );
    refused(client.order(set(900.0)), |reason| matches!(reason, Reason::OutOfRange { .. }))?;
    client.order(Request::Stream { every_ticks: 10 })?;
    let samples: Vec<_> = client.samples(Duration::from_millis(300))?.collect();
    ensure!(samples.len() >= 10, "{} samples in 0.3 s", samples.len());
    ensure!(samples.is_sorted_by(|a, b| a.tick < b.tick), "samples come out of order");
    let (first, last) = samples.first().zip(samples.last()).context("no sample")?;
    let periods = (last.tick - first.tick) / 10;
    ensure!(samples.len() as u64 <= periods + 2, "{} samples in {periods} periods", samples.len());
    ensure!(last.state == State::Armed && last.code > 0 && last.target.to_f64() == TARGET_V, "{last:?}");
    ensure!(client.order(Request::Disarm)?.0 == State::Disarmed, "disarm is followed");
    expect(&client.status()?, State::Disarmed, 0.0)?;

    // Armed again, then silent: the board disarms after 0.5 s and a ramp of 300 V at 700 V/s.
    client.order(Request::Arm)?;
    client.order(set(TARGET_V))?;
    thread::sleep(Duration::from_millis(1500));
    let status = client.status()?;
    expect(&status, State::Disarmed, 0.0)?;
    ensure!(status.sample.code == 0, "{status:?}");
    Ok(format!("armed, {TARGET_V} V set, {} samples, disarmed; disarmed by silence", samples.len()))
}

/// Hostile frames while the board is armed at a target. Returns the result and how often the board was armed.
fn hostility(name: &str) -> Result<(String, usize)> {
    let mut line = Line::open(name)?;
    line.greet()?;
    let before = line.status()?;
    expect(&before, State::Disarmed, 0.0)?;
    line.arm()?;

    let mut dice = Dice::new(20_261_121);
    let (begin, mut sent, mut asked, mut armed) = (Instant::now(), 0, 2, 1);
    let mut heard = Instant::now();
    let mut bytes = 0;
    while sent < HOSTILE && begin.elapsed() < TIME {
        for _ in 0..BATCH {
            let frame = hostile(&mut dice, sent, line.session, line.next);
            bytes += frame.len();
            line.port.write(&frame)?;
            sent += 1;
        }
        asked += 1;
        let answer = line.ask(&Request::Heartbeat)?;
        if answer != at_target() {
            let gone = matches!(answer, Reply::Ack { state: State::Ramping | State::Disarmed, .. });
            ensure!(gone && heard.elapsed() > LATE, "after {sent} hostile frames: {answer:?}");
            line.ask(&Request::Disarm)?;
            line.arm()?;
            (asked, armed) = (asked + 3, armed + 1);
        }
        heard = Instant::now();
    }
    let took = begin.elapsed().as_secs_f64();
    ensure!(sent >= HOSTILE, "only {sent} of {HOSTILE} frames in {took:.1} s");

    let after = line.status()?;
    expect(&after, State::Armed, TARGET_V)?;
    let (old, new) = (before.counters, after.counters);
    // The status request is accepted as well.
    let accepted = new.accepted - old.accepted;
    ensure!(accepted == asked + 1, "{accepted} requests accepted, {} made: {new:?}", asked + 1);
    ensure!(new.repeated == old.repeated, "a frame was counted as a repeated one: {new:?}");
    ensure!(after.overruns == 0, "{} ticks missed", after.overruns);
    let kinds = [
        new.damaged - old.damaged,
        new.oversize - old.oversize,
        new.bad_version - old.bad_version,
        new.out_of_order - old.out_of_order,
        new.unknown - old.unknown,
    ];
    ensure!(kinds.iter().all(|count| *count > 50), "not every kind arrived: {new:?}");
    let answer = line.ask(&Request::Disarm)?;
    ensure!(matches!(answer, Reply::Ack { state: State::Disarmed, .. }), "{answer:?}");
    // The log prints its counters every second.
    thread::sleep(Duration::from_millis(1200));
    let [damaged, oversize, version, order, unknown] = kinds;
    let said = format!(
        "{sent} hostile frames ({bytes} bytes) in {took:.1} s while armed: none followed ({damaged} damaged, {oversize} \
         oversize, {version} of another version, {order} out of order, {unknown} unknown), {accepted} good ones all \
         followed, {} overruns, armed {armed} times",
        after.overruns
    );
    Ok((said, armed))
}

/// Plays the frames of an earlier session, and the last frame of the running one, while the board is armed and its host is
/// silent: they keep nothing alive.
fn recording(name: &str) -> Result<String> {
    let mut line = Line::open(name)?;
    line.greet()?;
    line.arm()?;
    ensure!(line.ask(&Request::Heartbeat)? == at_target(), "no heartbeat");
    let recorded = std::mem::take(&mut line.sent);
    line.ask(&Request::Disarm)?;
    line.greet()?;
    line.arm()?;
    line.sent.clear();
    ensure!(line.ask(&Request::Heartbeat)? == at_target(), "no heartbeat");
    let (begin, mut played) = (Instant::now(), 0);
    while begin.elapsed() < Duration::from_millis(1500) {
        line.port.write(&recorded)?;
        line.port.write(&line.sent)?;
        played += 6;
        thread::sleep(Duration::from_millis(50));
    }
    // Above the numbers of the answers that were not read.
    (line.session, line.next) = (Nonce::NONE, Sequence(2000));
    line.ask(&Request::Hello)?;
    let status = line.status()?;
    expect(&status, State::Disarmed, 0.0)?;
    ensure!(status.sample.code == 0, "{status:?}");
    Ok(format!("{played} recorded frames kept no silent host's voltage"))
}

/// Sends a model with `vsj link`, to a board without a file for its flash, as `cargo xtask emulate --link` starts it.
fn model(vsj: &Path, name: &str) -> Result<String> {
    let payload = plant_file::load(&shell::root().join(PLANT).display().to_string())?.wire()?.payload();
    let sent = BlockId::of(1, &payload.context("a model that does not fit")?);
    let mut command = shell::command(vsj);
    let models = shell::json(command.args(["link", name, "model", PLANT, "--timeout", "10", "--json"]))?;
    let expected = serde_json::to_value(sent)?;
    for which in ["active", "stored"] {
        ensure!(models[which] == expected, "the {which} model is {} instead of {expected}", models[which]);
    }
    Ok(format!("runs the model that was sent, {sent}"))
}

/// Sends settings with the highest rate, captures every tick of five seconds with them, and goes back to the built-in ones.
fn settings(vsj: &Path, name: &str) -> Result<String> {
    const RATE_HZ: u64 = 2000;
    const CAPTURE_S: u64 = 5;
    let folder = tempfile::tempdir()?;
    let path = |file: &str| folder.path().join(file);
    let run = |arguments: &[&str]| {
        let mut command = shell::command(vsj);
        shell::json(command.args(["link", name, "--timeout", "10", "--json"]).args(arguments))
    };
    let (file, input, out) = (path("settings.toml"), path("input.csv"), path("capture.csv"));
    let [file, input, out] = [&file, &input, &out].map(|path| path.display().to_string());
    let reach_v = 400.0;
    fs::write(&file, format!("schema = 1\nrate_hz = {RATE_HZ}\n[amplifier]\nfull_scale_v = 450\nmax_v = {reach_v}\n"))?;
    fs::write(&input, format!("time_s,voltage_v\n0,100\n2,300\n4,50\n{CAPTURE_S},50\n"))?;
    let sent = run(&["settings", &file])?;
    ensure!(sent["active"]["number"] == 1 && sent["active"] == sent["stored"], "other settings run: {sent}");
    let status = run(&["status"])?;
    let runs = status["rate_hz"] == RATE_HZ && status["highest_v"] == reach_v && status["overruns"] == 0;
    ensure!(runs, "the settings do not run: {status}");

    let captured = run(&["capture", "--input", &input, "--arm", "--out", &out])?;
    let (rows, room) = (&captured["rows"], &captured["room"]);
    ensure!(*rows == RATE_HZ * CAPTURE_S && captured["lost"] == 0, "rows are missing: {captured}");
    let text = fs::read_to_string(&out)?;
    let voltages: Vec<f64> = text.lines().skip(2).filter_map(|row| row.split(',').nth(1)?.parse().ok()).collect();
    let highest_v = voltages.iter().copied().fold(0.0, f64::max);
    ensure!(*rows == voltages.len(), "{} rows in the file: {captured}", voltages.len());
    ensure!(highest_v > 0.9 * reach_v && highest_v <= reach_v, "the highest voltage is {highest_v} V");
    let overruns = &run(&["status"])?["overruns"];
    ensure!(*overruns == 0, "{overruns} ticks missed at {RATE_HZ} Hz");

    let back = run(&["settings", "--default"])?;
    ensure!(back["settings"]["rate_hz"] == 1000 && back["active"]["number"] == 2, "other settings run: {back}");
    Ok(format!("runs settings that were sent; {rows} rows at {RATE_HZ} Hz captured, none missing, room for {room}"))
}

/// Opens the serial line to the board. Tries again for two seconds while the emulator is starting.
pub(crate) fn open(name: &str) -> Result<Port> {
    let begin = Instant::now();
    loop {
        match Port::open(name, 115_200, Duration::from_secs(5)) {
            Ok(port) => return Ok(port),
            // The emulator is still starting.
            Err(error) if begin.elapsed() > PATIENCE => return Err(error),
            Err(_) => thread::sleep(Duration::from_millis(20)),
        }
    }
}

fn expect(status: &Status, state: State, target_v: f64) -> Result<()> {
    let sample = &status.sample;
    let as_expected = sample.state == state && sample.target.to_f64() == target_v && status.overruns == 0;
    ensure!(as_expected && status.fault == Fault::NONE, "expected {state}, {target_v} V, no overruns: {status:?}");
    Ok(())
}

fn refused<T: std::fmt::Debug>(result: Result<T, Failure>, why: impl Fn(&Reason) -> bool) -> Result<()> {
    match result {
        Err(Failure::Refused(reason)) if why(&reason) => Ok(()),
        Err(failure) => Err(anyhow!(failure)),
        Ok(done) => bail!("not refused but {done:?}"),
    }
}

/// The answer of a board that is armed at the target.
fn at_target() -> Reply {
    Reply::Ack { state: State::Armed, target: WireVolts::from_f64(TARGET_V) }
}

/// A serial line that sends every request once, unlike the host's library, which repeats.
struct Line {
    port: Port,
    receiver: Receiver,
    session: Nonce,
    next: Sequence,
    /// Every frame that was sent.
    sent: Vec<u8>,
}

impl Line {
    fn open(name: &str) -> Result<Self> {
        let (receiver, session, next) = (Receiver::new(), Nonce::NONE, Sequence(1000));
        Ok(Self { port: open(name)?, receiver, session, next, sent: Vec::new() })
    }

    /// Asks for a session, as after a restart of the host.
    fn greet(&mut self) -> Result<()> {
        self.session = Nonce::NONE;
        self.next = Sequence(1000);
        self.ask(&Request::Hello).map(drop)
    }

    fn ask(&mut self, request: &Request) -> Result<Reply> {
        let number = self.next;
        self.next = number.next();
        let frame = Frame::new(self.session.stamp(number), request);
        self.sent.extend(frame.as_bytes());
        self.port.write(frame.as_bytes())?;
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            let mut buffer = [0; 1024];
            let count = self.port.read(&mut buffer)?;
            let mut found = None;
            for byte in &buffer[..count] {
                if let Some(packet) = self.receiver.on_byte(*byte)
                    && packet.sequence == number
                {
                    if *request == Request::Hello {
                        self.session = packet.session();
                    }
                    found = Some(packet.read::<Reply>().map_err(|error| anyhow!("{error:?}"))?);
                }
            }
            if let Some(reply) = found {
                return Ok(reply);
            }
        }
        bail!("no answer to {request:?}, number {}", number.0)
    }

    /// Arms the board and sets the target, in two requests.
    fn arm(&mut self) -> Result<()> {
        self.ask(&Request::Arm)?;
        let answer = self.ask(&Request::Set(Desired::ScaledVolts(TARGET_V)))?;
        ensure!(answer == at_target(), "{answer:?}");
        Ok(())
    }

    fn status(&mut self) -> Result<Status> {
        match self.ask(&Request::Status)? {
            Reply::Status(status) => Ok(status),
            other => bail!("{other:?} instead of a status"),
        }
    }
}
