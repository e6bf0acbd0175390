//! The cantilever at any deflection: the geometrically exact, inextensible beam (elastica).
//!
//! With the angle `theta(s)` along the arc, the beam takes the shape of least energy `U`:
//!
//! ```text
//! U = integral of  E I theta'^2 / 2 - V(s) sin theta  ds,   V(s) = P - w (L - s),   theta(0) = 0
//! ```
//!
//! Its Euler equation is `E I theta'' + V cos theta = 0` with a moment-free tip. The angle is linear in each of
//! [`ELEMENTS`] elements (two Gauss points each). Newton's method follows the shape while the load grows from zero,
//! which selects the branch that a slowly loaded beam takes. Sources: Euler 1744; Bisshopp and Drucker 1945 for the tip
//! load.

use anyhow::{Result, bail};

use crate::beam::cantilever::{Beam, Load};

/// Number of elements along the beam.
pub const ELEMENTS: usize = 1000;

/// A point of the bent beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Length along the beam from the clamp, in m.
    pub arc_m: f64,
    /// Distance from the clamp in the direction of the straight beam, in m.
    pub x_m: f64,
    /// Displacement, in m, positive upwards.
    pub y_m: f64,
    /// Angle to the unbent beam, in rad, positive upwards.
    pub angle_rad: f64,
}

/// Distance of the two Gauss points from the middle of an element, in element lengths: 1 / (2 sqrt 3).
const GAUSS: f64 = 0.288_675_134_594_812_9;
/// Newton steps before the load increment is reduced.
const MOST_STEPS: usize = 30;

/// The bent shape under a load, [`ELEMENTS`] + 1 points, clamp first.
///
/// # Errors
/// If Newton's method does not converge to a shape.
pub fn shape(beam: &Beam, load: &Load) -> Result<Vec<Point>> {
    let (length, stiffness) = (beam.length_m, beam.bending_stiffness_n_m2());
    let tip = load.tip_n * length.powi(2) / stiffness;
    let weight = beam.weight_n_per_m(load.gravity_m_per_s2) * length.powi(3) / stiffness;
    let angles = angles(tip, weight)?;

    let mut points = vec![Point { arc_m: 0.0, x_m: 0.0, y_m: 0.0, angle_rad: 0.0 }];
    let step = length / ELEMENTS as f64;
    for (index, pair) in angles.windows(2).enumerate() {
        let (mut x, mut y) = (points[index].x_m, points[index].y_m);
        for (_, angle) in gauss_points(pair[0], pair[1]) {
            x += 0.5 * step * angle.cos();
            y += 0.5 * step * angle.sin();
        }
        points.push(Point { arc_m: step * (index + 1) as f64, x_m: x, y_m: y, angle_rad: pair[1] });
    }
    Ok(points)
}

/// Angles in rad at the nodes under the dimensionless loads `P L^2 / E I` and `w L^3 / E I`.
fn angles(tip: f64, weight: f64) -> Result<Vec<f64>> {
    let mut angles = vec![0.0; ELEMENTS + 1];
    let size = tip.abs().max(weight.abs());
    if size == 0.0 {
        return Ok(angles);
    }
    // A small load bends the beam little; from there the load doubles, or grows by less where Newton's method fails.
    let (mut reached, mut next) = (0.0, (0.5 / size).min(1.0));
    while reached < 1.0 {
        match settle(&angles, next * tip, next * weight) {
            Some(settled) => {
                angles = settled;
                (reached, next) = (next, (2.0 * next).min(1.0));
            }
            None if next - reached < 1e-6 * next => {
                bail!("no equilibrium found beyond {:.3} % of the load", 100.0 * reached)
            }
            None => next = 0.5 * (reached + next),
        }
    }
    Ok(angles)
}

/// Newton's method from a nearby shape; `None` if it does not converge.
fn settle(from: &[f64], tip: f64, weight: f64) -> Option<Vec<f64>> {
    let n = from.len();
    let step = 1.0 / (n - 1) as f64;
    let mut angles = from.to_vec();
    for _ in 0..MOST_STEPS {
        // Gradient and Hessian of the energy; the clamped angle is fixed.
        let (mut gradient, mut diagonal, mut off) = (vec![0.0; n], vec![0.0; n], vec![0.0; n - 1]);
        for element in 0..n - 1 {
            let bend = (angles[element + 1] - angles[element]) / step;
            gradient[element] -= bend;
            gradient[element + 1] += bend;
            diagonal[element] += 1.0 / step;
            diagonal[element + 1] += 1.0 / step;
            off[element] -= 1.0 / step;
            for (part, angle) in gauss_points(angles[element], angles[element + 1]) {
                let shear = tip - weight * (1.0 - (element as f64 + part) * step);
                let (sin, cos) = angle.sin_cos();
                let half = 0.5 * step * shear;
                gradient[element] -= half * cos * (1.0 - part);
                gradient[element + 1] -= half * cos * part;
                diagonal[element] += half * sin * (1.0 - part).powi(2);
                diagonal[element + 1] += half * sin * part.powi(2);
                off[element] += half * sin * part * (1.0 - part);
            }
        }
        let change = solve_tridiagonal(&diagonal[1..], &off[1..], &gradient[1..])?;
        let largest = change.iter().fold(0.0f64, |most, change| most.max(change.abs()));
        // A step of more than about a quarter turn would leave the branch.
        if !largest.is_finite() || largest > 1.5 {
            return None;
        }
        angles[1..].iter_mut().zip(&change).for_each(|(angle, change)| *angle -= change);
        if largest < 1e-11 {
            return Some(angles);
        }
    }
    None
}

/// Position within the element (0 to 1) and angle in rad at both Gauss points.
fn gauss_points(from: f64, to: f64) -> [(f64, f64); 2] {
    [0.5 - GAUSS, 0.5 + GAUSS].map(|part| (part, from + part * (to - from)))
}

/// Solves a symmetric tridiagonal system by elimination; `None` if a pivot is zero.
fn solve_tridiagonal(diagonal: &[f64], off: &[f64], right: &[f64]) -> Option<Vec<f64>> {
    let (mut pivots, mut solution) = (diagonal.to_vec(), right.to_vec());
    for i in 1..pivots.len() {
        let factor = off[i - 1] / pivots[i - 1];
        pivots[i] -= factor * off[i - 1];
        solution[i] -= factor * solution[i - 1];
    }
    for i in (0..pivots.len()).rev() {
        let known = if i + 1 < pivots.len() { off[i] * solution[i + 1] } else { 0.0 };
        solution[i] = (solution[i] - known) / pivots[i];
    }
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::beam::cantilever::tests::FOIL;

    /// The tip of a beam of length 1 under dimensionless loads.
    fn tip(tip: f64, weight: f64) -> Point {
        let soft = Beam { youngs_modulus_pa: 1e6, ..FOIL };
        let (stiffness, length) = (soft.bending_stiffness_n_m2(), soft.length_m);
        let load = Load {
            tip_n: tip * stiffness / length.powi(2),
            gravity_m_per_s2: weight * stiffness / length.powi(3) / soft.weight_n_per_m(1.0),
        };
        let end = *shape(&soft, &load).unwrap().last().unwrap();
        Point { x_m: end.x_m / length, y_m: end.y_m / length, ..end }
    }

    /// Deflection and shortening by elliptic integrals (table of Mattiasson 1981).
    #[test]
    fn a_tip_load_agrees_with_elliptic_integrals() {
        for (load, down, shorter) in [
            (1.0, 0.301_720_774_0, 0.056_433_236_2),
            (2.0, 0.493_457_480_4, 0.160_641_719_8),
            (5.0, 0.713_791_525_0, 0.387_628_365_7),
            (10.0, 0.810_609_029_8, 0.554_996_375_9),
        ] {
            let end = tip(load, 0.0);
            assert!((end.y_m - down).abs() < 1e-5 && (1.0 - end.x_m - shorter).abs() < 1e-5, "{load}: {end:?}");
        }
    }

    #[test]
    fn a_heavy_beam_hangs_down() {
        let end = tip(0.0, 1e4);
        assert!(end.y_m < -0.94 && end.x_m < 0.06 && (end.angle_rad + std::f64::consts::FRAC_PI_2).abs() < 1e-3);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        /// Under small loads the shape agrees with the linear theory all along the beam.
        #[test]
        fn small_loads_agree_with_the_linear_theory(force in -1.0..1.0f64, gravity in -1.0..1.0f64) {
            let load = Load { tip_n: 1e-6 * force, gravity_m_per_s2: 0.01 * gravity };
            let scale = FOIL.linear_m(&Load { tip_n: 2e-6, gravity_m_per_s2: -0.02 }, FOIL.length_m);
            for point in shape(&FOIL, &load).unwrap() {
                prop_assert!((point.y_m - FOIL.linear_m(&load, point.arc_m)).abs() < 1e-5 * scale);
            }
        }

        /// Opposite loads give mirror images, and the length is constant.
        #[test]
        fn mirrored_and_inextensible(force in 0.0..3.0f64, weight in 0.0..3.0f64) {
            let (up, down) = (tip(force, weight), tip(-force, -weight));
            prop_assert!((up.y_m + down.y_m).abs() < 1e-9 && (up.x_m - down.x_m).abs() < 1e-9);
            prop_assert!(up.x_m.hypot(up.y_m) <= 1.0 + 1e-9);
        }

        /// Moment balance of the whole beam: the clamp carries force and weight with the lever arms of the bent shape.
        #[test]
        fn clamp_moment_balances_the_loads(force in 0.1..20.0f64, gravity in 0.0..9.8f64) {
            let load = Load { tip_n: 1e-5 * force, gravity_m_per_s2: gravity };
            let points = shape(&FOIL, &load).unwrap();
            let bend = |i: usize| (points[i + 1].angle_rad - points[i].angle_rad) / points[1].arc_m;
            // Curvature at the clamp from the first two elements.
            let moment = FOIL.bending_stiffness_n_m2() * (1.5 * bend(0) - 0.5 * bend(1));
            let weight = FOIL.weight_n_per_m(gravity);
            let lever: f64 = points.windows(2)
                .map(|pair| 0.5 * (pair[0].x_m + pair[1].x_m) * (pair[1].arc_m - pair[0].arc_m)).sum();
            let expected = load.tip_n * points.last().unwrap().x_m - weight * lever;
            let scale = load.tip_n * FOIL.length_m + weight * FOIL.length_m.powi(2);
            prop_assert!((moment - expected).abs() < 1e-4 * scale, "{moment} {expected}");
        }
    }
}
