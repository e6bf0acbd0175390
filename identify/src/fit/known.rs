//! Derivatives of a fit that the first fits of its extensions take over.
//!
//! A search adds one block to a fit in many forms. While that block is fitted for the first time the others move little: their
//! derivatives at the fit serve every form, and a round of the Levenberg-Marquardt method costs simulations for the new block alone.
//! A step is still taken only if the likelihood increases, and what the search goes on with is fitted again.

use std::collections::HashMap;

use crate::effects::model::Model;
use crate::fit::normal_equations::Jacobian;

/// A coordinate of a model: the index of its effect, and that of the coordinate in the effect's block; `None` for the relaxation.
pub(super) type Place = (Option<usize>, usize);

/// Columns of a Jacobian by the coordinate; the default has none.
#[derive(Debug, Default)]
pub struct Known {
    columns: HashMap<Place, Vec<f64>>,
}

impl Known {
    /// Names the columns of a model's Jacobian.
    pub(super) fn of(model: &Model, Jacobian { places, columns }: Jacobian) -> Self {
        let all = Self::places(model);
        Self { columns: places.into_iter().map(|place| all[place]).zip(columns).collect() }
    }

    /// Returns the column of a coordinate.
    pub(super) fn column(&self, place: Place) -> Option<&Vec<f64>> {
        self.columns.get(&place)
    }

    /// Returns all coordinates of a model, in the order of its points.
    pub(super) fn places(model: &Model) -> Vec<Place> {
        let blocks = model.blocks.iter().map(|(block, point)| (Some(block.effect), point.len()));
        let all = blocks.chain([(None, model.relaxation.len())]);
        all.flat_map(|(effect, count)| (0..count).map(move |index| (effect, index))).collect()
    }
}
