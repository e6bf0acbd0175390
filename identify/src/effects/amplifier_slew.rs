//! The amplifier's voltage follows the command at a bounded rate; unlike a delay, its lag grows with the step.
//!
//! | form | law |
//! | --- | --- |
//! | both ways | `-slew <= du/dt <= slew` |
//! | two rates | `-falling <= du/dt <= slew` |
//! | power | `-2 slew <= d(u |u| / full scale)/dt <= 2 slew`: a charger of constant power, slower at a high voltage |
//! | with a time constant | `du/dt = (command - u) / tau` within `-slew` to `slew`: an operational amplifier |
//!
//! The exponential approach of an output resistance alone is a `series-lag`. If the record may not begin at rest, the voltage of a
//! rate-limited amplifier before the first row is a further coordinate.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity, logarithms, table};
use crate::effects::series_lag;
use crate::plant::chain::Chain;
use crate::record::data::Data;

pub(super) struct AmplifierSlew;

const BOTH_WAYS: usize = 0;
const TWO_RATES: usize = 1;
const POWER: usize = 2;
const WITH_TIME_CONSTANT: usize = 3;
/// Number of coordinates of a form without the initial voltage.
const COORDINATES: [usize; 4] = [1, 2, 1, 2];
/// Bounds of the time constant, in rows and in durations of the record, and initial ones, in rows.
const SHORTEST: f64 = 0.1;
const LONGEST: f64 = 0.1;
const INITIAL_ROWS: [f64; 2] = [2.0, 8.0];
/// Largest step that an amplifier of one time constant takes without reaching its rate, relative to the full scale.
const LARGEST_LAG: f64 = 0.5;
/// Ratio of the two rates at initial points.
const INITIAL_RATIO: f64 = 3.0;
/// Distance of the initial voltage from the command at initial points, as a fraction of the full scale.
const INITIAL_DISTANCE: f64 = 0.2;

fn stroke(data: &Data) -> f64 {
    data.full_scale_v.max(1e-6)
}

/// Returns the rates, in V/s, at which a change by the full scale takes the whole record, and a tenth of a sample.
fn range(data: &Data) -> (f64, f64) {
    (stroke(data) / data.duration_s().max(1e-6), 10.0 * stroke(data) / data.sample_s)
}

impl Effect for AmplifierSlew {
    fn cause(&self) -> &'static str {
        "amplifier-slew"
    }

    fn location(&self) -> Location {
        Location::Amplifier
    }

    fn description(&self) -> &'static str {
        "the amplifier's voltage changes at a bounded rate"
    }

    fn isolating_experiment(&self) -> &'static str {
        "single steps of very different heights: a slew lag grows with the step"
    }

    fn forms(&self) -> usize {
        4
    }

    fn common_forms(&self) -> usize {
        2
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let (slowest, fastest) = range(data);
        let mut coordinates = vec![Coordinate::log(slowest, fastest); COORDINATES[form]];
        if form == WITH_TIME_CONSTANT {
            let shortest_s = SHORTEST * data.sample_s;
            coordinates[1] = Coordinate::log(shortest_s, (LONGEST * data.duration_s()).max(2.0 * shortest_s));
        }
        coordinates.extend(data.initial_state_unknown.then_some(Coordinate::new(-stroke(data), stroke(data))));
        coordinates
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let (slowest, fastest) = range(data);
        let rates = (2.0 * slowest, 0.8 * fastest);
        let starts: Vec<Vec<f64>> = match form {
            BOTH_WAYS | POWER => logarithms(rates, 20).map(|rate| vec![rate]).collect(),
            WITH_TIME_CONSTANT => logarithms(rates, 10)
                .flat_map(|rate| INITIAL_ROWS.map(|rows| vec![rate, (rows * data.sample_s).ln()]))
                .collect(),
            _ => logarithms(rates, 10)
                .flat_map(|rate| [INITIAL_RATIO.ln(), -INITIAL_RATIO.ln()].map(|apart| vec![rate, rate + apart]))
                .collect(),
        };
        // At an amplifier voltage equal to the command the derivative would vanish.
        let from_v = data.initial_state_unknown.then_some(data.command.before - INITIAL_DISTANCE * stroke(data));
        starts.into_iter().map(|start| start.into_iter().chain(from_v).collect()).collect()
    }

    /// An amplifier that reaches its rate in no step but the largest is a lag.
    fn is_another_cause(&self, form: usize, point: &[f64], data: &Data, _: f64) -> bool {
        form == WITH_TIME_CONSTANT && (point[0] + point[1]).exp() > LARGEST_LAG * stroke(data)
    }

    /// Returns the lag of an operational amplifier that never reaches its rate.
    fn nearest_special_case(&self, form: usize, point: &[f64], _: &Data) -> Option<(&'static str, usize, Vec<f64>)> {
        (form == WITH_TIME_CONSTANT).then(|| ("series-lag", series_lag::IN_FRONT, vec![point[1]]))
    }

    /// The rate of a charger is that at the largest voltage.
    fn quantities(&self, form: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        let value = point[0].exp();
        match form {
            TWO_RATES => vec![
                Quantity::new("slew_v_per_s", Dimension::VoltageRate, value),
                Quantity::new("falling_v_per_s", Dimension::VoltageRate, point[1].exp()),
            ],
            WITH_TIME_CONSTANT => vec![
                Quantity::new("slew_v_per_s", Dimension::VoltageRate, value),
                Quantity::new("tau_s", Dimension::Time, point[1].exp()),
            ],
            _ => vec![Quantity::new("slew_v_per_s", Dimension::VoltageRate, value)],
        }
    }

    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, _: &Chain) -> Option<toml::Value> {
        (form != BOTH_WAYS).then(|| table(self, form, point, data))
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        let value = point[0].exp();
        chain.initial_v = point.get(COORDINATES[form]).copied();
        if form == POWER {
            chain.power_v2_per_s = chain.power_v2_per_s.min(2.0 * stroke(data) * value);
            return;
        }
        if form == WITH_TIME_CONSTANT {
            chain.follow_tau_s = point[1].exp();
        }
        let falling = if form == TWO_RATES { point[1].exp() } else { value };
        chain.rising_v_per_s = chain.rising_v_per_s.min(value);
        chain.falling_v_per_s = chain.falling_v_per_s.min(falling);
    }
}
