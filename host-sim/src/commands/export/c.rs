//! `vsj export c`: the settings of a controller for C.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::export::c::{Answer, text, write};
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, remark, wrote};
use simulation::control_loop::ControlLoop;

use super::super::loop_arguments::LoopArguments;
use super::super::plant;

/// Write the controller's settings for C, with the header of its library and an example
///
/// vsj_settings.h has the settings as a constant, vsj_tick.h is the header of libvsj_tick.a. main.c and CMakeLists.txt are an
/// example for a host and for a Cortex-M4. The library is in the folder c of a release, or made by
/// `cargo build --release -p capi [--target thumbv7em-none-eabihf]`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj export c                                 the report's spring
  vsj export c --plant spring.toml --out out/c --controller fast --limit-v 1000
  vsj export c --known tau=5 --known share=5   a spring known to within 5 %

Exit codes: 0 success, 1 a file cannot be written, 2 bad arguments, a plant file that the tick cannot run.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    control: LoopArguments,
    /// Write the files to this folder
    #[arg(long, value_name = "DIR", default_value = "out/c")]
    out: PathBuf,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let name = &arguments.control.plant;
    let plant = plant::load(name)?;
    let options = arguments.control.options(&plant)?;
    let not_simulated = plant.left_out();
    ControlLoop::new(&plant, &options)?;
    let mut files = Files::new(&arguments.out)?;
    let kept = write(&options.settings(&plant), name, &not_simulated, &mut files)?;
    let paths = files.finish()?;
    for name in &kept {
        remark(&format!(
            "{}: kept, since it is not the example's; remove it for a new one",
            arguments.out.join(name).display()
        ));
    }
    let answer = Answer::new(&paths, &kept, options.rate_hz, not_simulated);
    print(&if arguments.json { json(&answer)? } else { text(&answer) + &wrote(&paths) })
}
