//! The feedthrough, the part of a step that is reached without delay, is not 1/11.

use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct InstantaneousShare;

impl Effect for InstantaneousShare {
    fn cause(&self) -> &'static str {
        "instantaneous-share"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn description(&self) -> &'static str {
        "the instantaneous part of a step (feedthrough) differs"
    }

    fn isolating_experiment(&self) -> &'static str {
        "steps read within a hundredth of the time constant"
    }

    fn coordinates(&self, _: usize, _: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(-0.2, 1.0)]
    }

    fn initial_points(&self, _: usize, _: &FitContext) -> Vec<Vec<f64>> {
        vec![vec![0.04], vec![0.2]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("share", "", point[0])]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.relaxation.share = point[0];
    }
}
