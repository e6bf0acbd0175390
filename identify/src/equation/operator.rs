//! The operators of the grammar: each maps one signal to another, with a point of coordinates that a fit moves.

use crate::dimension::Dimension;
use crate::equation::clock::{modulate, swing};
use crate::equation::curve::Curve;
use crate::equation::kind::Kind;
use crate::equation::lag::{self, By};
use crate::equation::memory;
use crate::equation::scale::Scale;
use crate::record::signal::Signal;

/// A bounded coordinate of an operator's point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// Name of the parameter without its number.
    pub name: &'static str,
    /// Smallest value of the coordinate.
    pub lowest: f64,
    /// Largest value.
    pub highest: f64,
    /// True if the coordinate is the logarithm of the parameter.
    pub log: bool,
    /// True if a fit moves it.
    pub fitted: bool,
    /// Dimension of the parameter.
    pub dimension: Dimension,
}

impl Coordinate {
    fn log(name: &'static str, lowest: f64, highest: f64, dimension: Dimension) -> Self {
        let highest = highest.max(lowest * (1.0 + 1e-9));
        Self { name, lowest: lowest.ln(), highest: highest.ln(), log: true, fitted: true, dimension }
    }

    fn plain(name: &'static str, lowest: f64, highest: f64) -> Self {
        Self { name, lowest, highest, log: false, fitted: true, dimension: Dimension::Ratio }
    }

    /// Returns the parameter at a value of the coordinate.
    pub fn parameter(&self, coordinate: f64) -> f64 {
        if self.log { coordinate.exp() } else { coordinate }
    }

    /// Returns the coordinate of a parameter, within its bounds.
    pub fn of(&self, parameter: f64) -> f64 {
        let coordinate = if self.log { parameter.max(f64::MIN_POSITIVE).ln() } else { parameter };
        coordinate.clamp(self.lowest, self.highest)
    }
}

/// An operator with its point, and the chains inside of a sum or product.
#[derive(Clone, Debug, PartialEq)]
pub struct Operator {
    /// What it does.
    pub kind: Kind,
    /// Values of its coordinates.
    pub point: Vec<f64>,
    /// Chains of operators inside; empty for most kinds.
    pub chains: Vec<Vec<Operator>>,
}

/// Shortest time constant, in spacings of the rows, and longest, in lengths of the record.
const TAUS: (f64, f64) = (0.05, 3.0);
/// Lowest frequency, in periods in the record.
const FEWEST_PERIODS: f64 = 0.3;
/// Range of damping ratios.
const DAMPINGS: (f64, f64) = (1e-3, 20.0);
/// Range of thresholds relative to the full scale.
const THRESHOLDS: (f64, f64) = (1e-4, 2.0);
/// Largest delay, in lengths of the record.
const LONGEST_DELAY: f64 = 0.1;
/// Largest part, weight or relative change.
const LARGEST: f64 = 20.0;
/// Delays are shortened by this fraction of a row, so that a step that falls on the time of a row comes before it.
const DELAY_ROUNDING: f64 = 1e-5;

impl Operator {
    /// Returns an operator at parameters, each moved into its bounds.
    pub fn new(kind: Kind, parameters: &[f64], scale: &Scale) -> Self {
        let mut operator = Self { kind, point: vec![0.0; parameters.len()], chains: Vec::new() };
        let coordinates = operator.coordinates(scale);
        for ((value, parameter), coordinate) in operator.point.iter_mut().zip(parameters).zip(&coordinates) {
            *value = coordinate.of(*parameter);
        }
        operator
    }

    /// Returns the weighted sum of chains.
    pub fn parallel(chains: Vec<(f64, Vec<Self>)>) -> Self {
        let (point, chains) = chains.into_iter().unzip();
        Self { kind: Kind::Parallel, point, chains }
    }

    /// Returns the product with one plus a weighted chain.
    pub fn times(weight: f64, chain: Vec<Self>) -> Self {
        Self { kind: Kind::Times, point: vec![weight], chains: vec![chain] }
    }

    /// Returns the parameters of the operator itself.
    pub fn parameters(&self, scale: &Scale) -> Vec<f64> {
        self.coordinates(scale).iter().zip(&self.point).map(|(of, value)| of.parameter(*value)).collect()
    }

    /// Returns the coordinates of the operator itself, one for each number of its point.
    pub fn coordinates(&self, scale: &Scale) -> Vec<Coordinate> {
        let Scale { full_v, sample_s, duration_s } = *scale;
        let tau = |name| Coordinate::log(name, TAUS.0 * sample_s, TAUS.1 * duration_s, Dimension::Time);
        let freq = || Coordinate::log("freq_hz", FEWEST_PERIODS / duration_s, 0.5 / sample_s, Dimension::Frequency);
        let volts = |name| Coordinate::log(name, THRESHOLDS.0 * full_v, THRESHOLDS.1 * full_v, Dimension::Voltage);
        let plain = |name, most: f64| Coordinate::plain(name, -most, most);
        match self.kind {
            Kind::Lag => vec![tau("tau_s")],
            Kind::Varying(By::Input) => vec![tau("tau_s"), Coordinate::plain("change", -0.95, LARGEST)],
            Kind::Varying(By::Distance) => vec![tau("tau_s"), plain("steepness", LARGEST)],
            Kind::Varying(_) => vec![tau("tau_s"), plain("exponent", 5.0)],
            Kind::Second => {
                vec![freq(), Coordinate::log("zeta", DAMPINGS.0, DAMPINGS.1, Dimension::Ratio)]
            }
            Kind::Creep => vec![plain("power", 3.0)],
            Kind::Play => vec![volts("radius_v"), plain("part", LARGEST)],
            Kind::Travel => vec![volts("distance_v"), plain("part", LARGEST)],
            Kind::Direction => vec![plain("change", 0.9)],
            Kind::Curve(Curve::Power) => vec![Coordinate::log("exponent", 0.1, 10.0, Dimension::Ratio)],
            Kind::Curve(Curve::Tanh) => vec![Coordinate::log("steepness", 0.01, 10.0, Dimension::Ratio)],
            Kind::Curve(Curve::Limit | Curve::Floor | Curve::DeadBand) => vec![volts("threshold_v")],
            Kind::Curve(_) => vec![plain("curvature", LARGEST)],
            Kind::Delay => {
                let longest = (LONGEST_DELAY * duration_s).max(sample_s);
                vec![Coordinate::log("delay_s", 0.01 * sample_s, longest, Dimension::Time)]
            }
            Kind::Slew => {
                let (slowest, fastest) = (0.1 * full_v / duration_s, 10.0 * full_v / sample_s);
                vec![Coordinate::log("slew_v_per_s", slowest, fastest, Dimension::VoltageRate)]
            }
            Kind::Swing => vec![freq(), plain("cosine", 0.9), plain("sine", 0.9)],
            Kind::Grow => vec![plain("growth", 0.95)],
            Kind::Step => {
                let at = Coordinate {
                    fitted: false,
                    dimension: Dimension::TimePoint,
                    ..Coordinate::plain("from_s", 0.0, duration_s)
                };
                vec![at, plain("change", 0.95)]
            }
            Kind::Times | Kind::Parallel => vec![plain("weight", LARGEST); self.point.len()],
        }
    }

    /// Replaces a signal by what the operator makes of it; returns the work, in pieces of the signal through one lag.
    pub fn apply(&self, signal: &mut Signal, scale: &Scale) -> u64 {
        let own = self.work() * signal.len() as u64;
        let p = self.parameters(scale);
        match self.kind {
            Kind::Lag => lag::lag(signal, p[0]),
            Kind::Varying(by) => lag::varying(signal, p[0], by, p[1], scale),
            Kind::Second => lag::second(signal, p[0], p[1]),
            Kind::Creep => lag::creep(signal, p[0], scale),
            Kind::Play => memory::play(signal, p[0], p[1]),
            Kind::Travel => memory::travel(signal, p[0], p[1]),
            Kind::Direction => memory::direction(signal, p[0]),
            Kind::Curve(curve) => signal.map(|x| curve.at(x, p[0], scale.full_v)),
            Kind::Delay => *signal = signal.delayed(p[0] - DELAY_ROUNDING * scale.sample_s.min(p[0])),
            Kind::Slew => *signal = signal.slewed(p[0], p[0]),
            Kind::Swing => modulate(signal, |time_s| swing(time_s, p[0], p[1], p[2])),
            Kind::Grow => modulate(signal, |time_s| 1.0 + p[0] * time_s / scale.duration_s),
            Kind::Step => modulate(signal, |time_s| if time_s >= p[0] { 1.0 + p[1] } else { 1.0 }),
            Kind::Times => {
                let mut other = signal.clone();
                let inside = run(&self.chains[0], &mut other, scale);
                let before = other.before;
                signal.before *= 1.0 + p[0] * before / scale.full_v;
                let mut pieces = other.pieces().iter();
                signal.pass(|piece| {
                    let factor = pieces.next().map_or((0.0, 0.0), |other| (other.from, other.to));
                    let gain = |of: f64| 1.0 + p[0] * of / scale.full_v;
                    (piece.from * gain(factor.0), piece.to * gain(factor.1))
                });
                return own + inside;
            }
            Kind::Parallel => {
                let mut inside = 0;
                let mut sum: Vec<(f64, f64)> = vec![(0.0, 0.0); signal.len()];
                let mut before = 0.0;
                for (weight, chain) in self.point.iter().zip(&self.chains) {
                    let mut branch = signal.clone();
                    inside += run(chain, &mut branch, scale);
                    before += weight * branch.before;
                    for (sum, piece) in sum.iter_mut().zip(branch.pieces()) {
                        *sum = (sum.0 + weight * piece.from, sum.1 + weight * piece.to);
                    }
                }
                let mut sum = sum.into_iter();
                signal.before = before;
                signal.pass(|_| sum.next().unwrap_or_default());
                return own + inside;
            }
        }
        own
    }

    /// Returns the work for one piece of the signal, relative to a lag.
    fn work(&self) -> u64 {
        match self.kind {
            Kind::Lag | Kind::Parallel | Kind::Times | Kind::Direction => 1,
            Kind::Curve(Curve::Limit | Curve::Floor | Curve::DeadBand | Curve::Square | Curve::Cube | Curve::Even) => 1,
            Kind::Play | Kind::Second | Kind::Slew | Kind::Delay => 3,
            Kind::Curve(_) | Kind::Travel | Kind::Varying(_) => 5,
            Kind::Creep => 7,
            Kind::Swing | Kind::Grow | Kind::Step => 6,
        }
    }

    /// Returns true if the operator divides a signal anew, so that it cannot be added to another one inside of a sum.
    pub fn divides(&self) -> bool {
        matches!(self.kind, Kind::Delay | Kind::Slew)
    }
}

/// Passes a signal through a chain of operators; returns the work.
pub fn run(chain: &[Operator], signal: &mut Signal, scale: &Scale) -> u64 {
    chain.iter().map(|operator| operator.apply(signal, scale)).sum()
}
