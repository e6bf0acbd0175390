//! Derivatives of a fit that the first fits of its extensions take over.
//!
//! A search adds one block to a fit in many forms. While that block is fitted for the first time the others move little: their
//! derivatives at the fit serve every form, and a round of the Levenberg-Marquardt method costs simulations for the new block alone.
//! A step is still taken only if the likelihood increases, and what the search goes on with is fitted again.

use std::collections::HashMap;

use crate::effects::model::Model;
use crate::fit::engine::{Engine, Fit};
use crate::fit::normal_equations::Jacobian;
use crate::noise::Noise;

/// A coordinate of a model: the index of its effect, and that of the coordinate in the effect's block.
pub(super) type Place = (usize, usize);

/// Columns of a Jacobian by the coordinate; the default has none.
#[derive(Debug, Default)]
pub struct Known {
    columns: HashMap<Place, Vec<f64>>,
}

impl Known {
    /// Returns the derivatives at a fit, whitened by the law under which its extensions are fitted.
    pub fn at(engine: &mut Engine, fit: &Fit, law: &Noise) -> Self {
        let Jacobian { places, columns } = engine.jacobian(&fit.model, law, &fit.residual);
        let all = Self::places(&fit.model);
        Self { columns: places.into_iter().map(|place| all[place]).zip(columns).collect() }
    }

    /// Returns the column of a coordinate.
    pub(super) fn column(&self, place: Place) -> Option<&Vec<f64>> {
        self.columns.get(&place)
    }

    /// Returns all coordinates of a model, in the order of its points.
    pub(super) fn places(model: &Model) -> Vec<Place> {
        let blocks = model.blocks.iter();
        blocks.flat_map(|(block, point)| (0..point.len()).map(|index| (block.effect, index))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::Block;
    use crate::fit::budget::{Budget, Effort};
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// A step of a spring with another time constant and gain: the time constant is added to a fit of the gain alone.
    #[test]
    fn known_derivatives_lead_to_the_same_fit_for_less_work() {
        let noise = normals(200);
        let reading = |row: usize| match row {
            0..20 => noise[row],
            _ => 330.0 * (1.0 - 10.0 / 11.0 * f64::exp(-(row as f64 - 20.0) * 0.2 / 8.0)) + noise[row],
        };
        let voltage_v = |row: usize| if row < 20 { 0.0 } else { 300.0 };
        let row = |row: usize| Row {
            line: row,
            time_s: row as f64 * 0.2,
            voltage_v: voltage_v(row),
            measured: Some(reading(row)),
        };
        let record = Record { name: String::new(), rows: (0..200).map(row).collect() };
        let data = Data { initial_state_unknown: false, ..Data::new(&record, Input::Hold) };
        let (observed, base) = (Observed::new(&data), Base::paper());
        let block = |cause| Block { effect: index_of(cause).unwrap(), form: 0 };
        let approached = |is_known: bool| {
            let budget = Budget::new(Effort::Thorough, 200, Default::default());
            let mut engine = Engine::within(&data, &observed, &base, &budget);
            let gain = engine.fit_twice(Model::default().with(block("gain-error"), vec![1.0]));
            let law = Noise::default_robust();
            let known = if is_known { Known::at(&mut engine, &gain, &law) } else { Known::default() };
            let before = budget.spent();
            let model = gain.model.with(block("time-constant"), vec![5.5f64.ln()]);
            let (model, value) = engine.approached(model, &law, &known);
            (model.points(), value, budget.spent() - before)
        };
        let (known, full) = (approached(true), approached(false));
        let near = |of: usize| (known.0[of] - full.0[of]).abs() < 0.003;
        assert!(near(0) && near(1) && (known.1 - full.1).abs() < 0.1, "{known:?} {full:?}");
        assert!(4 * known.2 < 3 * full.2, "{known:?} {full:?}");
    }
}
