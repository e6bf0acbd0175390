//! The feedthrough, the part of a step that is reached without delay, is not the nominal one.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct InstantaneousShare;

/// Nominal share from which initial points on both sides of it are added.
const LARGE: f64 = 0.25;

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

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        // A nominal share outside of 0 to 1 has room on both sides, too.
        let far = 2.0 * data.normalisation.share;
        vec![Coordinate::new(far.min(-0.2), far.max(1.0))]
    }

    fn initial_points(&self, _: usize, context: &FitContext) -> Vec<Vec<f64>> {
        let nominal = context.data.normalisation.share;
        let of_large = [0.5 * nominal, 0.5 * (1.0 + nominal)].into_iter().filter(|_| nominal > LARGE);
        [0.04, 0.2].into_iter().chain(of_large).map(|share| vec![share]).collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("share", Dimension::Ratio, point[0])]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.relaxation.share = point[0];
    }
}
