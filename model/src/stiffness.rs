//! Stiffness in Pa and N/m, and the voltage that gives it.
//!
//! Important terms:
//!
//! - *Young's modulus*, `E`: of the whole beam, in Pa. It grows linearly with the static voltage `V` (regression of the
//!   source report's section 8.1.3).
//! - *spring constant*, `k`: force at the tip divided by displacement of the tip, in N/m, of a cantilever of length
//!   `L`, width `b` and thickness `h`.
//! - *scaled stiffness*: stiffness expressed as the equivalent static voltage, in V.
//! - *target*: the scaled stiffness that the controller is to reach, in V.
//!
//! ```text
//! E(V) = E0 + slope V,   k = 3 E I / L^3,   I = b h^3 / 12
//! ```
//!
//! This module computes in floats: it runs when a set-point arrives or a log is read, never in a tick.

use crate::error::OutOfRange;
use crate::units::{ScaledStiffness, Volts};

/// Young's modulus of the whole beam as a linear function of the static voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YoungsModulus {
    /// Young's modulus at 0 V, 1e3 to 1e13 Pa.
    pub at_zero_pa: f64,
    /// Slope, 1 to 1e12 Pa/V.
    pub per_volt_pa: f64,
}

/// Dimensions of the beam, which is clamped at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cantilever {
    /// Free length, 1e-4 to 10 m.
    pub length_m: f64,
    /// Width, 1e-5 to 10 m.
    pub width_m: f64,
    /// Thickness of the whole stack, 1e-7 to 1 m.
    pub thickness_m: f64,
}

/// A cantilever spring with its range of voltages; converts between voltage, Young's modulus and spring constant.
///
/// ```
/// use model::stiffness::{Cantilever, Desired, YoungsModulus};
/// use model::{OutOfRange, Spring};
///
/// fn main() -> Result<(), OutOfRange> {
///     let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0)?;
///     let target = spring.target(Desired::NewtonPerMetre(0.25))?;
///     assert_eq!(target.to_f64().round(), 256.0);
///     assert!((spring.newton_per_metre(target.to_f64()) - 0.25).abs() < 1e-6);
///     // 0.4 N/m would need more than 700 V; the error names the range in the unit of the question.
///     let error = spring.target(Desired::NewtonPerMetre(0.4)).unwrap_err();
///     assert_eq!((error.unit, (1e3 * error.highest).round()), ("N/m", 325.0));
///     Ok(())
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    youngs_modulus: YoungsModulus,
    beam: Cantilever,
    min_v: f64,
    max_v: f64,
}

/// A desired stiffness in one of three units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Desired {
    /// Equivalent static voltage, in V.
    ScaledVolts(f64),
    /// Young's modulus of the whole beam, in Pa.
    Pascal(f64),
    /// Spring constant (tip force divided by tip displacement), in N/m.
    NewtonPerMetre(f64),
}

impl YoungsModulus {
    /// The source report's fit: 1.301 GPa + 1.069 MPa/V. The report's text prints a slope of 0.1069 MPa/V, which none
    /// of its own values supports.
    pub const PAPER: Self = Self { at_zero_pa: 1.301e9, per_volt_pa: 1.069e6 };
}

impl Cantilever {
    /// The source report's leaf spring: 59.8 mm x 19.8 mm x 190 um.
    pub const PAPER: Self = Self { length_m: 59.8e-3, width_m: 19.8e-3, thickness_m: 190e-6 };

    /// Returns the spring constant divided by Young's modulus, `3 I / L^3`, in m.
    fn newton_per_metre_per_pascal(&self) -> f64 {
        let second_moment = self.width_m * self.thickness_m * self.thickness_m * self.thickness_m / 12.0;
        3.0 * second_moment / (self.length_m * self.length_m * self.length_m)
    }
}

impl Spring {
    /// Returns a spring that is driven between `min_v` and `max_v` volts.
    ///
    /// # Errors
    /// [`OutOfRange`] names the field: dimensions and moduli must lie in the ranges stated at their fields, and
    /// `0 <= min_v <= max_v <= 1000` V.
    pub fn new(youngs_modulus: YoungsModulus, beam: Cantilever, min_v: f64, max_v: f64) -> Result<Self, OutOfRange> {
        OutOfRange::check("at_zero_pa", youngs_modulus.at_zero_pa, 1e3..=1e13, "Pa")?;
        OutOfRange::check("per_volt_pa", youngs_modulus.per_volt_pa, 1.0..=1e12, "Pa/V")?;
        OutOfRange::check("length_m", beam.length_m, 1e-4..=10.0, "m")?;
        OutOfRange::check("width_m", beam.width_m, 1e-5..=10.0, "m")?;
        OutOfRange::check("thickness_m", beam.thickness_m, 1e-7..=1.0, "m")?;
        OutOfRange::check("min_v", min_v, 0.0..=1000.0, "V")?;
        OutOfRange::check("spring.max_v", max_v, min_v..=1000.0, "V")?;
        Ok(Self { youngs_modulus, beam, min_v, max_v })
    }

    /// Returns the lowest and the highest scaled stiffness that the spring can reach, in V.
    pub const fn range_v(&self) -> (f64, f64) {
        (self.min_v, self.max_v)
    }

    /// Returns Young's modulus, in Pa, at a scaled stiffness in V.
    pub fn youngs_modulus_pa(&self, scaled_v: f64) -> f64 {
        self.youngs_modulus.at_zero_pa + self.youngs_modulus.per_volt_pa * scaled_v
    }

    /// Returns the spring constant, in N/m, at a scaled stiffness in V.
    pub fn newton_per_metre(&self, scaled_v: f64) -> f64 {
        self.youngs_modulus_pa(scaled_v) * self.beam.newton_per_metre_per_pascal()
    }

    /// Returns Young's modulus, in Pa, of an estimated stiffness.
    pub fn estimate_pa(&self, stiffness: ScaledStiffness) -> f64 {
        self.youngs_modulus_pa(stiffness.to_f64())
    }

    /// Returns the static voltage that gives the desired stiffness.
    ///
    /// # Errors
    /// [`OutOfRange`] with the range that the spring can reach, in the unit of `desired`.
    pub fn target(&self, desired: Desired) -> Result<Volts, OutOfRange> {
        let law = &self.youngs_modulus;
        let from_pascal = |pascal: f64| (pascal - law.at_zero_pa) / law.per_volt_pa;
        let range = |at: &dyn Fn(f64) -> f64| at(self.min_v)..=at(self.max_v);
        let volts = match desired {
            Desired::ScaledVolts(volts) => {
                OutOfRange::check("stiffness", volts, range(&|v| v), "V")?;
                volts
            }
            Desired::Pascal(pascal) => {
                OutOfRange::check("stiffness", pascal, range(&|v| self.youngs_modulus_pa(v)), "Pa")?;
                from_pascal(pascal)
            }
            Desired::NewtonPerMetre(constant) => {
                OutOfRange::check("stiffness", constant, range(&|v| self.newton_per_metre(v)), "N/m")?;
                from_pascal(constant / self.beam.newton_per_metre_per_pascal())
            }
        };
        // Rounding of the inverse may miss the end of the range by the last bit of a float.
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

    /// The source report's section 2.5 measured slopes of 206.03, 275.47 and 324.72 uN/mm at 0, 400 and 700 V.
    #[test]
    fn the_spring_constant_is_within_1_percent_of_the_measured_slopes() {
        for (volts, micronewton_per_millimetre) in [(0.0, 206.03), (400.0, 275.47), (700.0, 324.72)] {
            let got = paper().newton_per_metre(volts) * 1e3;
            assert!((got / micronewton_per_millimetre - 1.0).abs() < 0.01, "{got} {micronewton_per_millimetre}");
        }
    }

    proptest! {
        #[test]
        fn a_stiffness_converts_back_to_its_voltage(volts in 0.0..=700.0f64) {
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
    fn the_error_for_an_unreachable_stiffness_states_the_reachable_range() {
        let error = paper().target(Desired::Pascal(3e9)).unwrap_err();
        assert_eq!((error.field, error.value, error.unit), ("stiffness", 3e9, "Pa"));
        assert_eq!((error.lowest, error.highest), (1.301e9, 1.301e9 + 700.0 * 1.069e6));
        assert!(paper().target(Desired::NewtonPerMetre(0.1)).is_err());
        assert!(paper().target(Desired::ScaledVolts(-1.0)).is_err());
        assert!(paper().target(Desired::ScaledVolts(f64::NAN)).is_err());
    }

    #[test]
    fn a_spring_states_its_range_and_the_modulus_of_an_estimate() {
        let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 20.0, 650.0).unwrap();
        assert_eq!(spring.range_v(), (20.0, 650.0));
        let estimate = ScaledStiffness(Volts::new(400.0).unwrap().0);
        assert_eq!(spring.estimate_pa(estimate), 1.301e9 + 400.0 * 1.069e6);
    }

    #[test]
    fn a_setting_out_of_range_is_rejected_by_name() {
        let beam = Cantilever { thickness_m: 0.0, ..Cantilever::PAPER };
        assert_eq!(Spring::new(YoungsModulus::PAPER, beam, 0.0, 700.0).unwrap_err().field, "thickness_m");
        assert_eq!(Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 9.0, 7.0).unwrap_err().field, "spring.max_v");
    }
}
