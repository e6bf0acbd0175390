//! The time constant of the relaxation depends on the voltage or on its direction: linearly or geometrically from `tau_low` at 0 V to
//! `tau_high` at the nominal spring's reference voltage: 500 V, or its file's `tau_high_at_v`.
//!
//! | form | interpolation | depends on |
//! | --- | --- | --- |
//! | 0, 1 | linear, geometric | the voltage across the spring |
//! | 2, 3 | linear, geometric | the spring's own state: the relaxed part, and a fraction of the remaining change |
//! | 4 | one value each | whether the relaxed part rises or falls |

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::plant::relaxation::Relaxation;
use crate::plant::visited::Axis;
use crate::record::data::Data;

pub(super) struct VoltageDependentTimeConstant;

/// Time constants at both voltages at initial points, in normalised s, in which the reference time constant is 5.5 s.
const INITIAL_TIME_CONSTANTS_S: [(f64, f64); 8] =
    [(5.5, 6.5), (5.5, 4.5), (6.5, 4.5), (4.5, 6.5), (4.5, 5.5), (6.5, 5.5), (9.0, 3.0), (3.0, 9.0)];

/// Each form that interpolates: geometric interpolation, and dependence on the spring's own state.
const FORMS: [(bool, bool); 4] = [(false, false), (true, false), (false, true), (true, true)];
/// The form with a time constant for each direction.
const BY_DIRECTION: usize = 4;

/// Returns true if a form depends on the spring's own state.
fn by_state(form: usize) -> bool {
    FORMS.get(form).is_some_and(|(_, by_state)| *by_state)
}

impl Effect for VoltageDependentTimeConstant {
    fn cause(&self) -> &'static str {
        "voltage-dependent-time-constant"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn description(&self) -> &'static str {
        "the relaxation time changes with the voltage"
    }

    fn isolating_experiment(&self) -> &'static str {
        "equal small steps at several voltages, each held for five time constants"
    }

    fn forms(&self) -> usize {
        FORMS.len() + 1
    }

    /// Returns the constant time constant nearest to a point: the geometric mean of both ends. It does not see a nominal ratio of them.
    fn nearest_special_case(&self, _: usize, point: &[f64], _: &Data) -> Option<(&'static str, usize, Vec<f64>)> {
        Some(("time-constant", 0, vec![0.5 * (point[0] + point[1])]))
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let coordinate = Coordinate::log(0.2 * data.sample_s, 10.0 * data.duration_s());
        let mut coordinates = vec![coordinate, coordinate];
        coordinates.extend(by_state(form).then(|| Coordinate::new(0.0, 1.0)));
        coordinates
    }

    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        if (form == BY_DIRECTION || by_state(form)) && !context.data.estimates_any_start() {
            return Vec::new();
        }
        let start = |(low, high): (f64, f64)| {
            let mut point = vec![low.ln(), high.ln()];
            point.extend(by_state(form).then_some(context.data.normalisation.share));
            point
        };
        // Where the prediction is not linear in an unknown initial state, each start takes several simulations.
        let is_costly = context.data.initial_state_unknown && (form == BY_DIRECTION || by_state(form));
        let starts = if is_costly { &INITIAL_TIME_CONSTANTS_S[2..4] } else { &INITIAL_TIME_CONSTANTS_S[..] };
        starts.iter().copied().map(start).collect()
    }

    fn quantities(&self, form: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        if form == BY_DIRECTION {
            let of = |name: &str, tau: f64| Quantity::new(name, Dimension::Time, tau.exp());
            return vec![of("tau_rising_s", point[0]), of("tau_falling_s", point[1])];
        }
        let axis = if by_state(form) { Axis::Stiffness } else { Axis::Voltage };
        let end =
            |name: &str, point: f64, at_v| Quantity::new(name, Dimension::Time, point.exp()).end_of_curve(axis, at_v);
        vec![end("tau_low_s", point[0], 0.0), end("tau_high_s", point[1], Relaxation::HIGH_V)]
    }

    /// In the fixed-point tick the time constant is linear in the voltage.
    fn unmodelled(&self, form: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        if form == BY_DIRECTION {
            return Some("fitted with a time constant for each direction, written with their geometric mean".into());
        }
        match FORMS[form] {
            (false, false) => None,
            (true, false) => Some("fitted as geometric between its ends, written as straight".into()),
            (false, true) => Some("fitted by the spring's own state, written by the voltage".into()),
            (true, true) => Some(
                "fitted as geometric between its ends and by the spring's own state, written as straight and by the voltage"
                    .into(),
            ),
        }
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        chain.relaxation.tau_s = point[0].exp();
        if form == BY_DIRECTION {
            chain.relaxation.tau_high_s = chain.relaxation.tau_s;
            chain.relaxation.falling_tau_s = Some(point[1].exp());
            return;
        }
        chain.relaxation.tau_high_s = point[1].exp();
        chain.relaxation.geometric = FORMS[form].0;
        chain.relaxation.by_state = FORMS[form].1.then(|| point[2]);
    }
}
