//! Stiffness falls back while the voltage stays: a part of it leaks away with a time constant of its own.
//!
//! ```text
//! before the relaxation:  q = f - share lag(tau; f)
//! after it:               y' = y - share lag(tau; f)
//! ```
//!
//! Leakage lowers the settled value by `share`; creep keeps it, and drift follows the clock.

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage, table};
use crate::plant_file::Leakage;

pub(super) struct ChargeLeakage;

/// What leaks faster than the spring relaxes is never seen to fall back: it is a gain.
const FASTEST_S: f64 = 3.5;

impl Effect for ChargeLeakage {
    fn cause(&self) -> &'static str {
        "charge-leakage"
    }

    fn stage(&self) -> Stage {
        Stage::Relaxation
    }

    fn meaning(&self) -> &'static str {
        "stiffness falls back while the voltage stays"
    }

    fn experiment(&self) -> &'static str {
        "one step, held for minutes: only leakage lets the stiffness fall while the voltage stays"
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        vec![Coordinate::new(0.0, 1.0), Coordinate::log(FASTEST_S, 10.0 * data.duration_s().max(FASTEST_S))]
    }

    fn starts(&self, _: usize, Scene { data, .. }: &Scene) -> Vec<Vec<f64>> {
        let longest = data.duration_s();
        [4.0, 8.0, 16.0, 32.0, 64.0, 128.0]
            .into_iter()
            .filter(|&tau: &f64| tau < longest)
            .map(|tau| vec![0.1, tau.ln()])
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("share", "", point[0]), Quantity::new("tau_s", "s", point[1].exp())]
    }

    /// A plant file holds one.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, chain: &Chain) -> Option<toml::Value> {
        (chain.leakages.len() > 1).then(|| table(self, form, point, data))
    }

    fn change<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.leakages.push(Leakage { share: point[0], tau_s: point[1].exp() });
    }
}
