//! The static gain is not the nominal one, which is 1: `f = gain u`.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct GainError;

/// Returns the size of the gain relative to the nominal one: 1, or that of the search's start, of any sign and size.
fn size(data: &Data) -> f64 {
    data.normalisation.start.map_or(1.0, |start| start.gain)
}

impl Effect for GainError {
    fn cause(&self) -> &'static str {
        "gain-error"
    }

    fn location(&self) -> Location {
        Location::Static
    }

    fn description(&self) -> &'static str {
        "the static gain is not 1"
    }

    fn isolating_experiment(&self) -> &'static str {
        "one step, held for ten time constants: the settled value gives the gain"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::between(0.02 * size(data), 50.0 * size(data))]
    }

    fn initial_points(&self, _: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        vec![vec![0.9 * size(data)], vec![1.1 * size(data)]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("gain", Dimension::Ratio, point[0])]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.gain *= point[0];
        chain.law.push(|voltage| point[0] * voltage);
    }
}
