//! The sensitivity depends on the voltage, without hysteresis: `f = f(u)`, with `x = |u| / full scale`, and `X` the reference
//! voltage over the full scale.
//!
//! | curve | `f / u` |
//! | --- | --- |
//! | exponential | `s(x) / s(X)` with `s(x) = (1 - exp(-k x)) / x` |
//! | quadratic, cubic, quintic | `1 + a (x - X)`, `+ b (x^2 - X^2)`, `+ c (x^3 - X^3) + d (x^4 - X^4)` |
//! | power | `(x / X)^(p - 1)`: a square root, a square (electrostriction) |
//! | kink | `s(x) / s(X)` with `s(x) = (a min(x, k) + max(x - k, 0)) / x`: a dead band, a contact |
//! | bent | `s(x) / s(X)` with `s(x) = (1 + c x^2)^-p`: near a hyperbolic tangent, an arc tangent, a Langevin function, or for `p < 0` a hyperbolic sine |
//! | uneven | as cubic with the sign of the voltage, `x = u / full scale`: other curves for negative voltages |
//!
//! Every curve is fixed at 0 V and at the reference voltage of the nominal spring, where the static gain is 1: what is linear
//! belongs to `gain-error`, which multiplies the curve, `gain f(u)`. Under a nominal spring that was identified from a record that is
//! never near 0 V, curve and voltage begin at the [origin](Data::origin_v), and the curve is fixed at both ends of the record's range.
//!
//! The curve is in front of the relaxation (Hammerstein model), or in some forms behind it (Wiener model), where `u` is
//! the relaxed value. The settled curve is the same; the instantaneous part and the speed of a step distinguish both. In other forms
//! it is the restoring force over the stiffness (a [Lur'e system](crate::plant::restoring)): the settled curve is its inverse, and
//! the relaxation is slower, or an oscillation lower, where the force rises less.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::plant::chain::Chain;
use crate::plant::law::Law;
use crate::plant::restoring;
use crate::plant::visited::Axis;
use crate::record::data::Data;
use crate::record::scales::REFERENCE_VOLTAGE_V;
use crate::stats::sums::dot;

pub(super) struct StaticNonlinearity;

/// The curve of `f / u` over `x`.
#[derive(Clone, Copy)]
enum Curve {
    Exponential,
    /// A polynomial with this number of free coefficients.
    Polynomial(usize),
    Power,
    Kink,
    Bent,
    /// The polynomial with two free coefficients of the voltage with its sign.
    Uneven,
}
use Curve::{Bent, Exponential, Kink, Polynomial, Power, Uneven};

/// Place of a curve.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// In front of the relaxation, over the voltage.
    Before,
    /// Behind the relaxation, over the relaxed stiffness.
    Behind,
    /// In the feedback of the relaxation: the restoring force over the stiffness.
    Within,
}
use Place::{Before, Behind, Within};

/// Curve of each form, and its place.
const FORMS: [(Curve, Place); 16] = [
    (Polynomial(1), Before),
    (Exponential, Before),
    (Polynomial(2), Before),
    (Polynomial(4), Before),
    (Polynomial(1), Behind),
    (Exponential, Behind),
    (Polynomial(2), Behind),
    (Polynomial(4), Behind),
    (Power, Before),
    (Kink, Before),
    (Uneven, Before),
    (Polynomial(2), Within),
    (Power, Within),
    (Bent, Before),
    (Bent, Behind),
    (Power, Behind),
];

/// Smallest `x` of a power, which may have no finite slope at 0.
const LEAST_OF_POWER: f64 = 1e-9;
/// Smallest `s(X)` of a kink: a dead band that ends beyond the reference voltage has no gain there.
const LEAST_OF_KINK: f64 = 1e-3;
/// Places of a kink, and slopes below it relative to that above, at initial points.
const INITIAL_KINKS: [f64; 5] = [0.05, 0.1, 0.2, 0.4, 0.7];
const INITIAL_SLOPES: [f64; 2] = [0.5, 1.5];

/// Part of the range over which the slope at its end is taken.
const END_STEP: f64 = 1e-3;
/// Number of points of the curve that are reported.
const POINTS: u32 = 5;
/// Number of intervals of the full scale in which levels of the voltage are counted.
const LEVELS: usize = 20;
/// Smallest fraction of the rows at a level.
const ROWS_OF_LEVEL: f64 = 0.01;

impl Curve {
    /// Returns `s` at `x`: `f / u` up to a factor, or for a polynomial up to a constant.
    fn secant(self, point: &[f64], x: f64) -> f64 {
        match self {
            Exponential => {
                let k = if point[0].abs() < 1e-6 { 1e-6 } else { point[0] };
                if x < 1e-9 { k } else { -(-k * x).exp_m1() / x }
            }
            Power => x.max(LEAST_OF_POWER).powf(point[0] - 1.0),
            Kink => {
                let [place, slope] = [point[0], point[1]];
                if x < place { slope } else { 1.0 + (slope - 1.0) * place / x }
            }
            Bent => (1.0 + point[0].exp() * x * x).powf(-point[1]),
            Polynomial(_) | Uneven => x * point.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient),
        }
    }

    /// Returns `f / u` from `s` and its value where `f / u` is 1.
    fn scaled(self, s: f64, fixed: f64) -> f64 {
        match self {
            Polynomial(_) | Uneven => 1.0 + s - fixed,
            Kink => s / fixed.max(LEAST_OF_KINK),
            Exponential | Power | Bent => s / fixed,
        }
    }

    /// Returns the number of free parameters.
    fn coefficients(self) -> usize {
        match self {
            Exponential | Power => 1,
            Polynomial(coefficients) => coefficients,
            Kink | Bent | Uneven => 2,
        }
    }
}

/// Returns the range of the voltage from the curve's origin, in V.
fn range_v(data: &Data) -> f64 {
    data.full_scale_v - data.origin_v.abs()
}

/// Returns the range of a form's curve from its origin, in V.
fn range_of_curve_v(form: usize, data: &Data) -> f64 {
    match FORMS[form].1 {
        // An oscillation may reach more than it settles at.
        Within => data.largest_v - data.origin_v.abs(),
        Before | Behind => range_v(data),
    }
}

/// Returns a curve over the distance from its origin, both in V.
fn curve<'a>(form: usize, point: &'a [f64], data: &Data) -> impl Fn(f64) -> f64 + use<'a> {
    let (curve, range_v) = (FORMS[form].0, range_of_curve_v(form, data));
    let fixed = if data.origin_v == 0.0 { REFERENCE_VOLTAGE_V } else { range_v } / range_v;
    let fixed = curve.secant(point, fixed);
    move |above: f64| {
        let x = if matches!(curve, Uneven) { above } else { above.abs() } / range_v;
        above * curve.scaled(curve.secant(point, x), fixed)
    }
}

/// Returns the same with its end slope beyond the end of its range, where nothing shows it.
fn continued<'a>(form: usize, point: &'a [f64], data: &Data) -> impl Fn(f64) -> f64 + use<'a> {
    let (curve, range_v) = (curve(form, point, data), range_of_curve_v(form, data));
    move |above: f64| {
        let end = above.clamp(-range_v, range_v);
        if above == end {
            return curve(above);
        }
        let before = end * (1.0 - END_STEP);
        let slope = (curve(end) - curve(before)) / (end - before);
        curve(end) + slope * (above - end)
    }
}

/// Returns the number of levels of the voltage other than the curve's origin at which the record has rows.
fn levels(data: &Data) -> usize {
    let mut rows = [0; LEVELS];
    for voltage in &data.voltage_v {
        let part = (voltage - data.origin_v).abs() / range_v(data).max(f64::MIN_POSITIVE);
        let level = (part * LEVELS as f64).round() as usize;
        if level > 0 {
            rows[level.min(LEVELS) - 1] += 1;
        }
    }
    rows.iter().filter(|rows| **rows as f64 >= ROWS_OF_LEVEL * data.rows() as f64).count()
}

impl Effect for StaticNonlinearity {
    fn cause(&self) -> &'static str {
        "static-nonlinearity"
    }

    fn location(&self) -> Location {
        Location::Static
    }

    fn description(&self) -> &'static str {
        "the sensitivity depends on the voltage"
    }

    fn isolating_experiment(&self) -> &'static str {
        "a slow stair over the whole range up and down again: without memory both branches are one curve"
    }

    fn forms(&self) -> usize {
        FORMS.len()
    }

    fn common_forms(&self) -> usize {
        8
    }

    fn coordinates(&self, form: usize, _: &Data) -> Vec<Coordinate> {
        match FORMS[form] {
            (Exponential, _) => vec![Coordinate::new(-8.0, 8.0)],
            (Polynomial(1), _) => vec![Coordinate::new(-2.0, 2.0)],
            (Polynomial(coefficients), Within) => vec![Coordinate::new(-10.0, 10.0); coefficients],
            (Polynomial(coefficients), _) => vec![Coordinate::new(-100.0, 100.0); coefficients],
            (Uneven, _) => vec![Coordinate::new(-2.0, 2.0); 2],
            (Power, _) => vec![Coordinate::new(0.2, 5.0)],
            (Bent, _) => vec![Coordinate::log(0.01, 100.0), Coordinate::new(-5.0, 5.0)],
            (Kink, _) => vec![Coordinate::new(0.01, 0.95), Coordinate::new(0.0, 10.0)],
        }
    }

    /// The straight line through 0 that is nearest to a curve at the voltages of all rows: a curve that passes through the nominal gain where
    /// the record has not been may be straight where it has. There is none for a restoring force, under which a lag is quicker as well.
    fn nearest_special_case(&self, form: usize, point: &[f64], data: &Data) -> Option<(&'static str, usize, Vec<f64>)> {
        if FORMS[form].1 == Within {
            return None;
        }
        let (curve, voltages) = (continued(form, point, data), &data.voltage_v);
        let settled: Vec<f64> = voltages.iter().map(|voltage| data.origin_v + curve(voltage - data.origin_v)).collect();
        let gain = dot(&settled, voltages) / dot(voltages, voltages);
        gain.is_finite().then(|| ("gain-error", 0, vec![gain]))
    }

    /// A curve needs one level of the voltage more than it has parameters.
    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        let (curve, place) = FORMS[form];
        let levels = levels(context.data);
        let unknown = place != Before && !context.data.estimates_any_start();
        if levels <= curve.coefficients() || unknown || matches!(curve, Uneven) && !context.data.has_both_signs() {
            return Vec::new();
        }
        match curve {
            Exponential => vec![vec![0.3], vec![-0.3]],
            Power => vec![vec![0.9], vec![1.1]],
            Bent => [0.2, 2.0].iter().flat_map(|&c: &f64| [0.3, -0.3].map(|p| vec![c.ln(), p])).collect(),
            Kink => INITIAL_KINKS.iter().flat_map(|&place| INITIAL_SLOPES.map(|slope| vec![place, slope])).collect(),
            Uneven => vec![vec![0.1, 0.0], vec![-0.1, 0.0]],
            Polynomial(1) => vec![vec![0.1], vec![-0.1]],
            Polynomial(coefficients) => {
                let start = |of: &[f64]| {
                    let mut start = of.to_vec();
                    start.resize(coefficients, 0.0);
                    start
                };
                // An S-shaped curve is zero at both ends and in the middle, so no gradient leads to it from a bend.
                let s = |size: f64| start(&[-3.0 * size, 2.0 * size]);
                let mut starts = vec![start(&[0.05]), start(&[-0.05])];
                if coefficients > 1 && place != Within {
                    starts.extend([s(0.1), s(-0.1)]);
                }
                if place == Within {
                    // A force that stiffens or softens on both sides bends with the square; the steps of a linearisation from a weak
                    // bend do not reach a strong one.
                    starts.extend([start(&[0.0, 0.3]), start(&[0.0, -0.1])]);
                }
                starts
            }
        }
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        // The file's voltages are rounded to two digits of their step, so that names give them exactly.
        let volt_v = data.scales().volt_v;
        let step = data.full_scale_v * volt_v / f64::from(POINTS);
        let decimals = (1.0 - step.log10().floor()).clamp(-300.0, 300.0) as i32;
        let unit = 10f64.powi(-decimals);
        let (origin, place) = (data.origin_v, FORMS[form].1);
        let mut force = Law::of(None);
        force.push(continued(form, point, data));
        let curve = curve(form, point, data);
        let value = |voltage: f64| match place {
            Before | Behind => origin + curve(voltage - origin),
            Within => origin + restoring::at_force(&force, voltage - origin),
        };
        let axis = if place == Behind { Axis::Stiffness } else { Axis::Law };
        let at = |part: u32| {
            let voltage = (step / unit).round() * unit * f64::from(part);
            let name = format!("at_{voltage:.*}_v", decimals.max(0) as usize);
            let voltage = voltage / volt_v;
            Quantity::new(name, Dimension::Stiffness, value(voltage)).point_of_curve(axis, voltage)
        };
        (1..=POINTS).map(at).collect()
    }

    /// In the fixed-point tick the law is in front of the relaxation, and the same for both signs of the voltage.
    fn unmodelled(&self, form: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        match FORMS[form] {
            (Uneven, _) => {
                Some("fitted with a curve for each sign of the voltage, written for positive voltages".into())
            }
            (_, Before) => None,
            (_, Behind) => Some("fitted behind the relaxation, written before it".into()),
            (_, Within) => {
                Some("fitted as the relaxation's restoring force, its settled curve written before it".into())
            }
        }
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        let gain = chain.gain;
        let law = match FORMS[form].1 {
            Before => &mut chain.law,
            Behind => &mut chain.law_behind,
            Within => &mut chain.force,
        };
        let origin = gain * data.origin_v;
        let curve = continued(form, point, data);
        law.push(move |value| origin + gain * curve((value - origin) / gain));
    }
}
