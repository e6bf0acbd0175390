//! Plant files of the commands that run the tick or send its model.

use anyhow::Result;
use link::WireModel;
use model::Amplifier;
use simulation::bad_input::{BadInput, number};
use simulation::plant_file::{self, PlantFile};
use simulation::schedule::STAIR_STEP_V;

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
    remark_on_law(name, &file);
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
    remark_on_law(name, file);
    if let Some(unit) = file.units.as_ref().and_then(|units| units.other_command()) {
        remark(&format!(
            "{name}: the command is in {unit}: every V of target, voltage and stiffness is a {unit}, within the range of --limit-v"
        ));
    }
}

/// Remarks on stairs whose steps are not those of the report because the spring's own range behind an amplifier is too small for them.
pub(crate) fn remark_on_stair(name: &str, file: &PlantFile, amplifiers: &[Amplifier]) {
    let mut steps_v: Vec<f64> = amplifiers.iter().map(|amplifier| file.stair_step_v(*amplifier)).collect();
    steps_v.dedup();
    for step_v in steps_v.into_iter().filter(|step_v| *step_v != STAIR_STEP_V) {
        let unit = file.units.as_ref().and_then(|units| units.other_command()).unwrap_or("V");
        let [step, end] = [step_v, 5.0 * step_v].map(number);
        remark(&format!(
            "{name}: the stair has steps of {step} {unit} up to {end} {unit}, within the spring's own range"
        ));
    }
}

/// Remarks on a law of which the tick runs fewer points than its file has.
fn remark_on_law(name: &str, file: &PlantFile) {
    let recorded = plant_file::load_for_host(name).ok().and_then(|file| file.law);
    if let Some(law) = recorded.filter(|law| file.law.as_ref().is_some_and(|used| used != law)) {
        let (used, off) = law.of_tick();
        let (of, with, percent) = (law.voltage_v.len(), used.voltage_v.len(), 100.0 * off);
        remark(&format!("{name}: [law] of {of} points runs with {with}, off by at most {percent:.2} % of its largest"));
    }
}
