//! `vsj joint`: the stiffness of a joint with springs between two rings.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::files::Files;
use host_sim::output::joint;
use host_sim::output::terminal::{json, print, wrote};
use paper::beam::cantilever::Beam;
use paper::joint::report::{self, Requirement};
use paper::joint::{Joint, MOST_SPRINGS, OuterEnd};
use simulation::option_names::named;
use simulation::plant_file;
use simulation::reference::Loop;

use super::choice::{OUTER_END, one_of};

/// Joint stiffness of springs set radially between two rings, compared with the report's requirement
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  vsj joint                                     12 springs of the report's size
  vsj joint --springs 24 --inner-radius-mm 40 --outer-end clamped
  vsj joint --stiffness 0.02                    spring constant for 0.02 N m/rad
  vsj joint --limit-v 1000 --within-s 1 --json  another amplifier, more time")]
pub(crate) struct Arguments {
    /// Number of springs
    #[arg(long, default_value_t = 12, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SPRINGS)))]
    springs: u32,
    /// Radius of the inner ring, in mm
    #[arg(long, default_value_t = 20.0, value_name = "MM", allow_negative_numbers = true)]
    inner_radius_mm: f64,
    /// Support of the outer end of a spring
    #[arg(long, default_value = "supported", value_parser = one_of(OUTER_END))]
    outer_end: OuterEnd,
    /// Free length of a spring, in mm
    #[arg(long, default_value_t = 59.8, value_name = "MM", allow_negative_numbers = true)]
    length_mm: f64,
    /// Width of a spring, in mm
    #[arg(long, default_value_t = 19.8, value_name = "MM", allow_negative_numbers = true)]
    width_mm: f64,
    /// Thickness of a spring, in um
    #[arg(long, default_value_t = 190.0, value_name = "UM", allow_negative_numbers = true)]
    thickness_um: f64,
    /// A joint stiffness to be realised, in N m/rad
    #[arg(long, value_name = "N_M/RAD", allow_negative_numbers = true)]
    stiffness: Option<f64>,
    /// Lowest required joint stiffness, in N m/rad
    #[arg(long, default_value_t = Requirement::PAPER.low_n_m_per_rad, value_name = "N_M/RAD", allow_negative_numbers = true)]
    low: f64,
    /// Highest required joint stiffness, in N m/rad
    #[arg(long, default_value_t = Requirement::PAPER.high_n_m_per_rad, value_name = "N_M/RAD", allow_negative_numbers = true)]
    high: f64,
    /// Time allowed for a change, in s
    #[arg(long, default_value_t = Requirement::PAPER.within_s, value_name = "S", allow_negative_numbers = true)]
    within_s: f64,
    /// Highest voltage of the amplifier, in V
    #[arg(long, default_value_t = 700.0, value_name = "V", allow_negative_numbers = true)]
    limit_v: f64,
    /// Slew limit of the amplifier, in V/s; default: none
    #[arg(long, value_name = "V/S", allow_negative_numbers = true)]
    slew_v_per_s: Option<f64>,
    /// The spring's relaxation: `paper`, or a plant file of at most 1 MiB
    #[arg(long, default_value = "paper", value_name = "paper|FILE.toml")]
    plant: String,
    /// Write joint.json and joint.txt to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let geometry = Joint {
        inner_radius_m: 1e-3 * arguments.inner_radius_mm,
        spring_length_m: 1e-3 * arguments.length_mm,
        springs: arguments.springs,
        outer_end: arguments.outer_end,
    };
    let beam = Beam {
        length_m: geometry.spring_length_m,
        width_m: 1e-3 * arguments.width_mm,
        thickness_m: 1e-6 * arguments.thickness_um,
        // Replaced by the Young's modulus of the experiment.
        youngs_modulus_pa: 1.0,
        density_kg_per_m3: 0.0,
    };
    let requirement = Requirement {
        low_n_m_per_rad: arguments.low,
        high_n_m_per_rad: arguments.high,
        within_s: arguments.within_s,
        ..Requirement::PAPER
    };
    let plant = plant_file::load_plain(&arguments.plant)?;
    let system = Loop {
        share: plant.share,
        time_constant_s: plant.time_constant_s,
        gains: None,
        range_v: (0.0, arguments.limit_v),
        slew_v_per_s: arguments.slew_v_per_s.unwrap_or(f64::INFINITY),
    };
    let report = report::Report::new(geometry, requirement, &beam, &system, arguments.stiffness)
        .map_err(|error| named(error, OPTIONS))?;
    let (json, text) = (json(&report)?, joint::text(&report));
    let mut written = String::new();
    if let Some(folder) = &arguments.out {
        let mut files = Files::new(folder)?;
        files.add("joint.json", |out| out.write_all(json.as_bytes()))?;
        files.add("joint.txt", |out| out.write_all(text.as_bytes()))?;
        written = wrote(&files.finish()?);
    }
    print(&if arguments.json { json } else { text + &written })
}

/// The option of each field that an error may begin with.
const OPTIONS: &[(&str, &str)] = &[
    ("inner_radius_m", "--inner-radius-mm"),
    ("spring_length_m", "--length-mm"),
    ("length_m", "--length-mm"),
    ("width_m", "--width-mm"),
    ("thickness_m", "--thickness-um"),
    ("low_n_m_per_rad", "--low"),
    ("high_n_m_per_rad", "--high"),
    ("within_s", "--within-s"),
    ("limit_v", "--limit-v"),
    ("slew_v_per_s", "--slew-v-per-s"),
    ("stiffness_n_m_per_rad", "--stiffness"),
];
