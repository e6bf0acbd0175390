//! Droop: the deflection at which the linear theory is no longer valid and the exact one replaces it.
//!
//! Linear and exact displacement are compared all along the beam. The beam droops where their largest difference
//! exceeds a tolerated part of the largest exact displacement.

use anyhow::Result;
use serde::Serialize;

use crate::beam::cantilever::{Beam, Load};
use crate::beam::elastica::{self, Point};
use simulation::bad_input::check;

/// A loaded cantilever, solved by the linear and the exact theory.
#[derive(Clone, Debug)]
pub struct Deflection {
    beam: Beam,
    load: Load,
    exact: Vec<Point>,
    /// Largest difference between linear and exact displacement, as a part of the largest exact displacement.
    pub linear_error: f64,
    /// True if `linear_error` exceeds the tolerance: the exact displacement is the valid one.
    pub droops: bool,
}

/// The displacement at one place along the beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Length along the beam from the clamp, in mm.
    pub at_mm: f64,
    /// Displacement by the linear theory, in mm, positive upwards.
    pub linear_mm: f64,
    /// Displacement by the exact theory, in mm, positive upwards.
    pub exact_mm: f64,
    /// Distance from the clamp in the direction of the unbent beam, in mm; less than `at_mm` where the beam is bent.
    pub exact_x_mm: f64,
    /// The valid displacement, `exact_mm` if the beam droops and `linear_mm` otherwise, in mm.
    pub valid_mm: f64,
}

impl Deflection {
    /// Solves the beam by both theories; `tolerance` is a part of the largest displacement, 0.0001 to 1.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for a beam, load or tolerance out of range; another error if the exact
    /// theory finds no equilibrium.
    pub fn new(beam: &Beam, load: &Load, tolerance: f64) -> Result<Self> {
        checked(beam, load, tolerance)?;
        Self::of(beam, load, tolerance)
    }

    /// Solves like [`Deflection::new`], without checking the ranges: the search of [`limit`] passes them.
    fn of(beam: &Beam, load: &Load, tolerance: f64) -> Result<Self> {
        let exact = elastica::shape(beam, load)?;
        let linear_error = linear_error(beam, load, &exact);
        Ok(Self { beam: *beam, load: *load, exact, linear_error, droops: linear_error > tolerance })
    }

    /// Displacement at `arc_m` (m) along the beam from the clamp.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for a place beyond the ends of the beam.
    pub fn at(&self, arc_m: f64) -> Result<Place> {
        let length = self.beam.length_m;
        // Checked in mm, as users enter it; a rounding error beyond the tip still counts as the tip.
        let last_bit = if arc_m <= length * (1.0 + 1e-12) { arc_m.min(length) } else { arc_m };
        check("at_mm", 1e3 * last_bit, 0.0..=1e3 * length, "mm along the beam")?;
        let cells = (self.exact.len() - 1) as f64;
        let cell = (arc_m / length * cells).floor().min(cells - 1.0);
        let part = arc_m / length * cells - cell;
        let (from, to) = (self.exact[cell as usize], self.exact[cell as usize + 1]);
        let between = |from: f64, to: f64| 1e3 * (from + part * (to - from));
        let (linear_mm, exact_mm) = (1e3 * self.beam.linear_m(&self.load, arc_m), between(from.y_m, to.y_m));
        Ok(Place {
            at_mm: 1e3 * arc_m,
            linear_mm,
            exact_mm,
            exact_x_mm: between(from.x_m, to.x_m),
            valid_mm: if self.droops { exact_mm } else { linear_mm },
        })
    }

    /// The bent shape by the exact theory, clamp first.
    pub fn exact(&self) -> &[Point] {
        &self.exact
    }
}

fn checked(beam: &Beam, load: &Load, tolerance: f64) -> Result<()> {
    check("tolerance", tolerance, 1e-4..=1.0, "of the largest displacement")?;
    beam.checked()?;
    load.checked()?;
    Ok(())
}

fn linear_error(beam: &Beam, load: &Load, exact: &[Point]) -> f64 {
    let largest = |value: &dyn Fn(&Point) -> f64| exact.iter().map(|point| value(point).abs()).fold(0.0, f64::max);
    let displacement = largest(&|point| point.y_m);
    if displacement == 0.0 {
        return 0.0;
    }
    largest(&|point| point.y_m - beam.linear_m(load, point.arc_m)) / displacement
}

/// The factor on the load (force and weight together) at which the error of the linear theory equals `tolerance`;
/// `None` if the load is zero.
///
/// # Errors
/// Returns the errors of [`Deflection::new`].
pub fn limit(beam: &Beam, load: &Load, tolerance: f64) -> Result<Option<f64>> {
    checked(beam, load, tolerance)?;
    let droops = |factor: f64| Ok::<_, anyhow::Error>(Deflection::of(beam, &load.scaled(factor), tolerance)?.droops);
    let size = (load.tip_n * beam.length_m.powi(2) / beam.bending_stiffness_n_m2()).abs().max(
        (beam.weight_n_per_m(load.gravity_m_per_s2) * beam.length_m.powi(3) / beam.bending_stiffness_n_m2()).abs(),
    );
    if size == 0.0 {
        return Ok(None);
    }
    // Start from a load that bends the beam by about a hundredth of its length.
    let mut high = 0.03 / size;
    while !droops(high)? {
        high *= 1.5;
        if high * size > 1e6 {
            return Ok(None);
        }
    }
    let mut low = high / 1.5;
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if droops(middle)? { high = middle } else { low = middle }
    }
    Ok(Some(high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beam::cantilever::tests::FOIL;

    const PUSHED: Load = Load { tip_n: 1e-6, gravity_m_per_s2: 0.0 };

    /// Under a tip force with P L^2 / E I = 1 the exact tip is at y/L = 0.30172, the linear one at 1/3: 10.5 % off.
    #[test]
    fn the_limit_of_a_tip_load_agrees_with_the_elastica() {
        let unit = FOIL.bending_stiffness_n_m2() / FOIL.length_m.powi(2);
        let factor = limit(&FOIL, &PUSHED, (1.0 / 3.0 - 0.301_720_774) / 0.301_720_774).unwrap().unwrap();
        assert!((factor * PUSHED.tip_n / unit - 1.0).abs() < 1e-3, "{}", factor * PUSHED.tip_n / unit);
    }

    #[test]
    fn the_valid_theory_changes_at_the_limit() {
        let factor = limit(&FOIL, &PUSHED, 0.05).unwrap().unwrap();
        for (factor, droops) in [(0.99 * factor, false), (1.01 * factor, true)] {
            let bent = Deflection::new(&FOIL, &PUSHED.scaled(factor), 0.05).unwrap();
            let tip = bent.at(FOIL.length_m).unwrap();
            assert_eq!(bent.droops, droops);
            assert_eq!(tip.valid_mm, if droops { tip.exact_mm } else { tip.linear_mm });
            assert!(tip.exact_mm < tip.linear_mm);
        }
        assert_eq!(limit(&FOIL, &PUSHED.scaled(0.0), 0.05).unwrap(), None);
    }

    /// Bending depends on P L^2 / E I only, whatever force that takes.
    #[test]
    fn a_beam_too_stiff_for_any_allowed_load_still_has_a_limit() {
        let thick = Beam { thickness_m: 1e5 * FOIL.thickness_m, ..FOIL };
        let [usual, limit] = [FOIL, thick].map(|beam| limit(&beam, &PUSHED, 0.05).unwrap().unwrap());
        assert!((limit / usual / 1e15 - 1.0).abs() < 1e-6, "{}", limit / usual);
    }

    #[test]
    fn a_place_beyond_the_tip_is_rejected() {
        let bent = Deflection::new(&FOIL, &PUSHED, 0.05).unwrap();
        for at in [-1e-3, 0.06, f64::NAN] {
            assert!(bent.at(at).unwrap_err().is::<simulation::bad_input::BadInput>());
        }
        assert!(Deflection::new(&FOIL, &PUSHED, f64::NAN).is_err());
    }
}
