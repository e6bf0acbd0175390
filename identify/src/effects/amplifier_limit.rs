//! The amplifier's voltage saturates below the command.
//!
//! | form | |
//! | --- | --- |
//! | sharp | `u = min(command, limit)` in magnitude |
//! | with a knee | the same, [approached gradually](crate::plant::knee) |
//! | of one sign | sharp, of the positive or of the negative voltages alone, where the record has both |

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity, table};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct AmplifierLimit;

const WITH_KNEE: usize = 1;
const POSITIVE: usize = 2;
const NEGATIVE: usize = 3;
/// Bounds of a knee, relative to the full scale, and the one that is tried.
const KNEES: (f64, f64) = (0.003, 0.15);
const INITIAL_KNEE: f64 = 0.03;

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

    fn forms(&self) -> usize {
        4
    }

    fn common_forms(&self) -> usize {
        1
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let limit = Coordinate::new(0.05 * data.full_scale_v, data.full_scale_v);
        let knee = Coordinate::log(KNEES.0 * data.full_scale_v.max(1.0), KNEES.1 * data.full_scale_v.max(1.0));
        if form == WITH_KNEE { vec![limit, knee] } else { vec![limit] }
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        if matches!(form, POSITIVE | NEGATIVE) && !data.has_both_signs() {
            return Vec::new();
        }
        let limits = (1..20).map(|part| data.full_scale_v * (1.0 - 0.04 * f64::from(part)));
        let knee = (INITIAL_KNEE * data.full_scale_v.max(1.0)).ln();
        let point = |limit: f64| if form == WITH_KNEE { vec![limit, knee] } else { vec![limit] };
        limits.chain([0.985 * data.full_scale_v]).map(point).collect()
    }

    fn quantities(&self, form: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        let knee = (form == WITH_KNEE).then(|| Quantity::new("knee_v", Dimension::Voltage, point[1].exp()));
        let limit = match form {
            NEGATIVE => Quantity::new("lower_limit_v", Dimension::Voltage, -point[0]),
            _ => Quantity::new("limit_v", Dimension::Voltage, point[0]),
        };
        std::iter::once(limit).chain(knee).collect()
    }

    /// A plant file holds a sharp limit of both signs.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, _: &Chain) -> Option<toml::Value> {
        (form > 0).then(|| table(self, form, point, data))
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        let limits_v = match form {
            POSITIVE => &mut chain.limits_v[..1],
            NEGATIVE => &mut chain.limits_v[1..],
            _ => &mut chain.limits_v,
        };
        // The lower limit counts; an equal one is that of a plant file, which holds no knee.
        for limit_v in limits_v.iter_mut().filter(|limit_v| point[0] <= **limit_v) {
            *limit_v = point[0];
            chain.knee_v = if form == WITH_KNEE { point[1].exp() } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::plant::base::Base;
    use crate::record::input::Input;
    use simulation::plant_file::{Amplifier, PlantFile};
    use simulation::record::{Record, Row};

    #[test]
    fn a_limit_of_one_sign_leaves_the_nominal_one_of_the_other() {
        let amplifier = Amplifier { limit_v: Some(400.0), ..Amplifier::default() };
        let base = Base::new(PlantFile { amplifier: Some(amplifier), ..model::Plant::PAPER.into() }).unwrap();
        let row = |row: usize| Row { line: row, time_s: row as f64, voltage_v: 500.0, measured: Some(0.0) };
        let data = Data::new(&Record { name: String::new(), rows: (0..20).map(row).collect() }, Input::Hold);
        let limits_v = |form, limit_v| {
            let block = Block { effect: index_of("amplifier-limit").unwrap(), form };
            Model::default().with(block, vec![limit_v]).chain(&base, &data).limits_v
        };
        assert_eq!([limits_v(POSITIVE, 300.0), limits_v(NEGATIVE, 300.0)], [[300.0, 400.0], [400.0, 300.0]]);
        assert_eq!([limits_v(0, 300.0), limits_v(POSITIVE, 450.0)], [[300.0; 2], [400.0; 2]]);
    }
}
