//! The real voltage changes at a bounded rate: `|du/dt| <= slew`. Its lag grows with the step; a delay's does not.

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct AmplifierSlew;

/// Rates, in V/s, at which a full stroke takes the whole record or a tenth of a sample.
fn range(data: &Data) -> (f64, f64) {
    let stroke = data.full_scale_v.max(1e-6);
    (stroke / data.duration_s().max(1e-6), 10.0 * stroke / data.sample_s)
}

impl Effect for AmplifierSlew {
    fn cause(&self) -> &'static str {
        "amplifier-slew"
    }

    fn stage(&self) -> Stage {
        Stage::Amplifier
    }

    fn meaning(&self) -> &'static str {
        "the amplifier's voltage changes at a bounded rate"
    }

    fn experiment(&self) -> &'static str {
        "single steps of very different heights: a slew lag grows with the step"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let (slowest, fastest) = range(data);
        vec![Coordinate::log(slowest, fastest)]
    }

    fn starts(&self, _: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        let (slowest, fastest) = range(data);
        let (from, to) = ((2.0 * slowest).ln(), (0.8 * fastest).ln());
        (0..20).map(|part| vec![from + (to - from) * f64::from(part) / 19.0]).collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("slew_v_per_s", "V/s", point[0].exp())]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn change<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.slew_v_per_s = chain.slew_v_per_s.min(point[0].exp());
    }
}
