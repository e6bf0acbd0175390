//! The response starts late: `u(t) = command(t - delay)`.

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct Delay;

fn longest(data: &Data) -> f64 {
    (0.1 * data.duration_s()).max(2.0 * data.sample_s)
}

impl Effect for Delay {
    fn cause(&self) -> &'static str {
        "delay"
    }

    fn stage(&self) -> Stage {
        Stage::Amplifier
    }

    fn meaning(&self) -> &'static str {
        "the response starts late"
    }

    fn experiment(&self) -> &'static str {
        "single steps of very different heights: a delay is the same for all"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(1e-3 * data.sample_s, longest(data))]
    }

    /// Between whole samples: a delay across one makes the prediction jump, and no fit gets over it.
    fn starts(&self, _: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        let mut samples = 0.5;
        let mut starts = Vec::new();
        while samples * data.sample_s < longest(data) {
            starts.push(vec![samples * data.sample_s]);
            samples += f64::max(1.0, (0.08 * samples).floor());
        }
        starts
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("delay_s", "s", point[0])]
    }

    fn places(&self, data: &Data) -> f64 {
        (longest(data) / data.sample_s).clamp(1.0, 5.0).ln()
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn change<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.delay_s += point[0];
    }
}
