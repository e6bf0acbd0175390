//! Charge leakage: a fraction of the stiffness decays with a time constant of its own while the voltage is constant.
//!
//! ```text
//! q = f - (1 - instantaneous) share lag(tau; f)        y = relaxation(q) - instantaneous share lag(tau; f)
//! ```
//!
//! In one form all of the loss passes the relaxation, in the other a part of it is instantaneous.
//!
//! Leakage lowers the settled value by `share`; creep does not change it, and drift depends on time alone.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity, table};
use crate::plant::chain::Chain;
use crate::plant::leakage::Loss;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::stats::thresholds::empirical::FASTEST_LEAKAGE;

pub(super) struct ChargeLeakage;

const WITH_INSTANTANEOUS_PART: usize = 1;

/// Time constants of the loss at initial points, in normalised s: 0.7 to 23 reference time constants.
const INITIAL_TIME_CONSTANTS_S: [f64; 6] = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0];

fn loss(point: &[f64]) -> Loss {
    Loss { share: point[0], tau_s: point[1].exp(), instantaneous: point.get(2).copied().unwrap_or(0.0) }
}

impl Effect for ChargeLeakage {
    fn cause(&self) -> &'static str {
        "charge-leakage"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    /// A loss that is over before the response has settled only lowers the settled value: it is a gain.
    fn location_at(&self, _: usize, point: &[f64], _: &Data) -> Location {
        if point[1].exp() < REFERENCE_TIME_CONSTANT_S { Location::Static } else { self.location() }
    }

    fn description(&self) -> &'static str {
        "stiffness falls back while the voltage stays"
    }

    fn isolating_experiment(&self) -> &'static str {
        "one step, held for minutes: only leakage lets the stiffness fall while the voltage stays"
    }

    fn forms(&self) -> usize {
        2
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let fastest = FASTEST_LEAKAGE.get() * REFERENCE_TIME_CONSTANT_S;
        let longest = 10.0 * data.duration_s().max(fastest);
        let mut coordinates = vec![Coordinate::new(0.0, 1.0), Coordinate::log(fastest, longest)];
        coordinates.extend((form == WITH_INSTANTANEOUS_PART).then_some(Coordinate::new(0.0, 1.0)));
        coordinates
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let longest = data.duration_s();
        INITIAL_TIME_CONSTANTS_S
            .into_iter()
            .filter(|&tau: &f64| tau < longest)
            .map(|tau| [0.1, tau.ln()].into_iter().chain((form == WITH_INSTANTANEOUS_PART).then_some(0.5)).collect())
            .collect()
    }

    fn quantities(&self, _: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        vec![
            Quantity::new("share", Dimension::Ratio, point[0]),
            Quantity::new("tau_s", Dimension::Time, point[1].exp()),
        ]
    }

    /// A plant file represents one loss, all of which passes the relaxation.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, chain: &Chain) -> Option<toml::Value> {
        let passes = loss(point).instantaneous == 0.0 || loss(point).equivalent_leakage(&chain.relaxation).is_some();
        (chain.losses.len() > 1 || !passes).then(|| table(self, form, point, data))
    }

    fn modify_chain<'a>(&self, _: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.losses.push(loss(point));
    }
}
