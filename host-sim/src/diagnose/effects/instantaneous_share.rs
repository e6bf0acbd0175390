//! The immediate part of a step is not 1/11.

use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};
use crate::diagnose::relaxation::Relaxation;
use crate::plant_file::PlantFile;

pub(super) struct InstantaneousShare;

impl Effect for InstantaneousShare {
    fn cause(&self) -> &'static str {
        "instantaneous-share"
    }

    fn stage(&self) -> Stage {
        Stage::Relaxation
    }

    fn meaning(&self) -> &'static str {
        "the part of a step that comes at once is another"
    }

    fn experiment(&self) -> &'static str {
        "steps read within a hundredth of the time constant"
    }

    fn coordinates(&self, _: usize, _: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(-0.2, 0.98)]
    }

    fn starts(&self, _: usize, _: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.04], vec![0.2]]
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("share", "", point[0])]
    }

    /// The relaxation is written as a whole, by [`Relaxation::extend`].
    fn extend(&self, _: usize, _: &[f64], _: &Data, _: &mut PlantFile) {}

    fn relax(&self, _: usize, point: &[f64], relaxation: &mut Relaxation) {
        relaxation.share = point[0];
    }
}
