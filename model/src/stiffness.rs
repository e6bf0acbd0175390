//! Stiffness in the units people use, and the voltage that gives it.
//!
//! Young's modulus grows linearly with the voltage (regression of the report's section 8.1.3), and a cantilever of
//! length `L`, width `b` and thickness `h` under a load at its tip has the spring constant
//!
//! ```text
//! E(V) = E0 + slope V,   k = 3 E I / L^3,   I = b h^3 / 12
//! ```
//!
//! Floats: this runs when a set-point arrives or a log is read, never in a tick.

use crate::error::OutOfRange;
use crate::units::{ScaledStiffness, Volts};

/// Young's modulus of the whole beam against static voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YoungsModulus {
    /// Without voltage, in Pa.
    pub at_zero_pa: f64,
    /// Growth, in Pa/V.
    pub per_volt_pa: f64,
}

/// The beam, clamped at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cantilever {
    /// Free length, in m.
    pub length_m: f64,
    /// Width, in m.
    pub width_m: f64,
    /// Thickness of the whole stack, in m.
    pub thickness_m: f64,
}

/// A spring: how stiff it is, and between which voltages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    youngs_modulus: YoungsModulus,
    beam: Cantilever,
    min_v: f64,
    max_v: f64,
}

/// A stiffness that somebody asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Desired {
    /// The static voltage that gives it, in V.
    ScaledVolts(f64),
    /// Young's modulus of the whole beam, in Pa.
    Pascal(f64),
    /// Tip force by tip displacement, in N/m.
    NewtonPerMetre(f64),
}

impl YoungsModulus {
    /// The report's fit: 1.301 GPa + 1.069 MPa/V (its text prints 0.1069, which none of its own values supports).
    pub const PAPER: Self = Self { at_zero_pa: 1.301e9, per_volt_pa: 1.069e6 };
}

impl Cantilever {
    /// The report's leaf spring: 59.8 mm x 19.8 mm x 190 um.
    pub const PAPER: Self = Self { length_m: 59.8e-3, width_m: 19.8e-3, thickness_m: 190e-6 };

    /// Spring constant by Young's modulus, in m.
    fn newton_per_metre_and_pascal(&self) -> f64 {
        let second_moment = self.width_m * self.thickness_m * self.thickness_m * self.thickness_m / 12.0;
        3.0 * second_moment / (self.length_m * self.length_m * self.length_m)
    }
}

impl Spring {
    /// A spring that is driven between `min_v` and `max_v` volts.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field: dimensions and moduli must be positive and finite, the range ascending.
    pub fn new(youngs_modulus: YoungsModulus, beam: Cantilever, min_v: f64, max_v: f64) -> Result<Self, OutOfRange> {
        OutOfRange::check("at_zero_pa", youngs_modulus.at_zero_pa, 1e3..=1e13, "Pa")?;
        OutOfRange::check("per_volt_pa", youngs_modulus.per_volt_pa, 1.0..=1e12, "Pa/V")?;
        OutOfRange::check("length_m", beam.length_m, 1e-4..=10.0, "m")?;
        OutOfRange::check("width_m", beam.width_m, 1e-5..=10.0, "m")?;
        OutOfRange::check("thickness_m", beam.thickness_m, 1e-7..=1.0, "m")?;
        OutOfRange::check("min_v", min_v, 0.0..=1000.0, "V")?;
        OutOfRange::check("max_v", max_v, min_v..=1000.0, "V")?;
        Ok(Self { youngs_modulus, beam, min_v, max_v })
    }

    /// Lowest and highest scaled stiffness that can be asked for, in V.
    pub const fn reach_v(&self) -> (f64, f64) {
        (self.min_v, self.max_v)
    }

    /// Young's modulus in Pa at a scaled stiffness in volts.
    pub fn youngs_modulus_pa(&self, scaled_v: f64) -> f64 {
        self.youngs_modulus.at_zero_pa + self.youngs_modulus.per_volt_pa * scaled_v
    }

    /// Spring constant in N/m at a scaled stiffness in volts.
    pub fn newton_per_metre(&self, scaled_v: f64) -> f64 {
        self.youngs_modulus_pa(scaled_v) * self.beam.newton_per_metre_and_pascal()
    }

    /// The estimate in Pa.
    pub fn estimate_pa(&self, stiffness: ScaledStiffness) -> f64 {
        self.youngs_modulus_pa(stiffness.to_f64())
    }

    /// The static voltage that gives a stiffness.
    ///
    /// # Errors
    /// [`OutOfRange`] with what the spring can reach, in the unit that was asked in.
    pub fn target(&self, desired: Desired) -> Result<Volts, OutOfRange> {
        let law = &self.youngs_modulus;
        let from_pascal = |pascal: f64| (pascal - law.at_zero_pa) / law.per_volt_pa;
        let reach = |at: &dyn Fn(f64) -> f64| at(self.min_v)..=at(self.max_v);
        let volts = match desired {
            Desired::ScaledVolts(volts) => {
                OutOfRange::check("stiffness", volts, reach(&|v| v), "V")?;
                volts
            }
            Desired::Pascal(pascal) => {
                OutOfRange::check("stiffness", pascal, reach(&|v| self.youngs_modulus_pa(v)), "Pa")?;
                from_pascal(pascal)
            }
            Desired::NewtonPerMetre(constant) => {
                OutOfRange::check("stiffness", constant, reach(&|v| self.newton_per_metre(v)), "N/m")?;
                from_pascal(constant / self.beam.newton_per_metre_and_pascal())
            }
        };
        // The inverse may miss the end of the range by a float's last bit.
        Volts::new(volts.max(self.min_v).min(self.max_v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn paper() -> Spring {
        Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap()
    }

    /// Section 2.5: slopes of 206.03, 275.47 and 324.72 uN/mm at 0, 400 and 700 V.
    #[test]
    fn the_spring_constant_agrees_with_the_measured_slopes() {
        for (volts, micronewton_per_millimetre) in [(0.0, 206.03), (400.0, 275.47), (700.0, 324.72)] {
            let got = paper().newton_per_metre(volts) * 1e3;
            assert!((got / micronewton_per_millimetre - 1.0).abs() < 0.01, "{got} {micronewton_per_millimetre}");
        }
    }

    proptest! {
        #[test]
        fn every_reachable_stiffness_leads_back_to_its_voltage(volts in 0.0..=700.0f64) {
            let spring = paper();
            for desired in [
                Desired::ScaledVolts(volts),
                Desired::Pascal(spring.youngs_modulus_pa(volts)),
                Desired::NewtonPerMetre(spring.newton_per_metre(volts)),
            ] {
                prop_assert!((spring.target(desired).unwrap().to_f64() - volts).abs() < 2e-5);
            }
        }
    }

    #[test]
    fn a_stiffness_out_of_reach_is_an_error_that_says_what_is_in_reach() {
        let error = paper().target(Desired::Pascal(3e9)).unwrap_err();
        assert_eq!((error.field, error.value, error.unit), ("stiffness", 3e9, "Pa"));
        assert_eq!((error.lowest, error.highest), (1.301e9, 1.301e9 + 700.0 * 1.069e6));
        assert!(paper().target(Desired::NewtonPerMetre(0.1)).is_err());
        assert!(paper().target(Desired::ScaledVolts(-1.0)).is_err());
        assert!(paper().target(Desired::ScaledVolts(f64::NAN)).is_err());
    }

    #[test]
    fn a_wrong_beam_is_named() {
        let beam = Cantilever { thickness_m: 0.0, ..Cantilever::PAPER };
        assert_eq!(Spring::new(YoungsModulus::PAPER, beam, 0.0, 700.0).unwrap_err().field, "thickness_m");
        assert_eq!(Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 9.0, 7.0).unwrap_err().field, "max_v");
    }
}
