//! The static gain is not 1: `f = gain u`.

use crate::diagnose::base::extend_law;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};
use crate::diagnose::signal::Signal;
use crate::plant_file::PlantFile;

pub(super) struct GainError;

impl Effect for GainError {
    fn cause(&self) -> &'static str {
        "gain-error"
    }

    fn stage(&self) -> Stage {
        Stage::Static
    }

    fn meaning(&self) -> &'static str {
        "the static gain is not 1"
    }

    fn experiment(&self) -> &'static str {
        "one step, held for ten time constants: the settled value tells the gain"
    }

    fn special_case_of(&self) -> &'static [&'static str] {
        &["static-nonlinearity"]
    }

    fn coordinates(&self, _: usize, _: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(0.02, 50.0)]
    }

    fn starts(&self, _: usize, _: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.9], vec![1.1]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("gain", "", point[0])]
    }

    fn extend(&self, _: usize, point: &[f64], data: &Data, file: &mut PlantFile) {
        extend_law(file, data.full_scale_v, 2, |stiffness| point[0] * stiffness);
    }

    fn drive(&self, _: usize, point: &[f64], _: &Data, signal: &mut Signal) {
        signal.map(|voltage| point[0] * voltage);
    }
}
