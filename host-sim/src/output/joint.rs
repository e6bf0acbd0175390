//! The answer of `vsj joint` as text.

use paper::joint::report::{self, Requirement, Time};

/// The joint's stiffness, and whether the requirement can be met.
pub fn text(report: &report::Report) -> String {
    let report::Report { joint, requirement, limit_v, springs_n_per_m: [soft, stiff], reach_n_m_per_rad, .. } = report;
    let Requirement { low_n_m_per_rad, high_n_m_per_rad, within_s, part } = requirement;
    let mut text = format!(
        "{} springs, inner radius {:.1} mm, outer {:.1} mm, outer end {}.\n\
         Spring constant {soft:.4} N/m without voltage, {stiff:.4} N/m at {limit_v} V: joint stiffness {:.5} to {:.5} \
         N m/rad.\n",
        joint.springs,
        1e3 * joint.inner_radius_m,
        1e3 * (joint.inner_radius_m + joint.spring_length_m),
        format!("{:?}", joint.outer_end).to_lowercase(),
        reach_n_m_per_rad[0],
        reach_n_m_per_rad[1],
    );
    if let Some([asked, constant]) = report.asked {
        let place = if (*soft..=*stiff).contains(&constant) { "within" } else { "out of" };
        text += &format!("{asked} N m/rad needs a spring constant of {constant:.5} N/m: {place} range.\n");
    }
    text += &format!(
        "\nThe requirement, {low_n_m_per_rad} to {high_n_m_per_rad} N m/rad in {within_s} s, {}.\n\
         Range: a ratio of {:.0} is required; the material gives {:.3} at {limit_v} V ({:.3} +- {:.3} over the measured \
         voltages), in any geometry.\n\
         Size: the lowest stiffness alone would need {:.0} springs of this geometry, the highest {:.0}.\n\
         Time: {:.0} % of a change from 0 V takes at least\n",
        if report.in_time_ratio >= report.required_ratio { "can be met" } else { "cannot be met with this material" },
        report.required_ratio,
        report.reach_ratio,
        report.measured_ratio.value,
        report.measured_ratio.high - report.measured_ratio.value,
        report.springs_needed[0],
        report.springs_needed[1],
        1e2 * part,
    );
    for Time { to_v, shortest_s } in &report.times {
        let time = shortest_s.map_or_else(|| "never".to_owned(), |seconds| format!("{seconds:.3} s"));
        text += &format!("  to {to_v:6.1} V  {time:>9}\n");
    }
    text + &format!(
        "Within {within_s} s no controller completes {:.0} % of a change to more than {:.1} V, a stiffness ratio of {:.3}.\n",
        1e2 * part,
        report.in_time_v,
        report.in_time_ratio
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use paper::beam::experiment::SPRING;
    use paper::joint::{Joint, OuterEnd};
    use simulation::reference::Loop;

    #[test]
    fn a_ratio_within_range_can_be_met_if_there_is_enough_time() {
        for (within_s, verdict) in [(9.0, "cannot be met"), (11.0, "can be met")] {
            let joint =
                Joint { inner_radius_m: 0.02, spring_length_m: 0.06, springs: 8, outer_end: OuterEnd::Supported };
            let requirement = Requirement { low_n_m_per_rad: 1.0, high_n_m_per_rad: 1.5, within_s, part: 0.97 };
            let system = Loop {
                share: 1.0 / 11.0,
                time_constant_s: 5.5,
                gains: None,
                range_v: (0.0, 700.0),
                slew_v_per_s: f64::INFINITY,
            };
            let said = text(&report::Report::new(joint, requirement, &SPRING, &system, Some(0.01)).unwrap());
            assert!(said.contains(&format!("in {within_s} s, {verdict}")), "{said}");
        }
    }
}
