//! The cure: the extended simulation as a plant file, and how well the fixed-point tick runs it.

use super::base::Base;
use super::data::Data;
use super::effect::Stage;
use super::fit::Engine;
use super::model::Model;
use crate::open_loop;
use crate::plant_file::PlantFile;

/// The rate at which the tick is tried, in Hz.
const RATE_HZ: f64 = 1000.0;
/// Longer records are not run tick by tick, in s.
const LONGEST_S: f64 = 5000.0;
/// Causes of the spring that no table of a plant file holds, or that act before the tick.
const NOT_IN_THE_TICK: [&str; 4] = ["drift", "resonance", "delay", "amplifier-slew"];

/// The extended spring.
#[derive(Clone, Debug, PartialEq)]
pub struct Cure {
    /// As a file for `vsj stair --plant`.
    pub file: PlantFile,
    /// Largest difference between the fixed-point tick and the fit, over the record, in V: of the blocks that the tick
    /// runs. `None` if the tick refuses the spring, or the record's voltage is not held between rows.
    pub fixed_point_error_v: Option<f64>,
}

/// Of a fitted model.
pub(super) fn of(engine: &mut Engine, model: &Model, held: bool) -> Cure {
    let (data, base) = (engine.data, engine.simulator.base);
    let file = model.extend(base, data);
    let runs = held && data.duration_s() < LONGEST_S && file.check().is_ok();
    let fixed_point_error_v = runs.then(|| error(engine, model, base, data)).flatten();
    Cure { file, fixed_point_error_v }
}

fn error(engine: &mut Engine, model: &Model, base: &Base, data: &Data) -> Option<f64> {
    let mut ticked = model.clone();
    ticked
        .blocks
        .retain(|(block, _)| block.effect().stage() != Stage::Reading && !NOT_IN_THE_TICK.contains(&block.cause()));
    let file = ticked.extend(base, data);
    let limit = file.amplifier.as_ref().and_then(|amplifier| amplifier.limit_v).unwrap_or(f64::INFINITY);
    let voltage: Vec<f64> = data.voltage_v.iter().map(|voltage| voltage.min(limit)).collect();
    let fixed = open_loop::simulate(&file.extended(), RATE_HZ, &data.time_s, &voltage).ok()?;
    let fitted = engine.residual(&ticked);
    let difference = |((reading, left), fixed): ((&f64, &f64), &f64)| (reading - left - fixed).abs();
    Some(data.reading.iter().zip(&fitted).zip(&fixed).map(difference).fold(0.0, f64::max))
}
