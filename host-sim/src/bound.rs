//! The fastest that any controller could be.
//!
//! The spring's stiffness never falls when its voltage is raised, now or earlier. So no controller is faster than the
//! one that goes to the end of the amplifier's range as fast as the slew allows and stays there; from a settled spring
//! its response is known in closed form.

use crate::reference::Loop;

/// Shortest time, in s, from an ideal step command until the stiffness has made `part` of the way from a settled
/// `from_v` to `to_v`; `None` if it never gets there within the range.
pub fn shortest_time(system: &Loop, from_v: f64, to_v: f64, part: f64) -> Option<f64> {
    let direction = (to_v - from_v).signum();
    let end_v = if direction > 0.0 { system.range_v.1 } else { system.range_v.0 };
    let travel = (end_v - from_v) * direction;
    let goal = part * (to_v - from_v).abs();
    if goal <= 0.0 {
        return Some(0.0);
    }
    if goal >= travel {
        return None;
    }
    // Everything below is measured from `from_v` in the direction of the step.
    let tau = system.time_constant_s;
    let ramp_s = travel / system.slew_v_per_s;
    let response = |t: f64| {
        let voltage = if t < ramp_s { system.slew_v_per_s * t } else { travel };
        let ramped = t.min(ramp_s);
        let at_ramp_end = if ramp_s > 0.0 { travel / ramp_s * (ramped + tau * (-ramped / tau).exp_m1()) } else { 0.0 };
        let relaxed = travel + (at_ramp_end - travel) * (-(t - ramped) / tau).exp();
        let relaxed = if t < ramp_s { at_ramp_end } else { relaxed };
        system.share * voltage + (1.0 - system.share) * relaxed
    };
    if response(0.0) >= goal {
        return Some(0.0);
    }
    // All but part in 1e15 of the travel is made after 35 time constants.
    let (mut early, mut late) = (0.0, ramp_s + 35.0 * tau);
    for _ in 0..100 {
        let middle = 0.5 * (early + late);
        if response(middle) < goal { early = middle } else { late = middle }
    }
    Some(late)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(limit_v: f64, slew_v_per_s: f64) -> Loop {
        Loop { share: 1.0 / 11.0, time_constant_s: 5.5, gains: None, range_v: (0.0, limit_v), slew_v_per_s }
    }

    #[test]
    fn closed_form_without_slew() {
        for (limit, expected) in [(700.0, 1.62), (1000.0, 0.446)] {
            let got = shortest_time(&paper(limit, f64::INFINITY), 400.0, 500.0, 0.97).unwrap();
            let exact = 5.5 * (10.0 / 11.0 * (limit - 400.0) / (limit - 497.0)).ln();
            assert!((got - exact).abs() < 1e-9 && (got - expected).abs() < 0.005, "{limit}: {got} {exact}");
        }
        assert_eq!(shortest_time(&paper(490.0, f64::INFINITY), 400.0, 500.0, 0.97), None);
        // Down is not the mirror of up: there is only 0 V below.
        assert_eq!(shortest_time(&paper(700.0, f64::INFINITY), 100.0, 0.0, 1.0), None);
        let down = shortest_time(&paper(700.0, f64::INFINITY), 500.0, 400.0, 0.97).unwrap();
        assert!((down - 5.5 * (10.0 / 11.0 * 500.0 / 403.0f64).ln()).abs() < 1e-9);
    }

    /// The bound is reached by the reference when it is simply told to go to the end of the range.
    #[test]
    fn the_reference_at_full_drive_takes_exactly_that_long() {
        for slew in [f64::INFINITY, 800.0, 100.0] {
            let system = paper(700.0, slew);
            let time = shortest_time(&system, 0.0, 100.0, 0.97).unwrap();
            let mut solution = system.at_rest(1.0);
            solution.advance(700.0, 0.0, time);
            let stiffness = solution.moment().stiffness;
            assert!((stiffness - 97.0).abs() < 1e-6, "{slew}: {stiffness}");
        }
    }
}
