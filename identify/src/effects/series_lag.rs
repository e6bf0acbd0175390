//! A first-order lag in series with the spring: a slow sensor, a second stage, or the resistance of the amplifier's output.
//!
//! | form | law |
//! | --- | --- |
//! | one | `tau dy'/dt = y - y'` behind the relaxation |
//! | two | two of them in series, an overdamped second order |
//! | in front | `tau du/dt = command - u` before hysteresis and static law, which cannot be distinguished without these |
//! | damped | `tau^2 d2y'/dt2 + 2 zeta tau dy'/dt + y' = y` with a `zeta` of 0.5 to 1; with less it is a `resonance` |
//! | mean | the mean of `y` over the last `window`: a sensor that integrates |
//!
//! A shift in time is a `delay`, an exponential approach a `series-lag`. With two time constants in series the one that
//! replaces the nominal spring's is its `time-constant`, the other one the lag.

use crate::dimension::Dimension;
use crate::effects::effect::{Affects, Coordinate, Effect, FitContext, Location, Quantity, logarithms, table};
use crate::plant::chain::Chain;
use crate::plant::initial_state::InitialState;
use crate::record::changes::changes;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::record::signal::{Oscillator, Signal};
use crate::stats::thresholds::empirical::FASTEST_SERIES_LAG;

pub(super) struct SeriesLag;

const ONE: usize = 0;
const TWO: usize = 1;
pub(super) const IN_FRONT: usize = 2;
const DAMPED: usize = 3;
const MEAN: usize = 4;
/// Ratio of two heights of steps that are different.
const DIFFERENT: f64 = 1.5;
/// Largest time constant at initial points, in reference time constants.
const LONGEST_INITIAL: f64 = 3.0;
/// Product of the two time constants of an overdamped second order, as a fraction of the square of their sum: the smallest,
/// at initial points, and the largest, at which they are equal. Sum and product change the response smoothly also there.
const PRODUCTS: [f64; 3] = [0.01, 0.2, 0.25];
/// Product of the time constants of a damped second order as a fraction of the square of their sum, `1 / (4 zeta^2)`: the smallest, near
/// that of two equal time constants, at initial points, and the largest, of a damping ratio of 0.5.
const PRODUCTS_IF_DAMPED: [f64; 3] = [0.2501, 0.45, 1.0];

/// Largest lag, or sum of two, relative to the time constant of a first-order fit if the nominal spring is far from the record: a
/// longer one would take the place of the time constant.
const LONGEST_OF_FAR: f64 = 0.7;

/// Returns the bounds of the time constant, or of the sum of two, in s.
fn range(data: &Data) -> (f64, f64) {
    let shortest = FASTEST_SERIES_LAG.get() * data.sample_s;
    let longest = data.normalisation.start.map_or(data.duration_s(), |start| LONGEST_OF_FAR * start.tau_s);
    (shortest, longest.max(2.0 * shortest))
}

/// Returns the time constants at a point, in s, the longer one first.
fn time_constants_s(point: &[f64]) -> impl Iterator<Item = f64> {
    let sum_s = point[0].exp();
    let root = point.get(1).map_or(1.0, |product| (1.0 - 4.0 * product).max(0.0).sqrt());
    std::iter::once(0.5 * (1.0 + root)).chain(point.get(1).map(|_| 0.5 * (1.0 - root))).map(move |part| part * sum_s)
}

/// Returns the products of a form of second order; `None` for another.
fn products(form: usize) -> Option<[f64; 3]> {
    match form {
        TWO => Some(PRODUCTS),
        DAMPED => Some(PRODUCTS_IF_DAMPED),
        _ => None,
    }
}

/// Returns true if steps of the voltage have different heights. Otherwise the mean of the response cannot be distinguished from the ramps
/// of an amplifier's slew rate.
fn steps_differ(data: &Data) -> bool {
    let steps = changes(&data.voltage_v, data.full_scale_v).map(|(_, change)| change);
    let (low, high) = steps.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), step| (low.min(step), high.max(step)));
    high > DIFFERENT * low
}

/// Returns angular frequency, in 1/s, and damping ratio of a damped second order at a point.
fn oscillation(point: &[f64]) -> (f64, f64) {
    let root = point[1].sqrt();
    (1.0 / (root * point[0].exp()), 0.5 / root)
}

impl Effect for SeriesLag {
    fn cause(&self) -> &'static str {
        "series-lag"
    }

    fn location(&self) -> Location {
        Location::Relaxation
    }

    fn affects(&self, form: usize) -> Affects {
        match form {
            IN_FRONT => Affects::Amplifier,
            DAMPED | MEAN => Affects::Response,
            _ => Affects::Relaxation,
        }
    }

    fn description(&self) -> &'static str {
        "a further lag acts on the whole response (sensor or second stage)"
    }

    fn isolating_experiment(&self) -> &'static str {
        "a step that is read several times within the lag: the instantaneous part arrives exponentially, not late and not as a ramp"
    }

    fn forms(&self) -> usize {
        5
    }

    fn common_forms(&self) -> usize {
        3
    }

    fn coordinates(&self, form: usize, data: &Data) -> Vec<Coordinate> {
        let (shortest, longest) = range(data);
        let mut coordinates = vec![Coordinate::log(shortest, longest)];
        coordinates.extend(products(form).map(|products| Coordinate::new(products[0], products[2])));
        coordinates
    }

    fn initial_points(&self, form: usize, FitContext { data, .. }: &FitContext) -> Vec<Vec<f64>> {
        if form == MEAN && !steps_differ(data) {
            return Vec::new();
        }
        let (shortest, longest) = range(data);
        let longest = longest.min(LONGEST_INITIAL * REFERENCE_TIME_CONSTANT_S).max(3.0 * shortest);
        let count = if form == ONE { 10 } else { 4 };
        let product = products(form).map(|products| products[1]);
        logarithms((2.0 * shortest, longest), count).map(|tau| std::iter::once(tau).chain(product).collect()).collect()
    }

    fn quantities(&self, form: usize, point: &[f64], _: &Data) -> Vec<Quantity> {
        let time = |name: &str, time_s| Quantity::new(name, Dimension::Time, time_s);
        match form {
            DAMPED => {
                let (omega, zeta) = oscillation(point);
                return vec![time("tau_s", omega.recip()), Quantity::new("zeta", Dimension::Ratio, zeta)];
            }
            // As late as a lag of half the window.
            MEAN => return vec![time("tau_s", 0.5 * point[0].exp()), time("window_s", point[0].exp())],
            _ => {}
        }
        let names = ["tau_s", "second_tau_s"];
        names.into_iter().zip(time_constants_s(point)).map(|(name, tau_s)| time(name, tau_s)).collect()
    }

    /// A plant file holds lags behind the relaxation as further time constants of the same, unless that varies with the voltage
    /// or has no place left.
    fn unmodelled(&self, form: usize, point: &[f64], data: &Data, chain: &Chain) -> Option<toml::Value> {
        let in_file = matches!(form, ONE | TWO) && chain.series_lags_fit_plant_file();
        (!in_file).then(|| table(self, form, point, data))
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], _: &'a Data, chain: &mut Chain<'a>) {
        match form {
            IN_FRONT => chain.output_tau_s = point[0].exp(),
            DAMPED | MEAN => {}
            _ => chain.series_s.extend(time_constants_s(point)),
        }
    }

    fn modify_response(&self, form: usize, point: &[f64], signal: &mut Signal, start: &mut InitialState) {
        match form {
            DAMPED => {
                let (omega, zeta) = oscillation(point);
                let (x, rate) = (signal.before + start.next_offset_v(), omega * start.next_offset_v());
                let mut sensor = Oscillator::at(omega, zeta, x, rate);
                if !sensor.is_zero() || !signal.is_zero() {
                    signal.pass(|piece| sensor.pass(piece));
                }
            }
            MEAN => signal.average(point[0].exp()),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::fit::engine::Engine;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    const ROWS: usize = 900;
    /// Time between rows, and time constant of the spring, in s.
    const SAMPLE_S: f64 = 0.1;
    const TAU_S: f64 = 5.5;

    fn data() -> Data {
        let volts = |row: usize| [0.0, 300.0, 100.0, 500.0, 200.0][row / 90 % 5];
        let row = |row| Row { line: 0, time_s: SAMPLE_S * row as f64, voltage_v: volts(row), measured: Some(0.0) };
        Data::new(&Record { name: String::new(), rows: (0..ROWS).map(row).collect() }, Input::Hold)
    }

    fn model(form: usize, point: &[f64]) -> Model {
        Model::default().with(Block { effect: index_of("series-lag").unwrap(), form }, point.to_vec())
    }

    /// Integrates the spring and lags behind it in small steps.
    fn integrated(data: &Data, taus_s: [f64; 2]) -> Vec<f64> {
        const STEPS: usize = 400;
        let (mut spring, mut first, mut second) = (0.0, 0.0, 0.0);
        let follow = |voltage: &f64| {
            let reading = second;
            for _ in 0..STEPS {
                let step_s = SAMPLE_S / STEPS as f64;
                let stiffness = voltage / 11.0 + 10.0 / 11.0 * spring;
                spring += (voltage - spring) * step_s / TAU_S;
                second += (first - second) * step_s / taus_s[1];
                first += (stiffness - first) * step_s / taus_s[0];
            }
            reading
        };
        data.voltage_v.iter().map(follow).collect()
    }

    /// The prediction is that of an integrator also where time constants are equal, which have no partial fractions.
    #[test]
    fn prediction_is_that_of_an_integrator() {
        let (data, base) = (data(), Base::paper());
        for taus_s in [[0.5, 0.2], [0.5, 0.5], [TAU_S, 1.0], [TAU_S, TAU_S], [20.0, 0.3]] {
            let mut readings = Vec::new();
            let sum_s = taus_s[0] + taus_s[1];
            let point = [sum_s.ln(), taus_s[0] * taus_s[1] / sum_s.powi(2)];
            Simulator::new(&data, &base).run(&model(TWO, &point), &mut readings);
            let apart = readings.iter().zip(integrated(&data, taus_s)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 0.15, "{taus_s:?}: {apart} V");
        }
    }

    #[test]
    fn fits_find_one_lag_and_two_equal_ones_from_a_close_start() {
        let (mut data, base) = (data(), Base::paper());
        for (form, point) in [(ONE, vec![0.4f64.ln()]), (TWO, vec![0.4f64.ln(), 0.25]), (IN_FRONT, vec![0.4f64.ln()])] {
            let mut readings = Vec::new();
            Simulator::new(&data, &base).run(&model(form, &point), &mut readings);
            data.reading = readings.iter().zip(normals(ROWS)).map(|(reading, noise)| reading + noise).collect();
            let observed = Observed::new(&data);
            let mut engine = Engine::new(&data, &observed, &base);
            let truth = engine.evaluate(model(form, &point)).log_likelihood;
            let scene = FitContext { data: &data, residual: &[], sigma: 1.0 };
            let starts = SeriesLag.initial_points(form, &scene);
            let close = |start: &Vec<f64>| (start[0] - point[0]).abs() < 1.0;
            for start in starts.iter().filter(|start| close(start)) {
                let fit = engine.fit_twice(model(form, start));
                assert!(fit.log_likelihood > truth - 0.1, "form {form} from {start:?}: {:?}", fit.model.points());
            }
            assert!(starts.iter().any(close), "{starts:?}");
        }
    }

    /// The plant file of a spring with a lag is simulated by the tick as the fit predicts.
    #[test]
    fn plant_file_holds_a_lag_behind_the_relaxation_only() {
        let (data, base) = (data(), Base::paper());
        let point = [0.4f64.ln()];
        let file = model(ONE, &point).extend(&base, &data);
        assert!(file.unmodelled.is_none() && file.check().is_ok(), "{file:?}");
        assert_eq!(file.relaxation.tau_s.len(), 2);
        let mut readings = [Vec::new(), Vec::new()];
        Simulator::new(&data, &base).run(&model(ONE, &point), &mut readings[0]);
        Simulator::new(&data, &Base::new(file).unwrap()).run(&Model::default(), &mut readings[1]);
        let [lagged, written] = readings;
        assert!(lagged.iter().zip(&written).all(|(a, b)| (a - b).abs() < 1e-6));
        let in_front = model(IN_FRONT, &point).extend(&base, &data).unmodelled.expect("a remark");
        assert!(in_front["series-lag"]["tau_s"].as_float().is_some_and(|tau| (tau - 0.4).abs() < 1e-12));
    }
}
