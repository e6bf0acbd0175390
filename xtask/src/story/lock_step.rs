//! The emulated board and a hidden spring at its amplifier port, in lock step: see the firmware's `mps2::dac`.
//!
//! The board waits in a semihosting call, between two instructions, until the spring has answered. So none of its time
//! passes, and a run is the same each time, however busy the machine is.

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

use crate::emulator::{self, Run};
use crate::shell;

/// From the board, and to it.
const PIPES: [&str; 2] = ["to-spring", "from-spring"];
/// On the way to the board.
const NO_READING: i32 = i32::MIN;
/// Between two ticks, in s.
pub(super) const TICK_S: f64 = 1.0 / SETTINGS.rate_hz;

/// Of a sensor that always answers.
pub(super) const NEVER: Range<usize> = 0..0;

/// A tick, as the spring saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// What the amplifier was told, in V.
    pub(super) commanded_v: f64,
    /// What the spring's stiffness really was, in V.
    pub(super) stiffness_v: f64,
    /// What its sensor made of it, in V.
    pub(super) read_v: f64,
    /// What the board was told of that.
    pub(super) heard: Option<Volts>,
}

/// Runs the way up and down of this name in `folder`, the sensor silent in some ticks; the run, and every tick of the spring.
pub(super) fn run(
    elf: &Path,
    name: &str,
    folder: &Path,
    spring: Live,
    silent: Range<usize>,
) -> Result<(Run, Vec<Moment>)> {
    for pipe in PIPES.map(|name| folder.join(name)) {
        match fs::remove_file(&pipe) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error.into()),
            _ => shell::output(shell::command("mkfifo").arg(&pipe))?,
        };
    }
    thread::scope(|scope| {
        let beside = scope.spawn(|| serve(folder, spring, silent));
        let run = emulator::play_in(folder, elf, name, emulator::SHIFT, |_| {});
        // If the board never came, whoever waits for it to open a pipe does so no longer, and reads the end of the first.
        let [to, _from] = PIPES.map(|pipe| OpenOptions::new().read(true).write(true).open(folder.join(pipe)));
        drop(to);
        let moments = beside.join().map_err(|_| anyhow!("the spring's thread stopped"))?;
        Ok((run?, moments?))
    })
}

fn serve(folder: &Path, mut spring: Live, silent: Range<usize>) -> Result<Vec<Moment>> {
    let [to, from] = PIPES.map(|name| folder.join(name));
    let mut to = File::open(&to).with_context(|| format!("cannot open {}", to.display()))?;
    let mut from =
        OpenOptions::new().write(true).open(&from).with_context(|| format!("cannot open {}", from.display()))?;
    let mut moments = Vec::new();
    let mut word = [0; 2];
    loop {
        match to.read_exact(&mut word) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(moments),
            read => read?,
        }
        let word = u16::from_le_bytes(word);
        let code = if word >> 15 == 1 { word & 0xfff } else { 0 };
        let commanded_v = f64::from(code) * SETTINGS.amplifier.volts_per_code();
        let (stiffness_v, reading) = spring.hold(commanded_v, TICK_S);
        let bits = Some((reading.read * f64::from(1 << 20)) as i32);
        let heard = bits.filter(|bits| *bits != NO_READING && !silent.contains(&moments.len()));
        from.write_all(&heard.unwrap_or(NO_READING).to_le_bytes())?;
        let heard = heard.map(|bits| Volts(Signal::from_bits(bits)));
        moments.push(Moment { commanded_v, stiffness_v, read_v: reading.read, heard });
    }
}
