//! The real voltage stops below the commanded one: `|u| = min(|command|, limit)`.

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct AmplifierLimit;

impl Effect for AmplifierLimit {
    fn cause(&self) -> &'static str {
        "amplifier-limit"
    }

    fn stage(&self) -> Stage {
        Stage::Amplifier
    }

    fn meaning(&self) -> &'static str {
        "the amplifier's voltage stops below the commanded one"
    }

    fn experiment(&self) -> &'static str {
        "a stair in small steps up to the full voltage: above the limit nothing moves any more, not even at once"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(0.05 * data.full_scale_v, data.full_scale_v)]
    }

    fn starts(&self, _: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        (1..20)
            .map(|part| vec![data.full_scale_v * (1.0 - 0.04 * f64::from(part))])
            .chain([vec![0.985 * data.full_scale_v]])
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("limit_v", "V", point[0])]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn change<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.limit_v = chain.limit_v.min(point[0]);
    }
}
