//! The static gain is not 1: `f = gain u`.

use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct GainError;

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

    fn special_case_of(&self) -> &'static [&'static str] {
        &["static-nonlinearity"]
    }

    fn coordinates(&self, _: usize, _: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(0.02, 50.0)]
    }

    fn initial_points(&self, _: usize, _: &FitContext) -> Vec<Vec<f64>> {
        vec![vec![0.9], vec![1.1]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("gain", "", point[0])]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.law.push(|voltage| point[0] * voltage);
    }
}
