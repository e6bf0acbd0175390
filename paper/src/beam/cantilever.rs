//! Linear bending of a uniform cantilever under a tip force and its own weight (small deflections).
//!
//! ```text
//! v(x) = P x^2 (3 L - x) / (6 E I) - w x^2 (x^2 + 6 L^2 - 4 L x) / (24 E I),   I = b h^3 / 12
//! ```
//!
//! Equations (1) to (4) of the report's section 3.1.1. Displacement `v` and tip force `P` are positive upwards; the
//! weight per length `w` acts downwards.

use anyhow::Result;

use simulation::bad_input::check;

/// A straight, uniform cantilever with a rectangular cross-section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Free length, in m.
    pub length_m: f64,
    /// Width, in m.
    pub width_m: f64,
    /// Thickness in the direction of bending, in m.
    pub thickness_m: f64,
    /// Young's modulus, in Pa.
    pub youngs_modulus_pa: f64,
    /// Density, in kg/m3.
    pub density_kg_per_m3: f64,
}

/// The load on a cantilever.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Force at the tip, upwards, in N.
    pub tip_n: f64,
    /// Gravity, downwards, in m/s2; 0 leaves the weight out.
    pub gravity_m_per_s2: f64,
}

impl Beam {
    /// Returns the beam if length, width, thickness, modulus and density are within their ranges.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the field, its value and the allowed range.
    pub fn checked(self) -> Result<Self> {
        check("length_m", self.length_m, 1e-6..=100.0, "m")?;
        check("width_m", self.width_m, 1e-6..=100.0, "m")?;
        check("thickness_m", self.thickness_m, 1e-9..=10.0, "m")?;
        check("youngs_modulus_pa", self.youngs_modulus_pa, 1.0..=1e14, "Pa")?;
        check("density_kg_per_m3", self.density_kg_per_m3, 0.0..=1e5, "kg/m3")?;
        Ok(self)
    }

    /// Second moment of area `I = b h^3 / 12`, in m4.
    pub fn second_moment_m4(&self) -> f64 {
        self.width_m * self.thickness_m.powi(3) / 12.0
    }

    /// Bending stiffness `E I`, in N m2.
    pub fn bending_stiffness_n_m2(&self) -> f64 {
        self.youngs_modulus_pa * self.second_moment_m4()
    }

    /// Weight per length, in N/m, under a gravity in m/s2.
    pub fn weight_n_per_m(&self, gravity_m_per_s2: f64) -> f64 {
        self.density_kg_per_m3 * self.width_m * self.thickness_m * gravity_m_per_s2
    }

    /// Spring constant at the tip, `3 E I / L^3`, in N/m.
    pub fn spring_constant_n_per_m(&self) -> f64 {
        3.0 * self.bending_stiffness_n_m2() / self.length_m.powi(3)
    }

    /// Young's modulus, in Pa, at which a beam of these dimensions has the spring constant given in N/m.
    pub fn youngs_modulus_of(&self, spring_constant_n_per_m: f64) -> f64 {
        spring_constant_n_per_m * self.length_m.powi(3) / (3.0 * self.second_moment_m4())
    }

    /// Displacement by the linear theory, in m, positive upwards, at `x_m` (m) from the clamp.
    pub fn linear_m(&self, load: &Load, x_m: f64) -> f64 {
        let (stiffness, length, x) = (self.bending_stiffness_n_m2(), self.length_m, x_m);
        let by_force = load.tip_n * x * x * (3.0 * length - x) / (6.0 * stiffness);
        let weight = self.weight_n_per_m(load.gravity_m_per_s2);
        by_force - weight * x * x * (x * x + 6.0 * length * length - 4.0 * length * x) / (24.0 * stiffness)
    }
}

impl Load {
    /// Returns the load if force and gravity are within their ranges.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the field, its value and the allowed range.
    pub fn checked(self) -> Result<Self> {
        check("tip_n", self.tip_n, -1e6..=1e6, "N")?;
        check("gravity_m_per_s2", self.gravity_m_per_s2, -1e3..=1e3, "m/s2")?;
        Ok(self)
    }

    /// The load with force and gravity multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { tip_n: factor * self.tip_n, gravity_m_per_s2: factor * self.gravity_m_per_s2 }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The beam of the report's Appendix 8.1.1, an aluminium foil.
    pub(crate) const FOIL: Beam = Beam {
        length_m: 59.8e-3,
        width_m: 19.8e-3,
        thickness_m: 20e-6,
        youngs_modulus_pa: 69e9,
        density_kg_per_m3: 2700.0,
    };

    /// Computed by hand: P L^3 / 3 E I = 23.479 mm at 300 uN, w L^4 / 8 E I = 18.390 mm.
    #[test]
    fn tip_of_an_aluminium_foil() {
        let up = FOIL.linear_m(&Load { tip_n: 300e-6, gravity_m_per_s2: 0.0 }, FOIL.length_m);
        let down = FOIL.linear_m(&Load { tip_n: 0.0, gravity_m_per_s2: 9.8 }, FOIL.length_m);
        assert!((up - 23.479e-3).abs() < 1e-6 && (down + 18.390e-3).abs() < 1e-6, "{up} {down}");
    }

    #[test]
    fn an_invalid_beam_or_load_is_rejected_with_its_field() {
        for (field, beam) in [
            ("length_m", Beam { length_m: 0.0, ..FOIL }),
            ("width_m", Beam { width_m: -1.0, ..FOIL }),
            ("thickness_m", Beam { thickness_m: f64::NAN, ..FOIL }),
            ("youngs_modulus_pa", Beam { youngs_modulus_pa: f64::INFINITY, ..FOIL }),
            ("density_kg_per_m3", Beam { density_kg_per_m3: -1.0, ..FOIL }),
        ] {
            let error = beam.checked().unwrap_err();
            assert!(error.is::<simulation::bad_input::BadInput>() && error.to_string().starts_with(field), "{error}");
        }
        let error = Load { tip_n: f64::NAN, gravity_m_per_s2: 9.8 }.checked().unwrap_err().to_string();
        assert!(error.starts_with("tip_n = NaN"), "{error}");
    }

    proptest! {
        #[test]
        fn displacements_of_two_loads_superpose(tip in -1e-3..1e-3, gravity in 0.0..20.0, part in 0.0..=1.0f64) {
            let x = part * FOIL.length_m;
            let load = Load { tip_n: tip, gravity_m_per_s2: gravity };
            let apart = FOIL.linear_m(&Load { gravity_m_per_s2: 0.0, ..load }, x)
                + FOIL.linear_m(&Load { tip_n: 0.0, ..load }, x);
            prop_assert!((FOIL.linear_m(&load, x) - apart).abs() < 1e-12);
        }

        /// The work of the tip force equals the bending energy, half the integral of E I times the squared curvature.
        #[test]
        fn work_of_the_tip_force_equals_the_bending_energy(tip in 1e-6..1e-3) {
            let load = Load { tip_n: tip, gravity_m_per_s2: 0.0 };
            let work = 0.5 * tip * FOIL.linear_m(&load, FOIL.length_m);
            let (n, stiffness) = (2000, FOIL.bending_stiffness_n_m2());
            let step = FOIL.length_m / f64::from(n);
            let energy: f64 = (0..n).map(|i| {
                let x = (f64::from(i) + 0.5) * step;
                let v = |x| FOIL.linear_m(&load, x);
                let curvature = (v(x + step) - 2.0 * v(x) + v(x - step)) / (step * step);
                0.5 * stiffness * curvature * curvature * step
            }).sum();
            prop_assert!((energy / work - 1.0).abs() < 1e-4, "{energy} {work}");
        }
    }
}
