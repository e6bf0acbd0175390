//! `vsj log`: the firmware's log as text.

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use host_sim::log::{Decoder, Formats, Item, Summary, silence_the_decoder};
use host_sim::output::log::{Format, MOST_IN_JSON, Printer};
use host_sim::output::log_file::LogFile;
use host_sim::output::terminal::{print, wrote};
use host_sim::signals::on_ctrl_c;
use record_files::Container;
use simulation::bad_input;
use simulation::bounded_file::read;

/// Decode the firmware's log into a table and a summary, from a file or while it arrives
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj log firmware.elf capture.bin            a file that a debug probe wrote
  tail -f capture.bin | vsj log firmware.elf  live; ends with a summary
  vsj log firmware.elf capture.bin --csv      time_s,level,event,message
  vsj log firmware.elf capture.bin --json     one object, summary included
  vsj log firmware.elf capture.bin --out log.mcap  for Foxglove, PlotJuggler

Exit codes: 0 decoded completely, 1 damaged or cut off, with the readable part printed, 2 not the log of this ELF file.")]
pub(crate) struct Arguments {
    /// The ELF file of the build that wrote the log, at most 256 MiB
    #[arg(value_name = "ELF")]
    elf: PathBuf,
    /// The log as sent by the MCU; `-` is stdin
    #[arg(value_name = "FILE", default_value = "-")]
    file: PathBuf,
    /// Print CSV with the columns time_s,level,event,message, and the summary as comments
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// One JSON object on stdout, at the end; for at most 1 000 000 lines
    #[arg(long)]
    json: bool,
    /// Write the lines to this MCAP or Parquet file, which has its name when it is complete, and print the summary
    #[arg(long, value_name = "FILE.mcap|FILE.parquet", conflicts_with_all = ["csv", "json"])]
    out: Option<PathBuf>,
}

/// Largest size of an ELF file, in MiB; one of the firmware has 2 to 20 with its debug information.
const MOST_ELF_MIB: usize = 256;

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    silence_the_decoder();
    let formats = match Formats::parse(&read(&arguments.elf, MOST_ELF_MIB, "an ELF file")?) {
        Ok(formats) => formats,
        Err(error) => bad_input!("{}: {error:#}", arguments.elf.display()),
    };
    let source = open(&arguments.file)?;
    let file = arguments.out.as_deref().map(log_file).transpose()?;
    decode(source, formats, arguments, file)
}

/// Creates the file of `--out`.
fn log_file(path: &Path) -> Result<LogFile> {
    match Container::of(path) {
        Some(container) => LogFile::create(path, container),
        None => {
            bad_input!("{}: expected a name that ends in .mcap or .parquet; CSV is printed by --csv", path.display())
        }
    }
}

fn open(path: &Path) -> Result<Box<dyn Read>> {
    if path == Path::new("-") {
        if io::stdin().is_terminal() {
            bad_input!("stdin is a terminal; expected a FILE, or a log from a pipe");
        }
        // Ctrl-C reaches the whole pipeline: the writer ends first, then this program prints its summary. A second one ends it.
        on_ctrl_c(|| ());
        return Ok(Box::new(io::stdin()));
    }
    // A folder can be opened like a file and fails only when it is read.
    let file = match std::fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => Err(ErrorKind::IsADirectory.into()),
        _ => File::open(path),
    };
    match file {
        Ok(file) => Ok(Box::new(file)),
        Err(error) => bad_input!("{}: cannot be read: {error}; expected the log of the firmware", path.display()),
    }
}

fn decode(mut source: Box<dyn Read>, formats: Formats, arguments: &Arguments, mut file: Option<LogFile>) -> Result<()> {
    let encoding = formats.encoding();
    let mut decoder = Decoder::new(formats);
    let mut summary = Summary::default();
    let mut buffer = [0; 1 << 13];
    let mut broken = None;
    let mut printer = Printer::new(match (arguments.json, arguments.csv) {
        _ if file.is_some() => Format::Summary,
        (true, _) => Format::Json,
        (_, true) => Format::Csv,
        _ => Format::Table,
    });
    loop {
        // Without a reader, the rest of a live log would be awaited in vain.
        if !printer.flush()? {
            return Ok(());
        }
        let read = match source.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                broken = Some(error);
                break;
            }
        };
        for item in decoder.feed(&buffer[..read]) {
            summary.add(&item);
            if let (Some(file), Item::Line(line)) = (&mut file, &item) {
                file.line(line)?;
            }
            printer.item(item);
        }
        if printer.is_full() {
            let name = name(&arguments.file);
            bad_input!("{name}: more than {MOST_IN_JSON} lines; expected at most that with --json, or --csv");
        }
    }
    if let Some(item) = decoder.finish() {
        summary.add(&item);
        printer.item(item);
    }
    let verdict = verdict(arguments, &summary);
    // Without a line there is nothing that could replace an existing file.
    let file = file.filter(|_| summary.lines > 0);
    let wrote = file.map(LogFile::finish).transpose()?.map(|path| wrote(&[path]));
    printer.end(encoding, summary)?;
    print(&wrote.unwrap_or_default())?;
    let name = name(&arguments.file);
    match broken {
        Some(error) => {
            Err(anyhow::Error::msg(error.to_string())).with_context(|| format!("{name}: cannot be read further"))
        }
        None => verdict,
    }
}

/// The error of a log that is empty, damaged, cut off, or of another build.
fn verdict(arguments: &Arguments, summary: &Summary) -> Result<()> {
    let (name, elf) = (name(&arguments.file), arguments.elf.display());
    let Summary { lines, damaged_frames, damaged_bytes, cut_off_bytes, .. } = summary;
    if *lines == 0 && summary.is_whole() {
        bad_input!("{name}: empty; expected the log of the firmware");
    }
    if *lines == 0 && *damaged_frames > 0 {
        bad_input!("{name}: none of its frames fits {elf}; expected the log of this build");
    }
    let mut wrong = Vec::new();
    if let Some(first) = summary.first_damage {
        wrong.push(format!("{damaged_frames} damaged frames ({damaged_bytes} bytes), the first at byte {first}"));
    }
    if *cut_off_bytes > 0 {
        wrong.push(format!("cut off, the last {cut_off_bytes} bytes are an incomplete frame"));
    }
    if !wrong.is_empty() {
        // Frames have no checksum: a few frames of another build may be decoded.
        let foreign = if damaged_frames > lines { "; is it the log of another build?" } else { "" };
        bail!("{name}: {}; {lines} lines were read{foreign}", wrong.join("; "));
    }
    Ok(())
}

fn name(path: &Path) -> String {
    if path == Path::new("-") { "stdin".to_owned() } else { path.display().to_string() }
}
