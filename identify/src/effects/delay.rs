//! The response is delayed: `u(t) = command(t - delay)`.
//!
//! In a uniformly sampled record the prediction jumps where the delay passes a multiple of the sample time, because the
//! rows see a step of the command one row later; in between it is smooth. So the first coordinate is a whole number of
//! rows, which the initial point sets, and the second a fraction above 0 and up to 1 row, which the fit moves. A delay
//! of whole rows, the usual one, is at the upper bound. Rows are those of the whole record, also if only some of them
//! are in use.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct Delay;

fn longest(data: &Data) -> f64 {
    (0.1 * data.duration_s()).max(2.0 * data.record_sample_s)
}

/// Returns a delay as whole rows and the rest above 0, both in s.
fn split(data: &Data, delay_s: f64) -> Vec<f64> {
    let rows = if data.uniform { (delay_s / data.record_sample_s - 1e-6).ceil() - 1.0 } else { 0.0 };
    let whole = rows.max(0.0) * data.record_sample_s;
    vec![whole, delay_s - whole]
}

impl Effect for Delay {
    fn cause(&self) -> &'static str {
        "delay"
    }

    fn location(&self) -> Location {
        Location::Amplifier
    }

    fn description(&self) -> &'static str {
        "the response starts late"
    }

    fn isolating_experiment(&self) -> &'static str {
        "single steps of very different heights: a delay is the same for all"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let most = if data.uniform { data.record_sample_s } else { longest(data) };
        vec![Coordinate::fixed(0.0, longest(data)), Coordinate::new(1e-3 * data.record_sample_s, most)]
    }

    fn initial_points(&self, _: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let mut whole = 0.0;
        let mut starts = Vec::new();
        while whole * data.record_sample_s < longest(data) {
            starts.extend([0.5, 1.0].map(|part| split(data, (whole + part) * data.record_sample_s)));
            whole += f64::max(1.0, (0.08 * whole).floor());
        }
        starts
    }

    /// A linear prediction cannot compare different numbers of rows, and a fit keeps its number.
    fn across_jumps(&self, _: usize, point: &[f64], rows: f64, data: &Data) -> Option<Vec<f64>> {
        let to_s = point[0] + (0.5 + rows) * data.record_sample_s;
        (data.uniform && (0.0..longest(data)).contains(&to_s)).then(|| split(data, to_s))
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("delay_s", Dimension::Time, point[0] + point[1])]
    }

    fn ln_candidates(&self, _: usize, data: &Data) -> f64 {
        (longest(data) / data.record_sample_s).clamp(1.0, 5.0).ln()
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.delay_s += point[0] + point[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::fit::engine::Engine;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// The delay is a whole number of rows, or not; fits start on either side of it.
    #[test]
    fn fit_crosses_from_row_to_row() {
        let volts = |row: usize| [0.0, 300.0, 100.0, 500.0, 200.0][row / 90 % 5];
        let row = |row| Row { line: 0, time_s: 0.1 * row as f64, voltage_v: volts(row), measured: Some(0.0) };
        let record = Record { name: String::new(), rows: (0..900).map(row).collect() };
        let mut data = Data::new(&record, Input::Hold);
        let of = |data: &Data, delay_s| {
            let block = Block { effect: index_of("delay").unwrap(), form: 0 };
            Model::default().with(block, split(data, delay_s))
        };
        let base = Base::paper();
        for delay_s in [0.5, 0.83] {
            let mut readings = Vec::new();
            Simulator::new(&data, &base).run(&of(&data, delay_s), &mut readings);
            data.reading = readings.iter().zip(normals(900)).map(|(reading, noise)| reading + noise).collect();
            let observed = Observed::new(&data);
            let mut engine = Engine::new(&data, &observed, &base);
            for start_s in [-0.2, -0.1, 0.25].map(|off_s| delay_s + off_s) {
                let fit = engine.fit_twice(of(&data, start_s));
                let found_s: f64 = fit.model.points().iter().sum();
                assert!((found_s - delay_s).abs() < 0.02, "{found_s} for {delay_s} from {start_s}");
            }
        }
    }
}
