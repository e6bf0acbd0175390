//! The extended simulation as a plant file, and the error of the fixed-point tick that runs it.

use crate::dimension::Dimension;
use crate::effects::index_of;
use crate::effects::model::Model;
use crate::fit::engine::Engine;
use crate::plant::base::Base;
use crate::plant::initial_state::InitialState;
use crate::record::data::Data;
use crate::record::scales::Scales;
use crate::record::signal::Signal;
use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;
use simulation::open_loop;
use simulation::plant_file::{PlantFile, Reading};
use simulation::record::{Record, Row};
use simulation::schedule::{Between, Schedule};

/// Rate of the tick, in Hz.
const RATE_HZ: f64 = 1000.0;
/// Number of ticks from which a record is not run tick by tick, because that would take as long as the search.
const MOST_TICKS: f64 = 5e6;
/// Error of the tick, in normalised V, above which reports point it out: 0.002 of the reference voltage.
pub const SMALL_ERROR_V: f64 = 1.0;

/// The extended simulation, exported.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    /// The plant file, for `vsj stair --plant`.
    pub file: PlantFile,
    /// Largest absolute difference between the fixed-point tick with this file and the fitted spring, in V. Both start at
    /// rest and receive the voltages of the fitted amplifier at the record's rows, each held until the next; effects that the
    /// file lists as not modelled are in neither. `None` if the tick rejects the file, the record's voltage is not held, or the
    /// record lasts longer than 5000 s.
    pub fixed_point_error_v: Option<f64>,
    /// Lowest and highest voltage at which the record shows a nonlinear static law, in normalised V; `None` without one.
    pub law_range_v: Option<[f64; 2]>,
    /// Why the tick rejects the file; `None` if it accepts it.
    pub tick_refuses: Option<String>,
}

/// Exports a fitted model, under which the reading may have a zero and a gain relative to the nominal ones; `held` says that the record's
/// voltage is held between rows. A negative share whose 95 % interval contains 0 is 0 in the file, since no tick runs a negative one.
pub(crate) fn export(engine: &mut Engine, model: &Model, reading_map: Option<[f64; 2]>, held: bool) -> Export {
    let log_likelihood = |engine: &mut Engine, model: &Model| engine.evaluate(model.clone()).log_likelihood;
    let whole = model
        .without_negative_share()
        .filter(|whole| log_likelihood(engine, whole) > log_likelihood(engine, model) - NATS_WITHIN_INTERVAL);
    let model = whole.as_ref().unwrap_or(model);
    let (data, base) = (engine.data, engine.base());
    let mut file = restored(engine, &model.extend(base, data));
    if let Some([zero_v, gain]) = reading_map {
        let nominal = file.reading.unwrap_or_default();
        file.reading = Some(Reading { gain: gain * nominal.gain, zero: nominal.zero + data.scales().reading * zero_v });
    }
    let tick_refuses = file.check().err().map(|error| error.to_string());
    let duration_s = data.scales().restored(Dimension::Time, data.duration_s());
    let runs = held && duration_s * RATE_HZ < MOST_TICKS && tick_refuses.is_none();
    let fixed_point_error_v = runs.then(|| tick_error(model, base, data, &file)).flatten();
    let law = index_of("static-nonlinearity").filter(|law| model.has(*law));
    let law_range_v = law.map(|_| model.known_law(base, data)).map(|range| [range.low, range.high]);
    Export { file, fixed_point_error_v, law_range_v, tick_refuses }
}

/// Returns a normalised spring in the file's units.
pub(crate) fn restored(engine: &Engine, file: &PlantFile) -> PlantFile {
    engine.data.normalisation.restored_plant(file)
}

/// Largest absolute difference between the tick and the fitted spring, in V; `None` if the tick fails.
fn tick_error(model: &Model, base: &Base, data: &Data, file: &PlantFile) -> Option<f64> {
    // The command of several records is that of the first.
    let data = data.parts.first().map_or(data, |part| &part.data);
    let mut applied = data.command.clone();
    model.chain(base, data).amplify(&mut applied);
    let row = |(&time_s, voltage_v)| Row { line: 0, time_s, voltage_v, measured: None };
    let rows: Vec<Row> = data.time_s.iter().zip(applied.at_rows()).map(row).collect();
    let voltage_v: Vec<f64> = rows.iter().map(|row| row.voltage_v).collect();
    let of_file = |of: &[f64], size: f64| of.iter().map(|value| size * value).collect::<Vec<f64>>();
    let Scales { second_s, volt_v, .. } = *data.scales();
    let (time_s, applied_v) = (of_file(&data.time_s, second_s), of_file(&voltage_v, volt_v));
    let fixed = open_loop::simulate(&file.extended(), RATE_HZ, &time_s, &applied_v).ok()?;

    let schedule = Schedule::from_record(&Record { name: String::new(), rows }, Between::Hold);
    let voltage = Signal::new(&schedule, &data.time_s, 0.0);
    let mut written = model.clone();
    for (block, _) in &model.unmodelled(base, data).blocks {
        written = written.without(block.effect);
    }
    let mut chain = written.chain(base, data);
    chain.memory = chain.memory.at_rest();
    let mut fitted = voltage.clone();
    chain.static_response(&mut fitted);
    chain.relax(&mut fitted, &voltage, &mut InitialState::at_rest(), &mut Vec::new(), None);
    Some(fitted.at_rows().zip(&fixed).map(|(fitted, fixed)| (volt_v * fitted - fixed).abs()).fold(0.0, f64::max))
}
