//! The amplifier's voltage saturates below the command.
//!
//! | form | |
//! | --- | --- |
//! | sharp | `u = min(command, limit)` in magnitude |
//! | with a knee | the same, [approached gradually](crate::plant::knee) |
//! | of one sign | sharp, of the positive or of the negative voltages alone, where the record has both |

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity, table};
use crate::plant::chain::{Chain, Limited};
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
        // The lower limit counts; an equal one is that of a plant file, which holds no knee.
        if point[0] <= chain.limit_v {
            (chain.limit_v, chain.knee_v) = (point[0], if form == WITH_KNEE { point[1].exp() } else { 0.0 });
            chain.limited = match form {
                POSITIVE => Limited::Positive,
                NEGATIVE => Limited::Negative,
                _ => Limited::Both,
            };
        }
    }
}
