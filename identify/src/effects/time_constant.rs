//! The time constant of the relaxation is not the nominal one.
//!
//! | form | time constant |
//! | --- | --- |
//! | constant | one |
//! | drifting | from the first row to the last geometrically from one to another |
//! | step | one before a time, another after it |

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity, table};
use crate::plant::chain::Chain;
use crate::record::data::Data;
use crate::stats::thresholds::probability::NATS_WITHIN_INTERVAL;

pub(super) struct TimeConstant;

const CONSTANT: usize = 0;
const STEP: usize = 2;
/// Time constants at initial points, in normalised s: 0.18 to 5.5 reference time constants.
const INITIAL_TIME_CONSTANTS_S: [f64; 8] = [1.0, 2.5, 4.0, 5.0, 6.0, 8.0, 14.0, 30.0];
/// Pairs of them, of one that changes: neighbours of a geometric row, and two around the nominal one.
const INITIAL_CHANGES_S: [[f64; 2]; 10] = [
    [2.2, 3.5],
    [3.5, 2.2],
    [3.5, 5.5],
    [5.5, 3.5],
    [4.4, 6.9],
    [6.9, 4.4],
    [5.5, 8.5],
    [8.5, 5.5],
    [8.5, 13.5],
    [13.5, 8.5],
];
/// Number of times of a step at initial points, which divide the record equally.
const INITIAL_TIMES: u32 = 29;

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

    fn forms(&self) -> usize {
        3
    }

    fn common_forms(&self) -> usize {
        1
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let tau = Coordinate::log(0.2 * data.sample_s, 10.0 * data.duration_s());
        let mut coordinates = vec![tau; if form == CONSTANT { 1 } else { 2 }];
        coordinates.extend((form == STEP).then(|| Coordinate::new(0.0, data.duration_s())));
        coordinates
    }

    /// A change with time is looked for in a single record.
    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        let changes = || INITIAL_CHANGES_S.into_iter().filter(|_| !data.is_joined()).map(|pair| pair.map(f64::ln));
        match form {
            CONSTANT => INITIAL_TIME_CONSTANTS_S.map(|tau: f64| vec![tau.ln()]).to_vec(),
            STEP => {
                let at_s = |part: u32| f64::from(part) / f64::from(INITIAL_TIMES + 1) * data.duration_s();
                changes().flat_map(|[from, to]| (1..=INITIAL_TIMES).map(move |it| vec![from, to, at_s(it)])).collect()
            }
            _ => changes().map(|pair| pair.to_vec()).collect(),
        }
    }

    /// On either side of a change of the voltage a step may have a likelihood maximum of its own.
    fn across_jumps(&self, form: usize, point: &[f64], steps: f64, data: &Data) -> Option<Vec<f64>> {
        let at_s = point.get(2)? + steps * data.duration_s() / f64::from(INITIAL_TIMES + 1);
        (form == STEP && (0.0..data.duration_s()).contains(&at_s)).then(|| vec![point[0], point[1], at_s])
    }

    fn ln_candidates(&self, form: usize, _: &Data) -> f64 {
        if form == STEP { f64::from(INITIAL_TIMES).ln() } else { 0.0 }
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        let tau = |name: &str, point: f64| Quantity::new(name, Dimension::Time, point.exp());
        if form == CONSTANT {
            return vec![tau("tau_s", point[0])];
        }
        let mut quantities = vec![tau("tau_first_s", point[0]), tau("tau_last_s", point[1])];
        let at_s = |since_s: &f64| Quantity::new("at_s", Dimension::TimePoint, data.time_s[0] + since_s);
        quantities.extend(point.get(2).map(at_s));
        quantities
    }

    /// A step may lie on either side of a change of the voltage: earlier and later times are included as long as that costs less than
    /// [`NATS_WITHIN_INTERVAL`] (95 %).
    fn searched_range(
        &self,
        form: usize,
        point: &[f64],
        FitContext { data, sigma, .. }: &FitContext,
    ) -> Vec<(String, f64, f64)> {
        if form != STEP {
            return Vec::new();
        }
        let [first_s, last_s] = [point[0].exp(), point[1].exp()];
        let at_s = data.time_s[0] + point[2];
        // How far the lag is from the voltage, for each row until the next one.
        let mut lag = data.voltage_v[0];
        let mut ahead = Vec::with_capacity(data.rows());
        for (row, voltage_v) in data.voltage_v.iter().enumerate() {
            let step_s = data.time_s.get(row + 1).map_or(0.0, |next| next - data.time_s[row]);
            ahead.push((voltage_v - lag, step_s));
            let tau_s = if data.time_s[row] < at_s { first_s } else { last_s };
            lag = voltage_v + (lag - voltage_v) * (-step_s / tau_s).exp();
        }
        let rate = (1.0 - data.normalisation.share) * (1.0 / first_s - 1.0 / last_s);
        // What the other time constant in the rows between changes of the response, in V, then and after them.
        let farthest = |rows: &mut dyn Iterator<Item = usize>, tau_s: f64| {
            let (mut displaced, mut squares) = (0.0, 0.0);
            let costs = rows.map(|row| {
                let (ahead_v, step_s) = ahead[row];
                displaced = displaced * (-step_s / tau_s).exp() + rate * ahead_v * step_s;
                squares += displaced * displaced;
                let left = displaced * displaced * last_s / (2.0 * step_s.max(data.sample_s));
                (row, squares, squares + left)
            });
            let within = 2.0 * sigma * sigma * NATS_WITHIN_INTERVAL;
            let near = costs.take_while(|(_, passed, _)| *passed < within);
            near.filter(|(_, _, cost)| *cost < within).last().map(|(row, ..)| row)
        };
        let row = data.time_s.partition_point(|time_s| *time_s <= at_s).min(data.rows()) - 1;
        let earliest = farthest(&mut (0..row).rev(), first_s).unwrap_or(row);
        let latest = farthest(&mut (row..data.rows()), last_s).map_or(row, |row| row + 1);
        let later_s = data.time_s[(latest + 1).min(data.rows() - 1)];
        vec![("at_s".into(), data.time_s[earliest.saturating_sub(1)], later_s)]
    }

    /// A plant file holds the last one.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, _: &Chain) -> Option<toml::Value> {
        (form != CONSTANT).then(|| table(self, form, point, data))
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        let relaxation = &mut chain.relaxation;
        if form == CONSTANT {
            let factor = point[0].exp() / relaxation.tau_s;
            relaxation.tau_s *= factor;
            relaxation.tau_high_s *= factor;
            return;
        }
        (relaxation.tau_s, relaxation.tau_high_s) = (point[0].exp(), point[1].exp());
        relaxation.geometric = true;
        let at_s = point.get(2).copied();
        relaxation.over_s = Some(at_s.map_or([0.0, data.duration_s()], |at_s| [at_s; 2]));
    }
}
