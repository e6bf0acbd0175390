//! Verification of the firmware's images, started by `cargo xtask`.
//!
//! In: images that [`xtask::build`] makes. Out: tables and JSON on stdout, an exit code of 1 if an image is not as it
//! must be.
//!
//! - [`binary`] reads an image's machine code: panics, floats, stack, size.
//! - [`qemu`] runs an image under QEMU and compares the run with the same code on the host: [`emulate`], [`rivals`],
//!   [`blocks`], [`isolation`], [`drill`], [`talk`], [`clients`], [`watch`], [`story`].
//! - [`boot`] runs the image that is flashed on models of the chip's registers.
//! - [`capi`] builds the C library's example and compares its run on this machine and under QEMU with the same in Rust.
//! - [`soak`] runs random ticks of the control on the host and checks every invariant in each.
//! - [`proof`] is what all of `cargo xtask test` asks of the emulated board.

mod binary;
mod blocks;
mod boot;
mod capi;
mod clients;
mod drill;
mod emulate;
mod isolation;
mod proof;
mod qemu;
mod rivals;
mod soak;
mod story;
mod talk;
mod variant;
mod watch;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::setup;

use binary::size;

/// Verification of the firmware's images.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run the firmware on the report's stair under QEMU
    ///
    /// 70 s at 1 kHz, in seconds. Shows the decoded log, and exits with 1 unless every DAC code and every estimate is
    /// the host's, bit for bit, and no tick was missed.
    ///
    /// With --link it plays no script and obeys `vsj link`, in real time, its interlock closed. With --rivals it counts
    /// the instructions that a tick of other controllers needs, and exits with 1 unless each reaches the target.
    #[command(after_help = "\
Examples:
  cargo xtask emulate --json | jq .instructions_per_tick
  cargo xtask emulate --rivals                         instructions per tick, compared with other controllers
  cargo xtask emulate --blocks                         instructions per tick, by spring and controller
  cargo xtask emulate --isolation                      instructions per tick of the isolation bank
  cargo xtask emulate --link /tmp/mcu.sock             then: vsj link unix:/tmp/mcu.sock status")]
    Emulate(emulate::Args),
    /// Everything that the emulated firmware must show
    ///
    /// Bit for bit the host's on the stair and on random commands at opt-levels s and 3, instructions per tick, no
    /// panic in the tick, no heap, every fault drill. A part of `test`.
    Proof,
    /// Run the fault drills under QEMU
    ///
    /// Panic, hard fault, stack overflow, the same with floats in use, stalled task, hanging control, the same with
    /// interrupts off, overrun, interlock, overrun and interlock together, silent host, missing guards. Exits with 1
    /// unless the voltage goes away on the DAC's wire and the log is the approved one.
    #[command(after_help = "\
Examples:
  cargo xtask drill
  cargo xtask drill --only silence                     one of them")]
    Drill(drill::Args),
    /// Let a host talk to the emulated firmware
    ///
    /// Arms it, sets a stiffness, falls silent; then 10 000 damaged, random, late and foreign frames while armed,
    /// in about a minute; then a model by `vsj link`. Exits with 1 if a hostile frame is followed, a tick is missed or
    /// the model is not run. A part of `test`.
    Talk,
    /// Let the clients in C++ and Python command the emulated firmware
    ///
    /// Compiles the header clients/cpp/vsj_link.hpp with CMake, checks every frame of the protocol, and lets its client and that of
    /// the Python package, which `cargo xtask python` has installed, arm, set, watch, record and disarm a board each. Then does the
    /// same by the keys of `vsj watch --emulated` in a pseudo-terminal. Installs CMake and a C++ compiler with apt-get unless they
    /// are there. A part of `test`.
    Clients,
    /// End-to-end demonstration: run, diagnose, extend, run again
    ///
    /// The emulated board drives a spring with a hidden effect up and down a stair, in lock step; `vsj diagnose` names
    /// the cause; the extended model goes over the link, is checked, stored and run after a restart. Prints the true
    /// stiffness error before and after. With --feedback the board reads the spring's sensor instead, which then falls
    /// silent. With --isolation the spring changes meanwhile, and the board names the cause.
    #[command(after_help = "\
Examples:
  cargo xtask story                                three effects, as in `test`
  cargo xtask story --effect hysteresis gain-error
  cargo xtask story --controller fast
  cargo xtask story --feedback                     the paper's model, without the sensor and with it
  cargo xtask story --isolation                    what changes is named by the board
  cargo xtask story --adaptation                   and followed by its model
  cargo xtask story --all --json")]
    Story(story::Args),
    /// Flash, RAM and worst stack of each image
    ///
    /// Exits with 1 unless flash stays below 128 KB, RAM below 16 KB (with the isolation bank 24 KB, with the adaptation 32 KB) and the
    /// stack within its region.
    #[command(after_help = "\
Examples:
  cargo xtask size --json
  cargo xtask size --controller fast                   with the time-optimal controller
  cargo xtask size --controller fast --limit-v 1000    the same for an amplifier of 1000 V
  cargo xtask size --feedback                          with a stiffness sensor
  cargo xtask size --isolation                         with a stiffness sensor and the isolation bank")]
    Size(size::Args),
    /// Run the image that is flashed on models of the STM32G474's registers
    ///
    /// Checks that it fits and that its tick cannot panic. Runs boot and 1.2 s without a host; a host that arms it over
    /// LPUART1 and sets targets, where every code must be the host model's for this controller and amplifier, and many
    /// must differ from any other image's; one that stores settings and a model, also with resets in the middle, and one that floods
    /// the line; then faults while voltage is out, from a panic to a stopped processor. Exits with 1 unless the output is as it must be
    /// each time; says what this cannot show. Installs Unicorn into a venv under the target directory.
    #[command(after_help = "\
Examples:
  cargo xtask boot
  cargo xtask boot --controller fast                   the image of the time-optimal controller
  cargo xtask boot --controller fast --limit-v 1000    the same for an amplifier of 1000 V
  cargo xtask boot --controller robust                 for a spring known to within errors
  cargo xtask boot --brief --controller fast           only what the controller or the amplifier may change
  cargo xtask boot --only 'late tick'                  one run
  cargo xtask boot --all                               every image, one after the other")]
    Boot(boot::Args),
    /// Build the C library's example, run it here and under QEMU
    ///
    /// As a user does: settings by `vsj export c`, the libraries by cargo, the example by CMake, for this machine and for a
    /// Cortex-M4. Exits with 1 unless every DAC code and every estimate is Rust's, bit for bit, and the program for the Cortex-M4
    /// contains no panic and no allocator. Installs CMake and GCC for ARM with apt-get unless they are there. A part of `test`.
    Capi,
    /// Run random ticks on the host and check every invariant in each
    ///
    /// Random settings, commands, readings, missed ticks, silences, interlock openings and faults. In each tick: range,
    /// slew, no wrap, the supervisor's state and its reasons, every missed tick counted. Prints what the ticks covered.
    /// A share of it is part of the unit tests.
    #[command(after_help = "\
Examples:
  cargo xtask soak                                     100 million ticks
  cargo xtask soak --ticks 1000000
  cargo xtask soak --emulated                          an hour of the emulated board")]
    Soak(soak::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Emulate(args) => emulate::run(&args),
        Command::Proof => setup::emulator().and_then(|()| proof::run()),
        Command::Drill(args) => drill::run(&args),
        Command::Talk => talk::command(),
        Command::Clients => clients::run(),
        Command::Story(args) => story::run(&args),
        Command::Size(args) => size::run(&args),
        Command::Boot(args) => boot::run(&args),
        Command::Capi => capi::run(),
        Command::Soak(args) => soak::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use xtask::documents;

    #[test]
    fn the_command_line_is_defined_without_contradictions() {
        Cli::command().debug_assert();
    }

    #[test]
    fn the_documents_name_options_that_exist() {
        let mut tried = 0;
        for line in documents::lines().unwrap() {
            let Some(arguments) = line.arguments("cargo xtask") else { continue };
            let is_here = |name| Cli::command().find_subcommand(name).is_some();
            if arguments.first().is_some_and(is_here) {
                let parsed = Cli::try_parse_from(["cargo xtask"].into_iter().chain(arguments));
                assert!(parsed.is_ok(), "{line:?}: {}", parsed.err().unwrap());
                tried += 1;
            }
        }
        assert!(tried > 50, "{tried} command lines");
    }
}
