//! A part of the response relaxes with a second, slower time constant (creep); the settled value does not change.
//!
//! | form | what relaxes |
//! | --- | --- |
//! | of the rest | `y = share_0 q + (1 - share_0 - creep) lag(tau; q) + creep lag(slow; q)` |
//! | of everything | `y = (1 - creep) (share_0 q + (1 - share_0) lag(tau; q)) + creep lag(slow; q)` |
//! | by decades | as of everything, in three equal parts: `slow / 10`, `slow`, `10 slow` (logarithmic creep) |
//! | spread | of the rest, in two equal parts, to both sides: `slow` and `tau^2 / slow` (a broad relaxation) |

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::plant::relaxation::Part;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::stats::thresholds::empirical::FASTEST_CREEP;

pub(super) struct SecondRelaxation;

/// Slow time constants at initial points, in normalised s: 1.6 to 55 reference time constants.
const INITIAL_TIME_CONSTANTS_S: [f64; 7] = [9.0, 15.0, 25.0, 45.0, 80.0, 150.0, 300.0];

const OF_THE_REST: usize = 0;
const OF_EVERYTHING: usize = 1;
const BY_DECADES: usize = 2;

impl Effect for SecondRelaxation {
    fn cause(&self) -> &'static str {
        "second-relaxation"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn description(&self) -> &'static str {
        "part of the response creeps with a slower time constant"
    }

    fn isolating_experiment(&self) -> &'static str {
        "one step, held for minutes: creep goes on rising to the same settled value"
    }

    fn forms(&self) -> usize {
        4
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let fastest = FASTEST_CREEP.get() * REFERENCE_TIME_CONSTANT_S;
        vec![Coordinate::new(0.0, 0.9), Coordinate::log(fastest, 10.0 * data.duration_s().max(fastest))]
    }

    fn initial_points(&self, _: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        INITIAL_TIME_CONSTANTS_S
            .into_iter()
            .filter(|&tau: &f64| tau < 3.0 * data.duration_s())
            .map(|tau| vec![0.1, tau.ln()])
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![
            Quantity::new("share", Dimension::Ratio, point[0]),
            Quantity::new("tau_s", Dimension::Time, point[1].exp()),
        ]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        let (creep, slow_s) = (point[0], point[1].exp());
        let relaxation = &mut chain.relaxation;
        let parts = |times: &[f64]| {
            let part = |&tau_s: &f64| Part { part: creep / times.len() as f64, tau_s };
            std::array::from_fn(|index| times.get(index).map(part).unwrap_or_default())
        };
        relaxation.further = match form {
            OF_THE_REST | OF_EVERYTHING => parts(&[slow_s]),
            BY_DECADES => parts(&[0.1 * slow_s, slow_s, 10.0 * slow_s]),
            _ => parts(&[slow_s, relaxation.tau_s * relaxation.tau_s / slow_s]),
        };
        if form == OF_EVERYTHING || form == BY_DECADES {
            relaxation.share *= 1.0 - creep;
        }
    }
}
