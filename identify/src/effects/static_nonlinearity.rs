//! The sensitivity depends on the voltage, without hysteresis: `f = f(u)`, with `x = |u| / full scale`.
//!
//! | curve | `f / u` |
//! | --- | --- |
//! | bend | `1 + a (x - 1)`, fixed at both ends |
//! | exponential | `(1 - exp(-k x)) / (x (1 - exp(-k)))`, fixed at both ends |
//! | exponential with gain | `g` times that |
//! | quadratic, cubic, quintic | `g + a x`, `+ b x^2`, `+ c x^3 + d x^4`, with a gain of its own |
//!
//! Gains are relative to the size of the gain: 1, unless the nominal spring is far from the record.
//!
//! The curve is in front of the relaxation (Hammerstein model), or in some forms behind it (Wiener model), where `u` is
//! the relaxed value. The settled curve is the same; the instantaneous part and the speed of a step distinguish both.

use crate::dimension::Dimension;
use crate::effects::effect::{Coordinate, Effect, FitContext, Location, Quantity};
use crate::effects::gain_error::size;
use crate::plant::chain::Chain;
use crate::plant::visited::Axis;
use crate::record::data::Data;

pub(super) struct StaticNonlinearity;

/// The curve of `f / u` over `x`.
#[derive(Clone, Copy)]
enum Curve {
    Bend,
    Exponential,
    ExponentialWithGain,
    /// A polynomial with this number of coefficients.
    Polynomial(usize),
}
use Curve::{Bend, Exponential, ExponentialWithGain, Polynomial};

/// Curve of each form, and whether it is behind the relaxation.
const FORMS: [(Curve, bool); 10] = [
    (Bend, false),
    (Exponential, false),
    (ExponentialWithGain, false),
    (Polynomial(2), false),
    (Polynomial(3), false),
    (Polynomial(5), false),
    (Bend, true),
    (ExponentialWithGain, true),
    (Polynomial(3), true),
    (Polynomial(5), true),
];

/// Number of points of the curve that are reported.
const POINTS: u32 = 5;

impl Curve {
    /// Returns `f / u` at `x`.
    fn secant(self, point: &[f64], x: f64) -> f64 {
        match self {
            Bend => 1.0 + point[0] * (x - 1.0),
            ExponentialWithGain => point[1] * Exponential.secant(point, x),
            Exponential => {
                let k = if point[0].abs() < 1e-6 { 1e-6 } else { point[0] };
                if x < 1e-9 { k / -(-k).exp_m1() } else { (-k * x).exp_m1() / (x * (-k).exp_m1()) }
            }
            Polynomial(_) => point.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient),
        }
    }
}

/// Returns `f / u` of a form at a voltage; a gain of its own is relative to the size of the gain.
fn secant(form: usize, point: &[f64], voltage: f64, data: &Data) -> f64 {
    let (curve, _) = FORMS[form];
    let secant = curve.secant(point, voltage.abs() / data.full_scale_v);
    if matches!(curve, Bend | Exponential) { secant } else { size(data) * secant }
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

    fn coordinates(&self, form: usize, _: &Data) -> Vec<Coordinate> {
        match FORMS[form].0 {
            Bend => vec![Coordinate::new(-2.0, 2.0)],
            Exponential => vec![Coordinate::new(-8.0, 8.0)],
            ExponentialWithGain => vec![Coordinate::new(-8.0, 8.0), Coordinate::new(0.02, 50.0)],
            Polynomial(coefficients) => {
                let mut coordinates = vec![Coordinate::new(-20.0, 20.0)];
                coordinates.resize(coefficients, Coordinate::new(-100.0, 100.0));
                coordinates
            }
        }
    }

    /// Forms behind the relaxation are not tried with an unknown initial state, in which their prediction is not
    /// linear.
    fn initial_points(&self, form: usize, context: &FitContext) -> Vec<Vec<f64>> {
        if FORMS[form].1 && context.data.initial_state_unknown {
            return Vec::new();
        }
        match FORMS[form].0 {
            Bend => vec![vec![0.1], vec![-0.1]],
            Exponential => vec![vec![0.3], vec![-0.3]],
            ExponentialWithGain => vec![vec![0.3, 1.0], vec![-0.3, 1.0]],
            Polynomial(coefficients) => {
                let start = |bend: f64| {
                    let mut start = vec![1.0 - bend, bend];
                    start.resize(coefficients, 0.0);
                    start
                };
                // An S-shaped curve is zero at both ends and in the middle, so no gradient leads to it from a bend.
                let s = |size: f64| {
                    let mut start = vec![1.0 + size, -3.0 * size, 2.0 * size];
                    start.resize(coefficients, 0.0);
                    start
                };
                let mut starts = vec![start(0.05), start(-0.05)];
                if coefficients > 2 {
                    starts.extend([s(0.1), s(-0.1)]);
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
        let at = |part: u32| {
            let voltage = (step / unit).round() * unit * f64::from(part);
            let name = format!("at_{voltage:.*}_v", decimals.max(0) as usize);
            let voltage = voltage / volt_v;
            Quantity::new(name, Dimension::Stiffness, voltage * secant(form, point, voltage, data))
                .point_of_curve(if FORMS[form].1 { Axis::Stiffness } else { Axis::Law }, voltage)
        };
        (1..=POINTS).map(at).collect()
    }

    /// The gain of the line from 0 V to the curve's end.
    fn own_gain(&self, form: usize, point: &[f64], data: &Data) -> Option<f64> {
        let fixed_at_ends = matches!(FORMS[form].0, Bend | Exponential);
        (!fixed_at_ends).then(|| secant(form, point, data.full_scale_v, data))
    }

    /// In the fixed-point tick the law is in front of the relaxation.
    fn unmodelled(&self, form: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        FORMS[form].1.then(|| "fitted behind the relaxation, written before it".into())
    }

    fn modify_chain<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        let law = if FORMS[form].1 { &mut chain.law_behind } else { &mut chain.law };
        law.push(move |voltage| voltage * secant(form, point, voltage, data));
    }
}
