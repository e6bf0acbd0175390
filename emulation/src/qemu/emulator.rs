//! Starts QEMU on an image, decodes its log line by line and collects every code that it writes to its DAC.
//!
//! Under `-icount shift=6,sleep=off` an instruction takes 64 ns of the board's time: runs are repeatable, slower than
//! the real chip on the board's clock and much faster than real time on the host's. 64 ns is also more than the 40 ns
//! period of the board's SysTick, so that SysTick counts single instructions; at shift 3, 8 ns, it would count every
//! fifth.

use std::fs;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use host_sim::log::{Decoder, Done, Event, Formats, Item, Line, table_row};
pub(crate) use host_sim::qemu::SHIFT;
use host_sim::qemu::{self, LINK, PROGRAM};
use tempfile::NamedTempFile;

use xtask::build::{self, Opt};
use xtask::shell;

use super::warnings::Warnings;

/// Longest time of a run on the host's clock; after it the emulator is stopped.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(120);

/// A code on the DAC's wire, and whether the amplifier is enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Written {
    pub(crate) code: u16,
    pub(crate) enabled: bool,
}

/// Zero volts, amplifier off.
pub(crate) const SAFE: Written = Written { code: 0, enabled: false };

/// A finished run.
pub(crate) struct Run {
    /// The emulator's exit code.
    pub(crate) exit: i32,
    /// The decoded log.
    pub(crate) log: Vec<Line>,
    /// Every write to the DAC.
    pub(crate) dac: Vec<Written>,
    /// Duration on the host's clock.
    pub(crate) took: Duration,
}

impl Run {
    /// The last line of a script's log: counts and digest. An error if the log ends otherwise.
    pub(crate) fn done(&self) -> Result<&Done> {
        match self.log.last() {
            Some(Line { event: Event::Done(done), .. }) => Ok(done),
            last => bail!("the log does not end with `done` but with {:?}", last.map(text)),
        }
    }

    /// The values in the first line of the log that begins with `start`.
    pub(crate) fn values(&self, start: &str) -> Result<Values<'_>> {
        let line = self.log.iter().find_map(|line| line.message.strip_prefix(start));
        Ok(Values(line.with_context(|| format!("no line of the log begins with `{start}`"))?))
    }
}

/// The words `key=value` in a line of the log.
pub(crate) struct Values<'a>(&'a str);

impl Values<'_> {
    /// The value of `key`. A missing or malformed one is an error.
    pub(crate) fn get<T: FromStr>(&self, key: &str) -> Result<T> {
        let value = self.0.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('=')?.parse().ok());
        value.with_context(|| format!("no {key} in `{}`", self.0))
    }
}

/// Runs a program that prints little to its end. One that takes longer than `most` is stopped, which is an error.
pub(crate) fn finish(program: &mut Command, most: Duration) -> Result<Output> {
    let mut child = program.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let begin = Instant::now();
    while child.try_wait()?.is_none() {
        if begin.elapsed() > most {
            child.kill()?;
            let output = child.wait_with_output()?;
            let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
            bail!("it was stopped after {} s; it said {said:?}", most.as_secs_f64());
        }
        thread::sleep(Duration::from_millis(5));
    }
    Ok(child.wait_with_output()?)
}

/// Builds an example of the package `firmware` that counts instructions and runs it to its end.
pub(crate) fn count(example: &str, features: &str, opt: Opt) -> Result<Run> {
    let run = play(&build::example(example, features, opt)?, example, SHIFT, |_| {})?;
    ensure!(run.exit == 0, "the emulator's exit code is {}", run.exit);
    Ok(run)
}

/// Formats level and message of a line, without its time.
pub(crate) fn text(line: &Line) -> String {
    let level = line.level.map_or("-".into(), |level| level.to_string().to_lowercase());
    format!("{level:<5} {}", line.message)
}

/// Starts QEMU with an image and a script, in `folder`. `host` is the QEMU character device of the serial line to a
/// host, `wire` the file for the DAC's bytes, `clock` the value of `-icount`.
fn start(folder: &Path, elf: &Path, script: &str, host: &str, wire: &Path, clock: &str) -> Result<Child> {
    qemu::Run { script, host, wire, clock }
        .command(elf)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| match error.kind() {
            ErrorKind::NotFound => anyhow::anyhow!("`{PROGRAM}` is not installed: run cargo xtask setup"),
            _ => anyhow::anyhow!("cannot start `{PROGRAM}`: {error}"),
        })
}

/// Runs the board while `work` commands it over the unix socket `socket`. `show` is called with every line of the log.
///
/// The board's clock is slowed down to the host's, because `work` depends on real time. An instruction takes 64 ns of
/// the board's time here too, so that on a slow machine the board is late but misses no tick.
pub(crate) fn obey<T>(
    elf: &Path,
    socket: &Path,
    show: impl FnMut(&str) + Send,
    work: impl FnOnce() -> Result<T>,
) -> Result<(T, Run)> {
    obey_in(shell::root(), elf, socket, show, work)
}

/// Does what [`obey`] does, with the board's files in `folder`.
pub(crate) fn obey_in<T>(
    folder: &Path,
    elf: &Path,
    socket: &Path,
    show: impl FnMut(&str) + Send,
    work: impl FnOnce() -> Result<T>,
) -> Result<(T, Run)> {
    let formats = Formats::parse(&build::read(elf)?)?;
    let wire = NamedTempFile::new()?;
    let begin = Instant::now();
    let host = qemu::Run::socket(socket);
    let mut child = start(folder, elf, LINK, &host, wire.path(), &qemu::Run::real_time())?;
    let mut output = child.stdout.take().context("the emulator has no output")?;
    let (result, log) = thread::scope(|scope| {
        let reader = scope.spawn(|| decode(formats, &mut output, show));
        let result = work();
        child.kill()?;
        let log = reader.join().map_err(|_| anyhow::anyhow!("the log's reader stopped"))?;
        anyhow::Ok((result, log?))
    })?;
    child.wait()?;
    let dac = fs::read(&wire)?;
    let _ = fs::remove_file(socket);
    // It was killed and has no exit code. When it falls behind the host's clock it prints a warning into the log, which
    // damages a line.
    Ok((result?, Run { exit: 0, log: log.lines, dac: written(&dac), took: begin.elapsed() }))
}

/// Runs the board on the unix socket `socket` until the emulator ends. `show` is called with every line of the log.
pub(crate) fn serve(elf: &Path, socket: &Path, show: impl FnMut(&str)) -> Result<()> {
    let formats = Formats::parse(&build::read(elf)?)?;
    let host = qemu::Run::socket(socket);
    let mut child = start(shell::root(), elf, LINK, &host, Path::new("/dev/null"), &qemu::Run::real_time())?;
    let mut output = child.stdout.take().context("the emulator has no output")?;
    let ended = decode(formats, &mut output, show);
    child.wait()?;
    ended.map(|_| ())
}

/// Runs `script` to its end, or for two minutes at most. `show` is called with every line of the log.
pub(crate) fn play(elf: &Path, script: &str, shift: u32, show: impl FnMut(&str) + Send) -> Result<Run> {
    play_in(shell::root(), elf, script, shift, show)
}

/// Runs `script` to its end, or for `most` on the host's clock.
pub(crate) fn play_long(elf: &Path, script: &str, most: Duration) -> Result<Run> {
    play_for(shell::root(), elf, script, SHIFT, most, |_| {})
}

/// Does what [`play`] does, with the board's files in `folder`.
pub(crate) fn play_in(
    folder: &Path,
    elf: &Path,
    script: &str,
    shift: u32,
    show: impl FnMut(&str) + Send,
) -> Result<Run> {
    play_for(folder, elf, script, shift, TIMEOUT, show)
}

fn play_for(
    folder: &Path,
    elf: &Path,
    script: &str,
    shift: u32,
    most: Duration,
    show: impl FnMut(&str) + Send,
) -> Result<Run> {
    let formats = Formats::parse(&build::read(elf)?)?;
    let wire = NamedTempFile::new()?;
    let begin = Instant::now();
    let mut child = start(folder, elf, script, "null", wire.path(), &format!("shift={shift},sleep=off"))?;
    let mut output = child.stdout.take().context("the emulator has no output")?;
    let over = AtomicBool::new(false);
    let (log, status) = thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let log = decode(formats, &mut output, show);
            over.store(true, Ordering::Relaxed);
            log
        });
        while !over.load(Ordering::Relaxed) && begin.elapsed() < most {
            thread::sleep(Duration::from_millis(5));
        }
        if !over.load(Ordering::Relaxed) {
            child.kill()?;
        }
        let log = reader.join().map_err(|_| anyhow::anyhow!("the log's reader stopped"))?;
        anyhow::Ok((log?, child.wait()?))
    })?;
    let took = begin.elapsed();
    let dac = fs::read(&wire)?;
    if took >= most {
        let last = log.lines.last().map(text);
        bail!("the emulator was stopped after {} s; the log's last line is {last:?}", took.as_secs());
    }
    Ok(Run { exit: status.code().unwrap_or(-1), log: log.whole()?, dac: written(&dac), took })
}

/// A decoded log.
pub(crate) struct Log {
    lines: Vec<Line>,
    /// Description of the first bytes that are not a frame.
    damage: Option<String>,
}

impl Log {
    /// The lines. Damaged bytes are an error.
    pub(crate) fn whole(self) -> Result<Vec<Line>> {
        match self.damage {
            None => Ok(self.lines),
            Some(damage) => bail!("the log is {damage}"),
        }
    }
}

/// Decodes a log up to its end, without QEMU's own warnings, and calls `show` with each line as `vsj log` prints it. An
/// incomplete frame at the end is dropped: it was being written when the emulator stopped.
pub(crate) fn decode(formats: Formats, source: &mut impl Read, mut show: impl FnMut(&str)) -> Result<Log> {
    let (mut decoder, mut warnings) = (Decoder::new(formats), Warnings::default());
    let mut log = Log { lines: Vec::new(), damage: None };
    let mut buffer = [0; 4096];
    loop {
        let length = source.read(&mut buffer)?;
        if length == 0 {
            return Ok(log);
        }
        for item in decoder.feed(&warnings.remove(&buffer[..length])) {
            let row = table_row(&item);
            show(&row);
            match item {
                Item::Line(line) => log.lines.push(line),
                _ => _ = log.damage.get_or_insert(row.trim_start_matches([' ', '-']).into()),
            }
        }
    }
}

/// Decodes the bytes on the DAC's wire: see the firmware's `mps2::dac`. A first byte without its second, which a stop
/// cut off, is dropped.
fn written(bytes: &[u8]) -> Vec<Written> {
    let is_pair = |pair: &&[u8]| pair[0] & 0x80 != 0 && pair[1] & 0x80 == 0;
    let code = |pair: &[u8]| Written {
        code: u16::from(pair[0] & 0x3f) << 6 | u16::from(pair[1]),
        enabled: pair[0] & 0x40 != 0,
    };
    bytes.windows(2).filter(is_pair).map(code).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_does_not_end_is_stopped() {
        let finish = |script| finish(Command::new("sh").args(["-c", script]), Duration::from_millis(300));
        assert_eq!(finish("echo out").unwrap().stdout, b"out\n");
        let error = finish("echo said; exec sleep 1000").unwrap_err().to_string();
        assert_eq!(error, "it was stopped after 0.3 s; it said \"said\\n\"");
    }

    #[test]
    fn an_incomplete_code_is_dropped() {
        let wire = [0x80, 0x00, 0xdb, 0x1b, 0xc1, 0x80, 0x00];
        assert_eq!(written(&wire), [SAFE, Written { code: 0x1b << 6 | 0x1b, enabled: true }, SAFE]);
    }
}
