//! `vsj export fmu`: co-simulation units of spring and controller.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::export::fmu::{Units, text, write};
use host_sim::output::export::library::{Library, find};
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, wrote};
use simulation::bad_input;
use simulation::plant_file;
use vsj_fmu::{Kind, Unit, Version};

use super::super::choice::{FMI, UNIT, one_of};
use super::super::loop_arguments::LoopArguments;
use super::super::plant::remark_on;

/// Name of the library beside `vsj`, without its ending.
const LIBRARY: &str = "vsj_fmu";

/// Write co-simulation units (FMUs) of the spring, its controller, and both
///
/// A unit computes what the microcontroller computes, bit for bit, in ticks of 1 / --rate-hz; a step of the simulation is a whole
/// number of ticks. Settings and the numbers of the plant file are parameters of the unit. It contains a library for this platform,
/// which is found beside `vsj`, and with --library further ones.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj export fmu                                      the report's spring
  vsj export fmu --plant spring.toml --out out/fmu    six units
  vsj export fmu --unit both --fmi 3 --controller fast --limit-v 1000
  vsj export fmu --library vsj_fmu.dll --library libvsj_fmu.so

Exit codes: 0 success, 1 a file cannot be written, 2 bad arguments, a plant file that the tick cannot run, no library.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    control: LoopArguments,
    /// Parts in the unit, repeatable; default: a unit of each
    #[arg(long, value_parser = one_of(UNIT))]
    unit: Vec<Kind>,
    /// Version of FMI, repeatable; default: both
    #[arg(long, value_parser = one_of(FMI), value_name = "2|3")]
    fmi: Vec<Version>,
    /// The library for the units, repeatable for several platforms; default: the one beside `vsj`
    #[arg(long, value_name = "FILE")]
    library: Vec<PathBuf>,
    /// Write the units to this folder
    #[arg(long, value_name = "DIR", default_value = "out/fmu")]
    out: PathBuf,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let (plant, plant_text) = plant_file::load_with_text(&arguments.control.plant)?;
    remark_on(&arguments.control.plant, &plant);
    let not_simulated = plant.left_out();
    let options = arguments.control.options(&plant)?;
    let unit = Unit { kind: Kind::Both, plant, options };
    unit.check()?;
    let libraries = libraries(&arguments.library)?;
    let all = Kind::ALL.into_iter().flat_map(|kind| Version::ALL.map(|version| (kind, version)));
    let is_wanted = |(kind, version): &(Kind, Version)| {
        (arguments.unit.is_empty() || arguments.unit.contains(kind))
            && (arguments.fmi.is_empty() || arguments.fmi.contains(version))
    };
    let units =
        Units { unit: &unit, plant_text: &plant_text, libraries: &libraries, wanted: all.filter(is_wanted).collect() };
    let mut files = Files::new(&arguments.out)?;
    let answer = write(&units, &mut files, not_simulated)?;
    let paths = files.finish()?;
    print(&if arguments.json { json(&answer)? } else { text(&answer) + &wrote(&paths) })
}

/// The libraries in `files`, one for each platform; without a file the one beside this program.
fn libraries(files: &[PathBuf]) -> Result<Vec<Library>> {
    if files.is_empty() {
        return Ok(vec![find(LIBRARY, "cargo build --release -p fmu")?]);
    }
    let mut libraries: Vec<Library> = Vec::new();
    for file in files {
        let library = Library::read(file)?;
        if libraries.iter().any(|other| other.platform == library.platform) {
            bad_input!(
                "--library {}: a second one for {}; expected one a platform",
                file.display(),
                library.platform.name
            );
        }
        libraries.push(library);
    }
    Ok(libraries)
}
