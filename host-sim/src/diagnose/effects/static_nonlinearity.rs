//! The sensitivity depends on the voltage, without memory: `f = f(u)`, with `x = |u| / full scale`.
//!
//! | form | `f / u` |
//! | --- | --- |
//! | bend | `1 + a (x - 1)`: the ends stay |
//! | exponential | `(1 - exp(-k x)) / (x (1 - exp(-k)))`: the ends stay |
//! | exponential with gain | `g` times that |
//! | quadratic, cubic, quintic | `g + a x`, `+ b x^2`, `+ c x^3 + d x^4`: the gain is its own |

use crate::diagnose::chain::Chain;
use crate::diagnose::data::Data;
use crate::diagnose::effect::{Coordinate, Effect, Quantity, Scene, Stage};

pub(super) struct StaticNonlinearity;

const BEND: usize = 0;
const EXPONENTIAL: usize = 1;
const EXPONENTIAL_WITH_GAIN: usize = 2;
/// Coefficients of the polynomials, by form.
const COEFFICIENTS: [usize; 6] = [0, 0, 0, 2, 3, 5];

/// Points of the curve that are reported.
const POINTS: u32 = 5;

/// `f / u` at `x`.
fn secant(form: usize, point: &[f64], x: f64) -> f64 {
    match form {
        BEND => 1.0 + point[0] * (x - 1.0),
        EXPONENTIAL_WITH_GAIN => point[1] * secant(EXPONENTIAL, &point[..1], x),
        EXPONENTIAL => {
            let k = if point[0].abs() < 1e-6 { 1e-6 } else { point[0] };
            if x < 1e-9 { k / -(-k).exp_m1() } else { (-k * x).exp_m1() / (x * (-k).exp_m1()) }
        }
        _ => point.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient),
    }
}

impl Effect for StaticNonlinearity {
    fn cause(&self) -> &'static str {
        "static-nonlinearity"
    }

    fn stage(&self) -> Stage {
        Stage::Static
    }

    fn meaning(&self) -> &'static str {
        "the sensitivity depends on the voltage"
    }

    fn experiment(&self) -> &'static str {
        "a slow stair over the whole range up and down again: without memory both branches are one curve"
    }

    fn forms(&self) -> usize {
        COEFFICIENTS.len()
    }

    fn coordinates(&self, form: usize, _: &Data) -> Vec<Coordinate> {
        match form {
            BEND => vec![Coordinate::new(-2.0, 2.0)],
            EXPONENTIAL => vec![Coordinate::new(-8.0, 8.0)],
            EXPONENTIAL_WITH_GAIN => vec![Coordinate::new(-8.0, 8.0), Coordinate::new(0.02, 50.0)],
            _ => {
                let mut coordinates = vec![Coordinate::new(-20.0, 20.0)];
                coordinates.resize(COEFFICIENTS[form], Coordinate::new(-100.0, 100.0));
                coordinates
            }
        }
    }

    fn starts(&self, form: usize, _: &Scene) -> Vec<Vec<f64>> {
        match form {
            BEND => vec![vec![0.1], vec![-0.1]],
            EXPONENTIAL => vec![vec![0.3], vec![-0.3]],
            EXPONENTIAL_WITH_GAIN => vec![vec![0.3, 1.0], vec![-0.3, 1.0]],
            _ => {
                let start = |bend: f64| {
                    let mut start = vec![1.0 - bend, bend];
                    start.resize(COEFFICIENTS[form], 0.0);
                    start
                };
                vec![start(0.05), start(-0.05)]
            }
        }
    }

    fn quantities(&self, form: usize, point: &[f64], data: &Data) -> Vec<Quantity> {
        // At voltages of two digits' steps, so that the name says where exactly.
        let step = data.full_scale_v / f64::from(POINTS);
        let decimals = (1.0 - step.log10().floor()).clamp(-300.0, 300.0) as i32;
        let unit = 10f64.powi(-decimals);
        let at = |part: u32| {
            let voltage = (step / unit).round() * unit * f64::from(part);
            let name = format!("at_{voltage:.*}_v", decimals.max(0) as usize);
            Quantity::new(name, "V", voltage * secant(form, point, voltage / data.full_scale_v))
        };
        (1..=POINTS).map(at).collect()
    }

    fn unmodelled(&self, _: usize, _: &[f64], _: &Data, _: &Chain) -> Option<toml::Value> {
        None
    }

    fn change<'a>(&self, form: usize, point: &'a [f64], data: &'a Data, chain: &mut Chain<'a>) {
        chain.law.push(move |voltage| voltage * secant(form, point, voltage.abs() / data.full_scale_v));
    }
}
