//! `cargo xtask emulate`: the stair under QEMU compared with the same code on the host, or a board that a host
//! commands.

use std::path::PathBuf;

use anyhow::Result;
use xtask::build::{self, Board, Opt};
use xtask::setup;
use xtask::variant::Variant;

use crate::qemu::comparison::Comparison;
use crate::qemu::emulator;
use crate::{blocks, isolation, rivals};

/// Options of `cargo xtask emulate`.
#[derive(clap::Args)]
#[command(mut_group("Variant", |group| group.requires("link")))]
pub(crate) struct Args {
    /// Print the result as JSON; the log goes to stderr
    #[arg(long)]
    json: bool,
    /// Show every line of the log, also the summaries, one for each second of the run
    #[arg(long, conflicts_with_all = ["rivals", "blocks", "isolation"])]
    log: bool,
    /// Run no script: wait for `vsj link unix:PATH` on this socket until Ctrl-C
    #[arg(long, value_name = "PATH", conflicts_with = "json")]
    link: Option<PathBuf>,
    #[command(flatten)]
    variant: Variant,
    /// Count instructions per tick of this controller, of other crates and of double precision
    #[arg(long, conflicts_with = "link")]
    rivals: bool,
    /// Count instructions per tick for each kind of spring under each controller
    #[arg(long, conflicts_with_all = ["link", "rivals"])]
    blocks: bool,
    /// Count instructions per tick of the isolation bank
    #[arg(long, conflicts_with_all = ["link", "rivals", "blocks"])]
    isolation: bool,
    /// Goal of the optimiser
    #[arg(long, value_enum, default_value = "s")]
    opt: Opt,
}

/// Runs the stair, a count of instructions or a board for a host, and prints the result.
pub(crate) fn run(args: &Args) -> Result<()> {
    setup::emulator()?;
    if args.rivals {
        return rivals::run(args.opt, args.json);
    }
    if args.blocks {
        return blocks::run(args.opt, args.json);
    }
    if args.isolation {
        return isolation::run(args.opt, args.json);
    }
    let elf = build::image_with(&args.variant.features(), Board::Mps2, args.opt)?;
    let show = |line: &str| match is_shown(line, args.log) {
        true if args.json => eprintln!("{line}"),
        true => println!("{line}"),
        false => (),
    };
    if let Some(socket) = &args.link {
        let socket = std::path::absolute(socket)?;
        eprintln!("talk to it with: vsj link unix:{} status", socket.display());
        return emulator::serve(&elf, &socket, show);
    }
    let run = emulator::play(&elf, "stair", emulator::SHIFT, show)?;
    let comparison = Comparison::new("stair", &run)?;
    if args.json {
        println!("{}", comparison.report(args.opt, &run));
    } else {
        println!("{}", comparison.summary(&run));
    }
    comparison.check()
}

/// True if a line of the log is shown: all but the summaries, which are nearly equal, or all lines with `all`.
fn is_shown(line: &str, all: bool) -> bool {
    all || !line.split_whitespace().any(|word| word == "summary")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_are_shown_only_on_request_and_every_other_line_always() {
        let summary = "    1.000 info  summary tick=1000 overruns=0";
        assert_eq!([is_shown(summary, false), is_shown(summary, true)], [false, true]);
        assert!(is_shown("    1.000 warn  limit bits=1 tick=70", false) && is_shown("info  state off -> armed", false));
    }
}
