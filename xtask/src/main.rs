//! The project's chores, one command each.

mod audit;
mod bench;
mod blocks;
mod boot;
mod drill;
mod elf;
mod emulate;
mod emulator;
mod flash;
mod image;
mod proof;
mod python;
mod rivals;
mod setup;
mod shell;
mod size;
mod stack;
mod story;
mod talk;
mod test;
mod thumb;
mod variant;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use variant::Variant;

/// The project's chores, one command each.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    after_help = "\
Examples:
  cargo xtask setup            make a fresh machine ready
  cargo xtask test             everything that must pass before a change goes in
  cargo xtask emulate          the firmware on the report's stair, under QEMU
  cargo xtask image            the MCU's images: ELF, bin, hex; --controller fast, --limit-v 1000 for others
  cargo xtask boot             that image on register models: safe at boot and after a fault?
  cargo xtask bench --json     speed beside Python, as JSON

Exit codes: 0 success, 1 the work failed, 2 bad arguments."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what a fresh machine lacks
    ///
    /// Reads rust-toolchain.toml and has rustup add the toolchain, the components and the MCU's target; installs QEMU
    /// with apt-get.
    /// Harmless when repeated; needs the network only if something is missing.
    Setup,
    /// Setup, then every check and test
    Test,
    /// Run the firmware on the report's stair under QEMU
    ///
    /// 70 s at 1 kHz, in seconds. Shows the decoded log, and exits with 1 unless every DAC code and every estimate is
    /// the host's, bit for bit, and no tick was missed.
    ///
    /// With --link it plays nothing and obeys `vsj link`, in real time, its interlock closed. With --rivals it counts
    /// what a tick of other controllers takes, and exits with 1 unless each leads the spring where it should.
    #[command(after_help = "\
Examples:
  cargo xtask emulate --json | jq .instructions_per_tick
  cargo xtask emulate --rivals                         instructions a tick, beside other controllers
  cargo xtask emulate --blocks                         instructions a tick, by spring and controller
  cargo xtask emulate --link /tmp/mcu.sock             then: vsj link unix:/tmp/mcu.sock status")]
    Emulate(emulate::Args),
    /// Everything that the emulated firmware must show
    ///
    /// Bit for bit the host's on the stair and on random commands at opt-levels s and 3, instructions per tick, no panic
    /// in the tick, no heap, every fault drill. A part of `test`.
    Proof,
    /// Run the fault drills under QEMU
    ///
    /// Panic, hard fault, stack overflow, the same with floats in use, stalled task, hanging control, the same with
    /// interrupts off, overrun, interlock, silent host. Exits with 1 unless the voltage goes away on the DAC's wire and
    /// the log is the approved one.
    Drill(drill::Args),
    /// Let a host talk to the emulated firmware
    ///
    /// Arms it, sets a stiffness, falls silent; then 10 000 damaged, random, late and foreign frames while armed,
    /// in about a minute. Exits with 1 if one of them is followed or a tick is missed. A part of `test`.
    Talk,
    /// The whole story: run, diagnose, extend, run again
    ///
    /// The emulated board leads a spring with a hidden effect up and down a stair, in lock step; `vsj diagnose` names the
    /// cause; the extended model goes over the link, is checked, stored and run after a restart. Prints the true stiffness
    /// error before and after. With --feedback the board hears the spring's sensor instead, and then one that falls silent.
    #[command(after_help = "\
Examples:
  cargo xtask story                                three effects, as in `test`
  cargo xtask story --effect hysteresis gain-error
  cargo xtask story --controller fast
  cargo xtask story --feedback                     the paper's model, without the sensor and with it
  cargo xtask story --all --json")]
    Story(story::Args),
    /// Write the image to the real board and show its log (probe-rs)
    ///
    /// The log's first line says which controller runs, a second one that the amplifier reaches 1000 V. A stored model stays;
    /// one that the controller cannot run is a fault until it is acknowledged.
    #[command(after_help = "\
Examples:
  cargo xtask flash
  cargo xtask flash --controller fast                  as fast as the amplifier allows
  cargo xtask flash --controller fast --limit-v 1000   with an amplifier of 1000 V")]
    Flash(Variant),
    /// Flash, RAM and worst stack of each image
    ///
    /// Exits with 1 unless flash stays below 64 KB (96 KB with the time-optimal controller), RAM below 16 KB and the stack in
    /// its place.
    #[command(after_help = "\
Examples:
  cargo xtask size --json
  cargo xtask size --controller fast                   with the time-optimal controller
  cargo xtask size --controller fast --limit-v 1000    the same for an amplifier of 1000 V
  cargo xtask size --feedback                          with a stiffness sensor")]
    Size(size::Args),
    /// Make the MCU's images: ELF, bin and hex
    ///
    /// Prints their paths; each image has a name of its own.
    #[command(after_help = "\
Examples:
  cargo xtask image                                    nucleo-g474re, mps2-an386
  cargo xtask image --controller fast                  nucleo-g474re-fast, mps2-an386-fast
  cargo xtask image --controller fast --limit-v 1000   nucleo-g474re-fast-kilovolt, mps2-an386-fast-kilovolt")]
    Image(Variant),
    /// Run the very image that is flashed, on models of the STM32G474's registers
    ///
    /// It fits, and its tick cannot panic; boot, 1.2 s without a host; a host that arms it over LPUART1 and sets targets, every
    /// code the host model's under this controller with this amplifier, many of them others in any other image; then a panic,
    /// a hard fault and two hangs while voltage is out. Exits with 1 unless the output is as it must be each time; says what
    /// this cannot show. Installs Unicorn into a venv under the target directory.
    #[command(after_help = "\
Examples:
  cargo xtask boot
  cargo xtask boot --controller fast                   the image of the time-optimal controller
  cargo xtask boot --controller fast --limit-v 1000    the same for an amplifier of 1000 V")]
    Boot(Variant),
    /// Compare the host's speed with Python's
    ///
    /// Runs the report's closed loop, 70 s at 1 kHz, in scipy, numba and Rust, in turns. Exits with 1 if Rust is slower
    /// than its bounds allow.
    #[command(after_help = "Example:\n  cargo xtask bench --json | jq .within_bounds")]
    Bench(bench::Args),
}

fn main() -> ExitCode {
    let command = Cli::command().mut_subcommand("test", |c| c.after_help(test::help()).term_width(0));
    let cli = match Cli::from_arg_matches(&command.get_matches()) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    let result = match cli.command {
        Command::Setup => setup::run(),
        Command::Test => test::run(),
        Command::Emulate(args) => emulate::run(&args),
        Command::Proof => setup::emulator().and_then(|()| proof::run()),
        Command::Drill(args) => drill::run(&args),
        Command::Talk => talk::command(),
        Command::Story(args) => story::run(&args),
        Command::Flash(variant) => flash::run(variant),
        Command::Size(args) => size::run(&args),
        Command::Image(variant) => image::run(variant),
        Command::Boot(variant) => boot::run(variant),
        Command::Bench(args) => bench::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
