//! Runs the emulated board with a hidden spring at its amplifier port, in lock step: see the firmware's `mps2::dac`.
//!
//! The board waits in a semihosting call, between two instructions, until the spring has answered. No time of the
//! board's passes meanwhile, so that a run is repeatable on a busy machine.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::ops::Range;
use std::path::Path;
use std::thread;

use anyhow::{Context, Result, anyhow};
use firmware::settings::SETTINGS;
use model::Volts;
use model::units::Signal;
use validation::ground_truth::live::Live;
use validation::ground_truth::{Cause, Effect};
use xtask::shell;

use crate::qemu::emulator::{self, Run};

/// Names of the pipes from the board and to it.
const PIPES: [&str; 2] = ["to-spring", "from-spring"];
/// Word to the board in place of a reading when the sensor is silent.
const NO_READING: i32 = i32::MIN;
/// Largest stiffness that a sensor has to show, in V.
const TOP_V: f64 = 500.0;
/// Period of the control tick, in s.
pub(super) const TICK_S: f64 = 1.0 / SETTINGS.rate_hz;

/// What happens to the spring or to its sensor during a run.
#[derive(Clone, Debug)]
pub(super) enum Disturbance {
    /// Nothing.
    None,
    /// The sensor is silent in these ticks.
    Silent(Range<usize>),
    /// From this tick on the sensor repeats its last reading.
    Stuck(usize),
    /// From this tick on the spring has another gain.
    Gain(usize, f64),
}

impl Disturbance {
    /// What the board receives in a tick instead of the reading `bits`; `before` is what it received in the tick before.
    fn received(&self, tick: usize, bits: i32, before: Option<i32>) -> Option<i32> {
        match self {
            Self::Silent(ticks) if ticks.contains(&tick) => None,
            Self::Stuck(from) if tick >= *from => before,
            _ => Some(bits),
        }
    }
}

/// One tick at the spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// Commanded voltage, in V.
    pub(super) commanded_v: f64,
    /// True stiffness, expressed as the equivalent static voltage, in V.
    pub(super) stiffness_v: f64,
    /// The sensor's reading of the stiffness, in V.
    pub(super) read_v: f64,
    /// The reading that the board received; `None` from a silent sensor.
    pub(super) received: Option<Volts>,
}

/// Runs the script `name` in `folder` with a `disturbance`. Returns the run and every tick at the spring.
pub(super) fn run(
    elf: &Path,
    name: &str,
    folder: &Path,
    spring: Live,
    disturbance: &Disturbance,
) -> Result<(Run, Vec<Moment>)> {
    for pipe in PIPES.map(|name| folder.join(name)) {
        match fs::remove_file(&pipe) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error.into()),
            _ => shell::output(shell::command("mkfifo").arg(&pipe))?,
        };
    }
    thread::scope(|scope| {
        let server = scope.spawn(|| serve(folder, spring, disturbance));
        let run = emulator::play_in(folder, elf, name, emulator::SHIFT, |_| {});
        // If the board did not start, this ends the server's wait for it to open a pipe.
        let [to, _from] = PIPES.map(|pipe| OpenOptions::new().read(true).write(true).open(folder.join(pipe)));
        drop(to);
        let moments = server.join().map_err(|_| anyhow!("the spring's thread stopped"))?;
        Ok((run?, moments?))
    })
}

/// The effect of a spring with this gain.
fn stiffer(gain: f64) -> Effect {
    Effect { cause: Cause::GainError, form: 0, full_size: vec![gain], neutral: vec![1.0], size: 1.0 }
}

fn serve(folder: &Path, mut spring: Live, disturbance: &Disturbance) -> Result<Vec<Moment>> {
    let [to, from] = PIPES.map(|name| folder.join(name));
    let mut to = File::open(&to).with_context(|| format!("cannot open {}", to.display()))?;
    let mut from =
        OpenOptions::new().write(true).open(&from).with_context(|| format!("cannot open {}", from.display()))?;
    let (mut moments, mut before) = (Vec::new(), None);
    let mut word = [0; 2];
    loop {
        match to.read_exact(&mut word) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(moments),
            read => read?,
        }
        let word = u16::from_le_bytes(word);
        let code = if word >> 15 == 1 { word & 0xfff } else { 0 };
        let commanded_v = f64::from(code) * SETTINGS.amplifier.volts_per_code();
        if let Disturbance::Gain(tick, gain) = disturbance
            && *tick == moments.len()
        {
            spring.change(&[stiffer(*gain)], TOP_V);
        }
        let (stiffness_v, reading) = spring.hold(commanded_v, TICK_S);
        let bits = (reading.read * f64::from(1 << 20)) as i32;
        let received = disturbance.received(moments.len(), bits, before).filter(|bits| *bits != NO_READING);
        before = received;
        from.write_all(&received.unwrap_or(NO_READING).to_le_bytes())?;
        let received = received.map(|bits| Volts(Signal::from_bits(bits)));
        moments.push(Moment { commanded_v, stiffness_v, read_v: reading.read, received });
    }
}
