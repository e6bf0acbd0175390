//! The answer of `vsj joint`: the joint's stiffness, and the report's requirement compared with range, size and time.

use anyhow::Result;
use serde::Serialize;

use crate::beam::cantilever::Beam;
use crate::beam::experiment::Experiment;
use crate::beam::regression::Interval;
use crate::joint::Joint;
use simulation::bad_input::check;
use simulation::bound::shortest_time;
use simulation::reference::Loop;

/// Required range of the joint stiffness, and the time to change it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Requirement {
    /// Lowest required stiffness, in N m/rad.
    pub low_n_m_per_rad: f64,
    /// Highest required stiffness, in N m/rad.
    pub high_n_m_per_rad: f64,
    /// Time allowed for a change, in s.
    pub within_s: f64,
    /// Part of the change that must be completed within that time, 0.01 to 0.9999.
    pub part: f64,
}

impl Requirement {
    /// The requirement of the report's introduction; the part is that of section 3.2.1.
    pub const PAPER: Self = Self { low_n_m_per_rad: 0.7, high_n_m_per_rad: 948.0, within_s: 0.6, part: 0.97 };

    /// Returns the requirement if all values are within range.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the field, its value and the allowed range.
    pub fn checked(self) -> Result<Self> {
        check("low_n_m_per_rad", self.low_n_m_per_rad, 1e-12..=1e12, "N m/rad")?;
        check("high_n_m_per_rad", self.high_n_m_per_rad, self.low_n_m_per_rad..=1e12, "N m/rad")?;
        check("within_s", self.within_s, 1e-6..=1e6, "s")?;
        check("part", self.part, 0.01..=0.9999, "of the change")?;
        Ok(self)
    }
}

/// The answer of `vsj joint --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The joint.
    pub joint: Joint,
    /// Required stiffness and time.
    pub requirement: Requirement,
    /// Highest voltage of the amplifier, in V.
    pub limit_v: f64,
    /// Spring constants at 0 V and at `limit_v`, in N/m.
    pub springs_n_per_m: [f64; 2],
    /// Joint stiffness at 0 V and at `limit_v`, in N m/rad.
    pub reach_n_m_per_rad: [f64; 2],
    /// Ratio of the highest to the lowest stiffness, which does not depend on the geometry.
    pub reach_ratio: f64,
    /// Ratio of the highest to the lowest stiffness over the measured voltages, with its 95 % interval.
    pub measured_ratio: Interval,
    /// Ratio of the highest to the lowest required stiffness.
    pub required_ratio: f64,
    /// Number of springs in this geometry that alone meet the lowest and the highest required stiffness.
    pub springs_needed: [f64; 2],
    /// Shortest times of changes from 0 V to several voltages.
    pub times: Vec<Time>,
    /// Highest static voltage, in V, to which a change from 0 V can be completed to the required part within the
    /// required time.
    pub in_time_v: f64,
    /// Ratio of the stiffness at `in_time_v` to that at 0 V.
    pub in_time_ratio: f64,
    /// A joint stiffness in N m/rad that was asked for, and the spring constant in N/m that gives it.
    pub asked: Option<[f64; 2]>,
}

/// A change from 0 V.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Time {
    /// Static voltage of the target, in V.
    pub to_v: f64,
    /// Shortest time in which any controller completes the required part, in s; `None` if it is out of reach.
    pub shortest_s: Option<f64>,
}

impl Report {
    /// Evaluates springs of the report's material with the dimensions of `beam`, behind the amplifier of `system`.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the argument that is out of range.
    pub fn new(
        joint: Joint,
        requirement: Requirement,
        beam: &Beam,
        system: &Loop,
        asked_n_m_per_rad: Option<f64>,
    ) -> Result<Self> {
        let (joint, requirement, beam) = (joint.checked()?, requirement.checked()?, beam.checked()?);
        let limit_v = check("limit_v", system.range_v.1, 50.0..=1000.0, "V")?;
        check("slew_v_per_s", system.slew_v_per_s, 1e-3..=f64::INFINITY, "V/s")?;
        if let Some(asked) = asked_n_m_per_rad {
            check("stiffness_n_m_per_rad", asked, 1e-12..=1e12, "N m/rad")?;
        }
        let law = Experiment::paper()?;
        let springs = [0.0, limit_v]
            .map(|volts| Beam { youngs_modulus_pa: law.youngs_modulus_pa(volts), ..beam }.spring_constant_n_per_m());
        let Requirement { low_n_m_per_rad: low, high_n_m_per_rad: high, within_s, part } = requirement;
        let one = Joint { springs: 1, ..joint };
        let time = |to_v: f64| shortest_time(system, 0.0, to_v, part);
        // The time increases with the target: bisect.
        let (mut in_time_v, mut too_far) = (0.0, limit_v / part);
        for _ in 0..60 {
            let middle = 0.5 * (in_time_v + too_far);
            if time(middle).is_some_and(|seconds| seconds <= within_s) { in_time_v = middle } else { too_far = middle }
        }
        let in_time_v = in_time_v.min(limit_v);
        Ok(Self {
            joint,
            requirement,
            limit_v,
            springs_n_per_m: springs,
            reach_n_m_per_rad: springs.map(|k| joint.stiffness_n_m_per_rad(k)),
            reach_ratio: springs[1] / springs[0],
            measured_ratio: law.reach_ratio,
            required_ratio: high / low,
            springs_needed: [low / one.stiffness_n_m_per_rad(springs[0]), high / one.stiffness_n_m_per_rad(springs[1])],
            times: [0.2, 0.4, 0.6, 0.8, 1.0]
                .map(|share| share * limit_v)
                .map(|to_v| Time { to_v, shortest_s: time(to_v) })
                .to_vec(),
            in_time_v,
            in_time_ratio: 1.0 + (springs[1] / springs[0] - 1.0) * in_time_v / limit_v,
            asked: asked_n_m_per_rad.map(|asked| [asked, joint.spring_constant_n_per_m(asked)]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beam::experiment::SPRING;
    use crate::joint::tests::JOINT;

    fn report(beam: &Beam, limit_v: f64, requirement: Requirement) -> Report {
        let system = Loop {
            share: 1.0 / 11.0,
            time_constant_s: 5.5,
            gains: None,
            range_v: (0.0, limit_v),
            slew_v_per_s: f64::INFINITY,
        };
        Report::new(JOINT, requirement, beam, &system, Some(0.01)).unwrap()
    }

    /// At 700 V: 97 % of V within 0.6 s needs 0.97 V <= 700 (1 - 10/11 exp(-0.6/5.5)).
    #[test]
    fn the_highest_voltage_in_time_agrees_with_the_closed_form() {
        for limit in [700.0, 1000.0] {
            let report = report(&SPRING, limit, Requirement::PAPER);
            let expected = limit * (1.0 - 10.0 / 11.0 * (-0.6f64 / 5.5).exp()) / 0.97;
            assert!((report.in_time_v - expected).abs() < 1e-6, "{} {expected}", report.in_time_v);
            assert!(report.required_ratio / report.reach_ratio > 700.0);
        }
        let whole = report(&SPRING, 700.0, Requirement::PAPER).times[4].shortest_s.unwrap();
        assert!((whole - 5.5 * (10.0f64 / 11.0 / 0.03).ln()).abs() < 1e-6, "{whole}");
    }

    /// Young's modulus is a property of the material; the spring constant is proportional to `b h^3 / L^3`.
    #[test]
    fn the_spring_constant_scales_with_the_dimensions() {
        let [soft, stiff] = report(&SPRING, 700.0, Requirement::PAPER).springs_n_per_m;
        // Computed by hand from the lines of Table 1.
        assert!((soft - 0.206_46).abs() < 1e-5 && (stiff - 0.323_76).abs() < 1e-5, "{soft} {stiff}");
        let other = Beam { length_m: 0.5 * 59.8e-3, width_m: 3.0 * 19.8e-3, thickness_m: 2.0 * 190e-6, ..SPRING };
        let found = report(&other, 700.0, Requirement::PAPER).springs_n_per_m;
        assert!((found[0] / soft - 192.0).abs() < 1e-6 && (found[1] / stiff - 192.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_requirement_whose_highest_stiffness_is_below_its_lowest_is_rejected() {
        let upside_down = Requirement { high_n_m_per_rad: 0.1, ..Requirement::PAPER };
        assert!(upside_down.checked().unwrap_err().to_string().starts_with("high_n_m_per_rad"));
    }
}
