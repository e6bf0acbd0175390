//! Plant files of the commands that run the tick or send its model.

use anyhow::Result;
use link::WireModel;
use simulation::bad_input::BadInput;
use simulation::plant_file::{self, PlantFile};

use host_sim::output::terminal::remark;

/// Reads a plant file, and remarks on what the tick does not simulate of it.
pub(crate) fn load(name: &str) -> Result<PlantFile> {
    let file = plant_file::load(name)?;
    remark_on(name, &file);
    Ok(file)
}

/// Reads the model that an MCU runs from a plant file, and remarks on what it does not run of it, which is returned too.
pub(crate) fn wire(name: &str) -> Result<(WireModel, Vec<String>)> {
    let file = plant_file::load(name)?;
    let left_out = file.left_out();
    if !left_out.is_empty() {
        remark(&format!("{name}: not run by the MCU: {}", left_out.join(", ")));
    }
    Ok((file.wire().map_err(|error| BadInput(format!("{name}: {error}")))?, left_out))
}

/// Remarks on effects that the tick does not simulate, and on a command that is no voltage.
pub(crate) fn remark_on(name: &str, file: &PlantFile) {
    let percent = 100.0 * file.oscillating_part();
    let with_part = |effect: String| match effect.as_str() {
        "mode" if percent > 0.0 => format!("mode ({percent:.1} % of the settled response)"),
        _ => effect,
    };
    let left_out: Vec<String> = file.left_out().into_iter().map(with_part).collect();
    if !left_out.is_empty() {
        remark(&format!("{name}: not simulated: {}", left_out.join(", ")));
    }
    if let Some(unit) = file.units.as_ref().and_then(|units| units.other_command()) {
        remark(&format!(
            "{name}: the command is in {unit}: every V of target, voltage and stiffness is a {unit}, within the range of --limit-v"
        ));
    }
}
