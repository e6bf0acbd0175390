//! The amplifier's voltage saturates below the command: `|u| = min(|command|, limit)`.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct AmplifierLimit;

impl Effect for AmplifierLimit {
    fn cause(&self) -> &'static str {
        "amplifier-limit"
    }

    fn location(&self) -> Location {
        Location::Amplifier
    }

    fn description(&self) -> &'static str {
        "the amplifier's voltage stops below the commanded one"
    }

    fn isolating_experiment(&self) -> &'static str {
        "a stair in small steps up to the full voltage: above the limit nothing changes any more, not even the instantaneous part"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(0.05 * data.full_scale_v, data.full_scale_v)]
    }

    fn initial_points(&self, _: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        (1..20)
            .map(|part| vec![data.full_scale_v * (1.0 - 0.04 * f64::from(part))])
            .chain([vec![0.985 * data.full_scale_v]])
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("limit_v", Dimension::Voltage, point[0])]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.limit_v = chain.limit_v.min(point[0]);
    }
}
