//! Part of the response relaxes with another, slower time constant (creep); the settled value stays.
//!
//! ```text
//! of the rest:    y = share q + (1 - share - creep) lag(tau; q) + creep lag(slow; q)
//! of everything:  y = (1 - creep) (share q + (1 - share) lag(tau; q)) + creep lag(slow; q)
//! ```

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct SecondRelaxation;

const OF_THE_REST: usize = 0;
/// It is the slower one.
const FASTEST_S: f64 = 5.5;

impl Effect for SecondRelaxation {
    fn cause(&self) -> &'static str {
        "second-relaxation"
    }

    fn stage(&self) -> Stage {
        Stage::Relaxation
    }

    fn meaning(&self) -> &'static str {
        "part of the response creeps with a slower time constant"
    }

    fn experiment(&self) -> &'static str {
        "one step, held for minutes: creep goes on rising to the same settled value"
    }

    fn forms(&self) -> usize {
        2
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(0.0, 0.9), Coordinate::log(FASTEST_S, 10.0 * data.duration_s().max(FASTEST_S))]
    }

    fn starts(&self, _: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        [9.0, 15.0, 25.0, 45.0, 80.0, 150.0, 300.0]
            .into_iter()
            .filter(|&tau: &f64| tau < 3.0 * data.duration_s())
            .map(|tau| vec![0.1, tau.ln()])
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("share", "", point[0]), Quantity::new("tau_s", "s", point[1].exp())]
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn change<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.relaxation.creep = point[0];
        chain.relaxation.creep_tau_s = point[1].exp();
        if form != OF_THE_REST {
            chain.relaxation.share *= 1.0 - point[0];
        }
    }
}
