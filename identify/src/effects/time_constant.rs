//! The time constant of the relaxation is not the nominal one.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct TimeConstant;

/// Time constants at initial points, in normalised s: 0.18 to 5.5 reference time constants.
const INITIAL_TIME_CONSTANTS_S: [f64; 8] = [1.0, 2.5, 4.0, 5.0, 6.0, 8.0, 14.0, 30.0];

impl Effect for TimeConstant {
    fn cause(&self) -> &'static str {
        "time-constant"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn description(&self) -> &'static str {
        "the time constant of the relaxation differs"
    }

    fn isolating_experiment(&self) -> &'static str {
        "a step that is read densely for ten time constants"
    }

    fn special_case_of(&self) -> &'static [&'static str] {
        &["voltage-dependent-time-constant"]
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::log(0.2 * data.sample_s, 10.0 * data.duration_s())]
    }

    fn initial_points(&self, _: usize, _: &FitContext) -> Vec<Vec<f64>> {
        INITIAL_TIME_CONSTANTS_S.map(|tau: f64| vec![tau.ln()]).to_vec()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("tau_s", Dimension::Time, point[0].exp())]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        let factor = point[0].exp() / chain.relaxation.tau_s;
        chain.relaxation.tau_s *= factor;
        chain.relaxation.tau_high_s *= factor;
    }
}
