//! A record for tests of checks: the paper's spring with another time constant, and noise.

use crate::effects::index_of;
use crate::effects::model::{Block, Model};
use crate::fit::engine::{Engine, Fit};
use crate::fit::simulator::Simulator;
use crate::plant::base::Base;
use crate::record::data::Data;
use crate::record::input::Input;
use crate::record::observed::Observed;
use simulation::record::{Record, Row};

/// Time between two rows, in s.
pub(super) const STEP_S: f64 = 0.1;

/// Evaluates the paper's spring on a record of one with the time constant `tau_s`, in s, under the voltage of each row in V, with
/// a row of noise in V for each row of readings, and returns what `test` makes of it.
pub(super) fn on_spring<R>(
    tau_s: f64,
    volts: impl Fn(usize) -> f64,
    noise: &[f64],
    test: impl FnOnce(&Engine, Fit) -> R,
) -> R {
    let row = |row: usize| Row { line: row, time_s: STEP_S * row as f64, voltage_v: volts(row), measured: Some(0.0) };
    let mut data = Data::new(&Record { name: String::new(), rows: (0..noise.len()).map(row).collect() }, Input::Hold);
    let base = Base::paper();
    let time_constant = Block { effect: index_of("time-constant").unwrap(), form: 0 };
    let mut readings = Vec::new();
    Simulator::new(&data, &base).run(&Model::default().with(time_constant, vec![tau_s.ln()]), &mut readings);
    data.reading = readings.iter().zip(noise).map(|(reading, noise)| reading + noise).collect();
    let observed = Observed::new(&data);
    let mut engine = Engine::new(&data, &observed, &base);
    let fit = engine.evaluate(Model::default());
    test(&engine, fit)
}
