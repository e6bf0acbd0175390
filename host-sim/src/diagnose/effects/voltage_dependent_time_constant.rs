//! The relaxation time changes with the voltage: straight or geometric from `tau_low` at 0 V to `tau_high` at 500 V.

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct VoltageDependentTimeConstant;

const GEOMETRIC: usize = 1;

impl Effect for VoltageDependentTimeConstant {
    fn cause(&self) -> &'static str {
        "voltage-dependent-time-constant"
    }

    fn stage(&self) -> Stage {
        Stage::Relaxation
    }

    fn meaning(&self) -> &'static str {
        "the relaxation time changes with the voltage"
    }

    fn experiment(&self) -> &'static str {
        "equal small steps at several voltages, each held for five time constants"
    }

    fn forms(&self) -> usize {
        2
    }

    fn coordinates(&self, _: usize, data: &Data) -> Vec<Coordinate> {
        let coordinate = Coordinate::log(0.2 * data.sample_s, 10.0 * data.duration_s());
        vec![coordinate, coordinate]
    }

    fn starts(&self, _: usize, _: &Scene) -> Vec<Vec<f64>> {
        [(5.5, 6.5), (5.5, 4.5), (6.5, 4.5), (4.5, 6.5), (4.5, 5.5), (6.5, 5.5), (9.0, 3.0), (3.0, 9.0)]
            .map(|(low, high): (f64, f64)| vec![low.ln(), high.ln()])
            .to_vec()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![Quantity::new("tau_low_s", "s", point[0].exp()), Quantity::new("tau_high_s", "s", point[1].exp())]
    }

    /// The tick's time constant is straight between both ends.
    fn unmodelled(&self, form: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        (form == GEOMETRIC).then(|| "fitted as geometric between its ends, written as straight".into())
    }

    fn change<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.relaxation.tau_s = point[0].exp();
        chain.relaxation.tau_high_s = point[1].exp();
        chain.relaxation.geometric = form == GEOMETRIC;
    }
}
