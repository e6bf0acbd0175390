//! The joint: leaf springs set radially between two rings that turn against each other (introduction, Figure 4).
//!
//! A spring of free length `L` is clamped at the inner ring, radius `r`, and ends at the outer ring, radius `R = r +
//! L`; a rotation by `phi` bends it. With the spring constant `k = 3 E I / L^3` and `n` springs the joint stiffness is
//!
//! ```text
//! outer end supported   K = n k R^2                          the end goes R phi sideways
//! outer end clamped     K = n k 4/3 (r^2 + r R + R^2)        it goes R phi and turns by phi with the ring
//! ```
//!
//! The second line follows from the end force `F = (12 R - 6 L) phi E I / L^3`, the end moment `M = (4 L^2 - 6 L R) phi
//! E I / L^3` and the torque `F R + M`.

pub mod report;

use anyhow::Result;
use serde::Serialize;

use simulation::bad_input::check;

/// Support of the springs' outer ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OuterEnd {
    /// Simply supported: the end slides and turns in a slot.
    #[default]
    Supported,
    /// Clamped: the end turns with the ring.
    Clamped,
}

/// Springs between two rings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Joint {
    /// Radius of the inner ring, in m.
    pub inner_radius_m: f64,
    /// Free length of a spring, in m.
    pub spring_length_m: f64,
    /// Number of springs.
    pub springs: u32,
    /// Support of the springs' outer ends.
    pub outer_end: OuterEnd,
}

/// Largest number of springs accepted; a larger one is a typing error.
pub const MOST_SPRINGS: u32 = 1_000_000_000;

impl Joint {
    /// Returns the joint if all dimensions are within range.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the field, its value and the allowed range.
    pub fn checked(self) -> Result<Self> {
        check("inner_radius_m", self.inner_radius_m, 0.0..=100.0, "m")?;
        check("spring_length_m", self.spring_length_m, 1e-6..=100.0, "m")?;
        check("springs", f64::from(self.springs), 1.0..=f64::from(MOST_SPRINGS), "springs")?;
        Ok(self)
    }

    /// Joint stiffness divided by the spring constant, in m2.
    fn lever_m2(&self) -> f64 {
        let (inner, outer) = (self.inner_radius_m, self.inner_radius_m + self.spring_length_m);
        let one = match self.outer_end {
            OuterEnd::Supported => outer * outer,
            OuterEnd::Clamped => 4.0 / 3.0 * (inner * inner + inner * outer + outer * outer),
        };
        f64::from(self.springs) * one
    }

    /// Joint stiffness, in N m/rad, of springs with the spring constant `k_n_per_m` (N/m).
    pub fn stiffness_n_m_per_rad(&self, k_n_per_m: f64) -> f64 {
        k_n_per_m * self.lever_m2()
    }

    /// Spring constant, in N/m, that gives a joint stiffness in N m/rad.
    pub fn spring_constant_n_per_m(&self, n_m_per_rad: f64) -> f64 {
        n_m_per_rad / self.lever_m2()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    pub(super) const JOINT: Joint =
        Joint { inner_radius_m: 0.02, spring_length_m: 0.06, springs: 8, outer_end: OuterEnd::Supported };

    /// Computed by hand: 8 springs of 0.3 N/m at 80 mm.
    #[test]
    fn supported_and_clamped() {
        assert!((JOINT.stiffness_n_m_per_rad(0.3) - 8.0 * 0.3 * 0.0064).abs() < 1e-12);
        let clamped = Joint { outer_end: OuterEnd::Clamped, ..JOINT };
        // E I = k L^3 / 3; the torque is F R + M with the end displaced by R phi and turned by phi.
        let (length, radius, k) = (0.06, 0.08, 0.3);
        let stiffness = k * length * length * length / 3.0;
        let force = stiffness * (12.0 * radius - 6.0 * length) / (length * length * length);
        let moment = stiffness * (4.0 * length * length - 6.0 * length * radius) / (length * length * length);
        assert!((clamped.stiffness_n_m_per_rad(k) - 8.0 * (force * radius + moment)).abs() < 1e-12);
    }

    #[test]
    fn an_invalid_joint_is_rejected_with_its_field() {
        for (joint, field) in [
            (Joint { inner_radius_m: -1.0, ..JOINT }, "inner_radius_m"),
            (Joint { spring_length_m: 0.0, ..JOINT }, "spring_length_m"),
            (Joint { springs: 0, ..JOINT }, "springs"),
        ] {
            assert!(joint.checked().unwrap_err().to_string().starts_with(field));
        }
    }

    proptest! {
        #[test]
        fn spring_constant_and_joint_stiffness_are_inverse(k in 1e-3..1e3f64, radius in 0.0..1.0f64, length in 0.01..1.0f64, clamped: bool) {
            let outer_end = if clamped { OuterEnd::Clamped } else { OuterEnd::Supported };
            let joint = Joint { inner_radius_m: radius, spring_length_m: length, springs: 3, outer_end };
            let back = joint.spring_constant_n_per_m(joint.stiffness_n_m_per_rad(k));
            prop_assert!((back / k - 1.0).abs() < 1e-12);
        }
    }
}
