//! `vsj beam`: the leaf spring's statics.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::terminal::{json, print, wrote};
use host_sim::output::{beam, figure};
use paper::beam::cantilever::{Beam, Load};
use paper::beam::layered::ELEMENTS;
use paper::beam::readings;
use paper::beam::report::{self, Setup};
use paper::beam::slip::tips;
use paper::beam::stack::{self, ORDER, Stack, TABLE2};
use simulation::bad_input;
use simulation::csv_table::read;
use simulation::option_names::named;

/// The leaf spring's statics: beam experiment, deflection small and large, layers that slip
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj beam                                        as in the report
  vsj beam --thickness-um 40 --force-un 500 --at-mm 10,30,59.8
  vsj beam --force-un 500 --voltage-v 400 --json  the stack at 400 V, 500 uN
  vsj beam --experiment readings.csv --layers layers.csv
  vsj beam --stack PET,aluminium,nylon,PVdF,aluminium,PET")]
pub(crate) struct Arguments {
    /// Readings of a beam experiment, with columns displacement_mm and force_un_<V>v, at most 100 voltages and 100 000
    /// readings; default: the report's Table 1
    #[arg(long, value_name = "FILE.csv")]
    experiment: Option<PathBuf>,
    /// Free length of the beam of one material, in mm
    #[arg(long, default_value_t = 59.8, value_name = "MM", allow_negative_numbers = true)]
    length_mm: f64,
    /// Width of the beam of one material, in mm
    #[arg(long, default_value_t = 19.8, value_name = "MM", allow_negative_numbers = true)]
    width_mm: f64,
    /// Thickness of the beam of one material, in um
    #[arg(long, default_value_t = 20.0, value_name = "UM", allow_negative_numbers = true)]
    thickness_um: f64,
    /// Young's modulus of the beam of one material, in GPa
    #[arg(long, default_value_t = 69.0, value_name = "GPA", allow_negative_numbers = true)]
    modulus_gpa: f64,
    /// Density of the beam of one material, in kg/m3
    #[arg(long, default_value_t = 2700.0, value_name = "KG/M3", allow_negative_numbers = true)]
    density: f64,
    /// Force at the tip, upwards, in uN; it also bends the stack
    #[arg(long, default_value_t = 900.0, value_name = "UN", allow_negative_numbers = true)]
    force_un: f64,
    /// Gravity, downwards, in m/s2; 0 neglects the weight
    #[arg(long, default_value_t = 9.8, value_name = "M/S2", allow_negative_numbers = true)]
    gravity: f64,
    /// Places along the beam, in mm from the clamp, at most 1000; default: every quarter of the length
    #[arg(long, value_name = "MM", value_delimiter = ',', allow_negative_numbers = true)]
    at_mm: Vec<f64>,
    /// Error of the linear theory that is tolerated, as part of the largest displacement
    #[arg(long, default_value_t = 0.05, value_name = "PART", allow_negative_numbers = true)]
    tolerance: f64,
    /// Layers, with the columns of the report's Table 2; default: Table 2
    #[arg(long, value_name = "FILE.csv")]
    layers: Option<PathBuf>,
    /// Order of the layers, bottom to top, at most 20
    #[arg(long, default_value = ORDER, value_name = "MATERIAL,...")]
    stack: String,
    /// Voltage across the stack, in V
    #[arg(long, default_value_t = 0.0, value_name = "V", allow_negative_numbers = true)]
    voltage_v: f64,
    /// Interlayer stiffness against slip, in Pa/m; default: identified from the experiment
    #[arg(long, value_name = "PA/M", allow_negative_numbers = true)]
    interlayer: Option<f64>,
    /// Number of finite elements along the stack
    #[arg(long, default_value_t = ELEMENTS, value_name = "N")]
    elements: usize,
    /// Write beam.txt, experiment.svg, beam.svg and stack.svg to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Largest number of places along the beam; each is a line of the answer.
const MOST_PLACES: usize = 1000;

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let setup = setup(arguments)?;
    let report = report::Report::new(&setup).map_err(|error| in_file(named(error, OPTIONS), arguments))?;
    let text = beam::text(&report);
    let mut written = String::new();
    if let Some(folder) = &arguments.out {
        let mut files = Files::new(folder)?;
        files.add("beam.txt", |out| out.write_all(text.as_bytes()))?;
        for (name, figure) in report.figures(&setup.readings) {
            files.add(name, |out| out.write_all(figure::svg(&figure).as_bytes()))?;
        }
        written = wrote(&files.finish()?);
    }
    print(&if arguments.json { json(&report)? } else { text + &written })
}

/// Adds the file name to the error of an experiment with too few readings.
fn in_file(error: anyhow::Error, arguments: &Arguments) -> anyhow::Error {
    match &arguments.experiment {
        Some(path) if error.to_string().starts_with("the beam experiment") => error.context(path.display().to_string()),
        _ => error,
    }
}

fn setup(arguments: &Arguments) -> Result<Setup> {
    let beam = Beam {
        length_m: 1e-3 * arguments.length_mm,
        width_m: 1e-3 * arguments.width_mm,
        thickness_m: 1e-6 * arguments.thickness_um,
        youngs_modulus_pa: 1e9 * arguments.modulus_gpa,
        density_kg_per_m3: arguments.density,
    };
    if arguments.at_mm.len() > MOST_PLACES {
        bad_input!("--at-mm: {} places; expected at most {MOST_PLACES}", arguments.at_mm.len());
    }
    let load = Load { tip_n: 1e-6 * arguments.force_un, gravity_m_per_s2: arguments.gravity };
    let readings = match &arguments.experiment {
        None => readings::table1()?,
        Some(path) => readings::parse(&path.display().to_string(), &read(path)?)?,
    };
    let kinds = match &arguments.layers {
        None => stack::kinds("Table 2", TABLE2)?,
        Some(path) => stack::kinds(&path.display().to_string(), &read(path)?)?,
    };
    // Section 4.1.4 applies to the report's spring only.
    let reports_own = arguments.experiment.is_none() && arguments.layers.is_none() && arguments.stack == ORDER;
    let at_m = if arguments.at_mm.is_empty() {
        [0.25, 0.5, 0.75, 1.0].map(|part| part * beam.length_m).to_vec()
    } else {
        arguments.at_mm.iter().map(|mm| 1e-3 * mm).collect()
    };
    Ok(Setup {
        readings,
        tips: if reports_own { tips()? } else { Vec::new() },
        stack: Stack::in_order(&kinds, &arguments.stack)?,
        beam,
        load,
        tolerance: arguments.tolerance,
        at_m,
        voltage_v: arguments.voltage_v,
        interlayer_pa_per_m: arguments.interlayer,
        elements: arguments.elements,
    })
}

/// The option of each field that an error may begin with.
const OPTIONS: &[(&str, &str)] = &[
    ("length_m", "--length-mm"),
    ("width_m", "--width-mm"),
    ("thickness_m", "--thickness-um"),
    ("youngs_modulus_pa", "--modulus-gpa"),
    ("density_kg_per_m3", "--density"),
    ("tip_n", "--force-un"),
    ("gravity_m_per_s2", "--gravity"),
    ("interlayer_pa_per_m", "--interlayer"),
    ("tolerance", "--tolerance"),
    ("voltage_v", "--voltage-v"),
    ("elements", "--elements"),
    ("at_mm", "--at-mm"),
];
