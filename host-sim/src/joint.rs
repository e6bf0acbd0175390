//! The joint: leaf springs set radially between two rings that turn against each other (introduction, Figure 4).
//!
//! A spring is clamped at the inner ring, radius `r`, and reaches to the outer one, `R = r + L`. A turn by `phi` bends it.
//! With `k = 3 E I / L^3` of the spring and `n` springs
//!
//! ```text
//! outer end supported   K = n k R^2                          the end goes R phi sideways
//! outer end clamped     K = n k 4/3 (r^2 + r R + R^2)        it goes R phi and turns by phi with the ring
//! ```
//!
//! The second follows from `F = (12 R - 6 L) phi E I / L^3` and `M = (4 L^2 - 6 L R) phi E I / L^3`, torque `F R + M`.

use anyhow::Result;
use serde::Serialize;

use crate::beam::cantilever::Beam;
use crate::beam::check;
use crate::beam::experiment::{Experiment, table1};
use crate::beam::regression::Interval;
use crate::bound::shortest_time;
use crate::reference::Loop;

/// How the outer end is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum OuterEnd {
    /// It slides and turns in a slot
    #[default]
    Supported,
    /// It turns with the ring
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
    /// How the outer end is held.
    pub outer_end: OuterEnd,
}

impl Joint {
    /// Returns the joint if it is one.
    ///
    /// # Errors
    /// [`crate::BadInput`] names the field.
    pub fn checked(self) -> Result<Self> {
        check("inner_radius_m", self.inner_radius_m, 0.0..=100.0, "m")?;
        check("spring_length_m", self.spring_length_m, 1e-6..=100.0, "m")?;
        check("springs", f64::from(self.springs), 1.0..=1e9, "springs")?;
        Ok(self)
    }

    /// Joint stiffness by spring constant, in m2.
    fn lever_m2(&self) -> f64 {
        let (inner, outer) = (self.inner_radius_m, self.inner_radius_m + self.spring_length_m);
        let one = match self.outer_end {
            OuterEnd::Supported => outer * outer,
            OuterEnd::Clamped => 4.0 / 3.0 * (inner * inner + inner * outer + outer * outer),
        };
        f64::from(self.springs) * one
    }

    /// Joint stiffness, in N m/rad, with springs of `k` (tip force by tip displacement, in N/m).
    pub fn stiffness_n_m_per_rad(&self, k_n_per_m: f64) -> f64 {
        k_n_per_m * self.lever_m2()
    }

    /// Spring constant, in N/m, that gives a joint stiffness.
    pub fn spring_constant_n_per_m(&self, n_m_per_rad: f64) -> f64 {
        n_m_per_rad / self.lever_m2()
    }
}

/// What the report asks of the joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Requirement {
    /// Softest, in N m/rad.
    pub low_n_m_per_rad: f64,
    /// Stiffest, in N m/rad.
    pub high_n_m_per_rad: f64,
    /// In which time, in s.
    pub within_s: f64,
    /// How much of the change then has to be made.
    pub part: f64,
}

impl Requirement {
    /// The introduction's; the part is that of section 3.2.1.
    pub const PAPER: Self = Self { low_n_m_per_rad: 0.7, high_n_m_per_rad: 948.0, within_s: 0.6, part: 0.97 };

    /// Returns the requirement if it is one.
    ///
    /// # Errors
    /// [`crate::BadInput`] names the field.
    pub fn checked(self) -> Result<Self> {
        check("low_n_m_per_rad", self.low_n_m_per_rad, 1e-12..=1e12, "N m/rad")?;
        check("high_n_m_per_rad", self.high_n_m_per_rad, self.low_n_m_per_rad..=1e12, "N m/rad")?;
        check("within_s", self.within_s, 1e-6..=1e6, "s")?;
        check("part", self.part, 0.01..=0.9999, "of the change")?;
        Ok(self)
    }
}

/// The whole answer of `vsj joint --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The joint.
    pub joint: Joint,
    /// What is asked of it.
    pub requirement: Requirement,
    /// The amplifier's highest voltage, in V.
    pub limit_v: f64,
    /// Spring constants without voltage and at the limit, in N/m.
    pub springs_n_per_m: [f64; 2],
    /// Joint stiffness without voltage and at the limit, in N m/rad.
    pub reach_n_m_per_rad: [f64; 2],
    /// Stiffest by softest, whatever the geometry.
    pub reach_ratio: f64,
    /// The same over the voltages that were measured, with its 95 % interval.
    pub measured_ratio: Interval,
    /// What is asked for.
    pub required_ratio: f64,
    /// Springs that the softest and the stiffest demand would each need in this geometry, alone.
    pub springs_needed: [f64; 2],
    /// The shortest time, in s, for the part asked for of the change from no voltage to `to_v`; `None`: never.
    pub times: Vec<Time>,
    /// The highest voltage that can be reached, to the part asked for, within the time asked for, in V.
    pub in_time_v: f64,
    /// Stiffness there by stiffness without voltage.
    pub in_time_ratio: f64,
    /// A joint stiffness asked for, and the spring constant in N/m that gives it.
    pub asked: Option<[f64; 2]>,
}

/// One change from no voltage.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Time {
    /// Static voltage of the goal, in V.
    pub to_v: f64,
    /// In s.
    pub shortest_s: Option<f64>,
}

impl Report {
    /// Answers for springs of the report's material and `beam`'s dimensions, driven through `system`'s range.
    ///
    /// # Errors
    /// [`crate::BadInput`] names what cannot be.
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
        let law = Experiment::new(&table1()?, &beam)?;
        let springs = [0.0, limit_v].map(|volts| {
            let pascal = law.at_zero_pa.value + law.per_volt_pa.value * volts;
            Beam { youngs_modulus_pa: pascal, ..beam }.spring_constant_n_per_m()
        });
        let Requirement { low_n_m_per_rad: low, high_n_m_per_rad: high, within_s, part } = requirement;
        let one = Joint { springs: 1, ..joint };
        let time = |to_v: f64| shortest_time(system, 0.0, to_v, part);
        // The higher the goal, the longer it takes.
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

    /// For the terminal.
    pub fn text(&self) -> String {
        let Self { joint, requirement, limit_v, springs_n_per_m: [soft, stiff], reach_n_m_per_rad, .. } = self;
        let Requirement { low_n_m_per_rad, high_n_m_per_rad, within_s, part } = requirement;
        let mut text = format!(
            "{} springs, inner radius {:.1} mm, outer {:.1} mm, outer end {:?}.\n\
             Spring constant {soft:.4} N/m without voltage, {stiff:.4} N/m at {limit_v} V: joint stiffness {:.5} to {:.5} \
             N m/rad.\n",
            joint.springs,
            1e3 * joint.inner_radius_m,
            1e3 * (joint.inner_radius_m + joint.spring_length_m),
            joint.outer_end,
            reach_n_m_per_rad[0],
            reach_n_m_per_rad[1],
        );
        if let Some([asked, constant]) = self.asked {
            let reach = if (*soft..=*stiff).contains(&constant) { "within" } else { "out of" };
            text += &format!("{asked} N m/rad needs a spring constant of {constant:.5} N/m: {reach} reach.\n");
        }
        let reachable = self.reach_ratio >= self.required_ratio;
        text += &format!(
            "\nThe requirement, {low_n_m_per_rad} to {high_n_m_per_rad} N m/rad in {within_s} s, {}.\n\
             Range: a ratio of {:.0} is asked for; the material gives {:.3} at {limit_v} V ({:.3} +- {:.3} over the voltages \
             measured), in any geometry.\n\
             Size: the soft end alone would take {:.0} springs here, the stiff end {:.0}.\n\
             Time: {:.0} % of a change from 0 V takes at least\n",
            if reachable && self.in_time_v >= *limit_v { "can be met" } else { "cannot be met with this material" },
            self.required_ratio,
            self.reach_ratio,
            self.measured_ratio.value,
            self.measured_ratio.high - self.measured_ratio.value,
            self.springs_needed[0],
            self.springs_needed[1],
            1e2 * part,
        );
        for Time { to_v, shortest_s } in &self.times {
            let time = shortest_s.map_or_else(|| "never".to_owned(), |seconds| format!("{seconds:.3} s"));
            text += &format!("  to {to_v:6.1} V  {time:>9}\n");
        }
        text + &format!(
            "Within {within_s} s no controller gets beyond {:.1} V, a stiffness ratio of {:.3}.\n",
            self.in_time_v, self.in_time_ratio
        )
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const JOINT: Joint =
        Joint { inner_radius_m: 0.02, spring_length_m: 0.06, springs: 8, outer_end: OuterEnd::Supported };

    fn paper(limit_v: f64) -> Report {
        let beam = Beam {
            length_m: 59.8e-3,
            width_m: 19.8e-3,
            thickness_m: 190e-6,
            youngs_modulus_pa: 1.0,
            density_kg_per_m3: 0.0,
        };
        let system = Loop {
            share: 1.0 / 11.0,
            time_constant_s: 5.5,
            gains: None,
            range_v: (0.0, limit_v),
            slew_v_per_s: f64::INFINITY,
        };
        Report::new(JOINT, Requirement::PAPER, &beam, &system, Some(0.01)).unwrap()
    }

    /// By hand: 8 springs of 0.3 N/m at 80 mm.
    #[test]
    fn supported_and_clamped() {
        assert!((JOINT.stiffness_n_m_per_rad(0.3) - 8.0 * 0.3 * 0.0064).abs() < 1e-12);
        let clamped = Joint { outer_end: OuterEnd::Clamped, ..JOINT };
        // E I = k L^3 / 3; F R + M with the end displaced by R phi and turned by phi.
        let (length, radius, k) = (0.06, 0.08, 0.3);
        let stiffness = k * length * length * length / 3.0;
        let force = stiffness * (12.0 * radius - 6.0 * length) / (length * length * length);
        let moment = stiffness * (4.0 * length * length - 6.0 * length * radius) / (length * length * length);
        assert!((clamped.stiffness_n_m_per_rad(k) - 8.0 * (force * radius + moment)).abs() < 1e-12);
    }

    /// At 700 V: 97 % of V within 0.6 s needs 0.97 V <= 700 (1 - 10/11 exp(-0.6/5.5)).
    #[test]
    fn what_can_be_done_in_time() {
        for limit in [700.0, 1000.0] {
            let report = paper(limit);
            let expected = limit * (1.0 - 10.0 / 11.0 * (-0.6f64 / 5.5).exp()) / 0.97;
            assert!((report.in_time_v - expected).abs() < 1e-6, "{} {expected}", report.in_time_v);
            assert!(report.required_ratio / report.reach_ratio > 700.0);
        }
        let whole = paper(700.0).times[4].shortest_s.unwrap();
        assert!((whole - 5.5 * (10.0f64 / 11.0 / 0.03).ln()).abs() < 1e-6, "{whole}");
    }

    #[test]
    fn what_is_no_joint_is_named() {
        for (joint, field) in [
            (Joint { inner_radius_m: -1.0, ..JOINT }, "inner_radius_m"),
            (Joint { spring_length_m: 0.0, ..JOINT }, "spring_length_m"),
            (Joint { springs: 0, ..JOINT }, "springs"),
        ] {
            assert!(joint.checked().unwrap_err().to_string().starts_with(field));
        }
        let upside_down = Requirement { high_n_m_per_rad: 0.1, ..Requirement::PAPER };
        assert!(upside_down.checked().unwrap_err().to_string().starts_with("high_n_m_per_rad"));
    }

    proptest! {
        #[test]
        fn there_and_back(k in 1e-3..1e3f64, radius in 0.0..1.0f64, length in 0.01..1.0f64, clamped: bool) {
            let outer_end = if clamped { OuterEnd::Clamped } else { OuterEnd::Supported };
            let joint = Joint { inner_radius_m: radius, spring_length_m: length, springs: 3, outer_end };
            let back = joint.spring_constant_n_per_m(joint.stiffness_n_m_per_rad(k));
            prop_assert!((back / k - 1.0).abs() < 1e-12);
        }
    }
}
