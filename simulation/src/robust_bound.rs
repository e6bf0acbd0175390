//! Lower bound on the time of a step under any controller without a sensor that knows the spring only to within errors.
//!
//! For a time `T`, the voltage is a straight line in each of many intervals, the shortest at the start. A linear programme looks for one
//! voltage with which the nominal spring and the springs at all ends of the errors stay below the allowed overshoot at all times, and
//! above 97 % of the step from `T` on:
//!
//! ```text
//! minimise e   with   y_s(t) - (1 + overshoot) step <= e,   0.97 step - y_s(t) <= e for t >= T,   e >= 0,   min <= u <= max,   slew rate
//! ```
//!
//! `T` is possible if the least `e` is 0. Every spring starts settled, and its step is measured from there.
//!
//! Where the time constant is uncertain and the share is not, the shortest `T` is that of a voltage under which all springs fall back by
//! most of the step before `T` and are lifted by the share at `T`. [`RobustBound::shortest_with_nominal_s`] leaves that out: the nominal
//! spring, the likeliest one, has to be at 97 % in its own shortest time, and to stay there.

mod answer;
mod apart;
mod linear;
mod programme;

use anyhow::Result;
use model::Amplifier;

use crate::bad_input;
use crate::plant_file::PlantFile;
use crate::spring_error::{DifferingSpring, Parameter, SpringError};
use linear::Linear;
use programme::Member;

pub use answer::{Answer, Needed, OF_KNOWN, Question, Step, answer};
pub use apart::{Apart, Response};

/// First and longest interval until the time that is tried, as parts of it.
const BEFORE: (f64, f64) = (1.0 / 2400.0, 1.0 / 120.0);
/// Ratio of an interval to the one before it.
const GROWTH: f64 = 1.15;
/// Longest interval after it, in longest time constants.
const LONGEST: f64 = 0.03;
/// Duration of the voltage after that time before it is constant, and longest time that is tried, in longest time constants.
const HORIZON: f64 = 2.0;
/// Resolution of a time: relative, and in shortest time constants.
const RESOLUTION: (f64, f64) = (0.01, 1e-4);
/// Part of a step that counts as reached.
const REACHED: f64 = 0.97;
/// Largest error of a parameter that is tried, and the resolution of [`RobustBound::needed`].
pub const LARGEST_ERROR: (f64, f64) = (0.25, 1e-3);

/// A step from rest behind an amplifier, and what is allowed on the way.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    /// Range and slew limit.
    pub amplifier: Amplifier,
    /// Largest overshoot, as a part of the step.
    pub overshoot: f64,
}

/// The bounds for a spring without blocks that are not linear.
#[derive(Clone, Debug)]
pub struct RobustBound<'a> {
    file: &'a PlantFile,
    allowed: Allowed,
    /// Shortest and longest time constant, in s.
    tau_s: (f64, f64),
}

impl<'a> RobustBound<'a> {
    /// Prepares the bounds.
    ///
    /// # Errors
    /// [`crate::BadInput`] for a spring that is not linear.
    pub fn new(file: &'a PlantFile, allowed: Allowed) -> Result<Self> {
        for (block, has) in [
            ("[memory]", file.memory.is_some()),
            ("[law]", file.law.is_some()),
            ("[leakage]", file.leakage.is_some()),
            ("[[mode]]", !file.modes.is_empty()),
            ("tau_high_s", file.relaxation.tau_high_s.is_some()),
        ] {
            if has {
                bad_input!("the plant has {block}; expected a linear spring: share, time constants and weights only");
            }
        }
        let tau_s = &file.relaxation.tau_s;
        let shortest = tau_s.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = tau_s.iter().copied().fold(0.0, f64::max);
        if longest <= 0.0 {
            bad_input!("the plant has no time constant; expected at least one");
        }
        Ok(Self { file, allowed, tau_s: (shortest, longest) })
    }

    /// Returns the shortest time to 97 % of a step between two settled voltages in V, in s; `None` if no voltage reaches it for all
    /// springs within two time constants.
    pub fn shortest_s(&self, from_v: f64, to_v: f64, error: &SpringError) -> Option<f64> {
        self.shortest_with_nominal_s(from_v, to_v, error, f64::INFINITY)
    }

    /// Returns the same time for voltages under which the nominal spring is above 97 % from `nominal_s` on.
    pub fn shortest_with_nominal_s(&self, from_v: f64, to_v: f64, error: &SpringError, nominal_s: f64) -> Option<f64> {
        let springs = self.springs(error);
        let possible = |time_s: f64| self.is_possible(time_s, nominal_s, from_v, to_v, &springs);
        let (mut early, mut late) = (0.0, HORIZON * self.tau_s.1);
        if !possible(late) {
            return None;
        }
        while late - early > f64::max(RESOLUTION.0 * late, RESOLUTION.1 * self.tau_s.0) {
            // By ratios: the times differ by orders of magnitude.
            let middle = f64::max((early * late).sqrt(), late / 8.0);
            if possible(middle) { late = middle } else { early = middle }
        }
        Some(late)
    }

    /// Returns the largest error of one parameter, both ways, with which all steps of a stair take at most `within_s`; each step is a
    /// pair of voltages, and all steps are of one height.
    ///
    /// Only the first and the last step are tried: relative to the old voltage, the range of a step between them is a weighted mean of
    /// theirs, and so the mean of their voltages is possible there.
    pub fn needed(&self, parameter: Parameter, within_s: f64, steps: &[(f64, f64)]) -> Option<f64> {
        self.largest(|size| SpringError::default().with(parameter, size), within_s, steps)
    }

    /// Returns the same of the instantaneous share as a part of the response, which also says something of a share near 0.
    pub fn needed_of_response(&self, within_s: f64, steps: &[(f64, f64)]) -> Option<f64> {
        let of_response = |share_of_response| SpringError { share_of_response, ..SpringError::default() };
        self.largest(of_response, within_s, steps)
    }

    /// Returns the largest size of an error with which all steps take at most `within_s`.
    fn largest(&self, error: impl Fn(f64) -> SpringError, within_s: f64, steps: &[(f64, f64)]) -> Option<f64> {
        let possible = |size: f64| {
            let springs = self.springs(&error(size));
            let ends = [steps.last(), steps.first()].into_iter().flatten();
            ends.into_iter().all(|&(from_v, to_v)| self.is_possible(within_s, f64::INFINITY, from_v, to_v, &springs))
        };
        let (mut least, mut most) = (0.0, LARGEST_ERROR.0);
        if !possible(least) {
            return None;
        }
        while most - least > LARGEST_ERROR.1 {
            let middle = f64::midpoint(least, most);
            if possible(middle) { least = middle } else { most = middle }
        }
        Some(least)
    }

    /// Durations of the intervals of a programme for a time, in s, and how many of them are before it.
    fn intervals_s(&self, time_s: f64) -> (Vec<f64>, usize) {
        let (mut intervals_s, mut passed_s, mut next_s) = (Vec::new(), 0.0, BEFORE.0 * time_s);
        while passed_s < time_s {
            let left_s = time_s - passed_s;
            // The last one before the time ends there.
            let interval_s = if left_s < 1.5 * next_s { left_s } else { next_s };
            intervals_s.push(interval_s);
            passed_s = if interval_s == left_s { time_s } else { passed_s + interval_s };
            next_s = (GROWTH * next_s).min(BEFORE.1 * time_s);
        }
        let before = intervals_s.len();
        while passed_s < time_s + HORIZON * self.tau_s.1 {
            next_s = (GROWTH * next_s).min(LONGEST * self.tau_s.1);
            intervals_s.push(next_s);
            passed_s += next_s;
        }
        (intervals_s, before)
    }

    /// The springs at all ends of the errors, and then the nominal one.
    fn springs(&self, error: &SpringError) -> Vec<Linear> {
        let mut ends = error.ends(&[1.0, -1.0]);
        if ends.len() > 1 {
            ends.push(SpringError::default());
        }
        ends.iter().map(|end| Linear::of(&DifferingSpring::new(self.file, end))).collect()
    }

    /// True if one voltage brings all springs to the step within a time, the last one within `nominal_s`, and keeps them there.
    fn is_possible(&self, time_s: f64, nominal_s: f64, from_v: f64, to_v: f64, springs: &[Linear]) -> bool {
        let Allowed { amplifier, overshoot } = self.allowed;
        let (intervals_s, before) = self.intervals_s(time_s);
        let step = to_v - from_v;
        // Voltages relative to the old one, in steps, so that the programme is dimensionless.
        let range = ((amplifier.min_v - from_v) / step, (amplifier.max_v - from_v) / step);
        let range = (range.0.min(range.1), range.0.max(range.1));
        let slew_per_s = amplifier.slew_v_per_s.map(|slew| slew / step.abs());
        let nominal_from = intervals_s
            .iter()
            .scan(0.0, |passed_s, interval_s| Some(std::mem::replace(passed_s, *passed_s + interval_s)))
            .take_while(|passed_s| *passed_s < nominal_s)
            .count();
        let member = |(number, spring): (usize, &Linear)| {
            let from = if number + 1 == springs.len() { before.min(nominal_from) } else { before };
            let weights = spring.responses(&intervals_s);
            Member { held: vec![0.0; weights.len()], weights, range, slew_per_s, from }
        };
        let members: Vec<Member> = springs.iter().enumerate().map(member).collect();
        programme::is_possible(&intervals_s, usize::MAX, &members, overshoot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bound::shortest_time;
    use crate::reference::Loop;
    use model::Plant;

    fn known(parameter: Parameter, size: f64) -> SpringError {
        SpringError::default().with(parameter, size)
    }

    fn allowed(slew_v_per_s: Option<f64>) -> Allowed {
        Allowed { amplifier: Amplifier { slew_v_per_s, ..Amplifier::up_to(1000.0) }, overshoot: 0.02 }
    }

    /// Without errors the bound is that of full drive, to the length of an interval: the spring can be held where it is then.
    #[test]
    fn a_known_spring_takes_the_time_of_full_drive() {
        let paper = PlantFile::from(Plant::PAPER);
        for slew in [None, Some(2000.0)] {
            let bound = RobustBound::new(&paper, allowed(slew)).unwrap();
            let system = Loop {
                share: Plant::PAPER.share,
                time_constant_s: Plant::PAPER.time_constant_s,
                gains: None,
                range_v: (0.0, 1000.0),
                slew_v_per_s: slew.unwrap_or(f64::INFINITY),
            };
            for (from_v, to_v) in [(0.0, 100.0), (400.0, 500.0), (500.0, 400.0)] {
                let found = bound.shortest_s(from_v, to_v, &SpringError::default()).unwrap();
                let exact = shortest_time(&system, from_v, to_v, REACHED).unwrap();
                assert!(
                    found > 0.9 * exact - 0.01 && found < 1.15 * exact + 0.03,
                    "{slew:?} {from_v}: {found} {exact}"
                );
            }
        }
    }

    /// Larger errors cost time, and an error of the gain beyond what the band allows cannot be removed: (1 + e) / (1 - e) = 1.02 / 0.97.
    #[test]
    fn errors_cost_time_and_a_gain_beyond_the_band_is_impossible() {
        let paper = PlantFile::from(Plant::PAPER);
        let bound = RobustBound::new(&paper, allowed(None)).unwrap();
        let time = |size| bound.shortest_s(400.0, 500.0, &known(Parameter::TimeConstant, size)).unwrap();
        let [exact, two, ten] = [0.0, 0.025, 0.1].map(time);
        assert!(exact < two && two < ten && ten > 5.0, "{exact} {two} {ten}");
        assert!(bound.shortest_s(0.0, 100.0, &known(Parameter::Gain, 0.026)).is_none());
        assert!(bound.shortest_s(0.0, 100.0, &known(Parameter::Gain, 0.024)).is_some());
        let needed = bound.needed(Parameter::TimeConstant, 0.6, &[(0.0, 100.0)]).unwrap();
        let within = |size| bound.shortest_s(0.0, 100.0, &known(Parameter::TimeConstant, size)).unwrap() <= 0.6;
        assert!(within(needed) && !within(needed + 2e-3), "{needed}");
    }

    /// A share of 0 that may be a part of the response costs time as a share does that is known as well; a relative error of it says nothing.
    #[test]
    fn a_share_near_zero_costs_time_by_its_part_of_the_response() {
        let file = PlantFile::from(Plant { share: 0.0, time_constant_s: 5.5 });
        let bound = RobustBound::new(&file, allowed(None)).unwrap();
        let time = |error| bound.shortest_s(400.0, 500.0, &error).unwrap();
        let of_response = |part| SpringError { share_of_response: part, ..SpringError::default() };
        let exact = time(SpringError::default());
        assert_eq!(time(known(Parameter::Share, 0.9)), exact);
        let [small, large] = [1e-5, 0.05].map(|part| time(of_response(part)));
        assert!((small - exact).abs() < 0.02 * exact && large > 1.1 * exact, "{exact} {small} {large}");
    }

    /// Without the fall back the step takes longer; the time of the nominal spring alone costs a known spring nothing.
    #[test]
    fn a_nominal_spring_in_its_own_time_costs_the_others_time() {
        let paper = PlantFile::from(Plant::PAPER);
        let bound = RobustBound::new(&paper, allowed(None)).unwrap();
        let own_s = bound.shortest_s(400.0, 500.0, &SpringError::default()).unwrap();
        let with = |error, nominal_s| bound.shortest_with_nominal_s(400.0, 500.0, &error, nominal_s);
        assert_eq!(with(SpringError::default(), own_s), Some(own_s));
        let error = known(Parameter::TimeConstant, 0.05);
        let (free_s, kept_s) = (with(error, f64::INFINITY).unwrap(), with(error, 1.05 * own_s).unwrap());
        assert!((2.6..3.0).contains(&free_s) && (3.5..3.9).contains(&kept_s), "{free_s} {kept_s}");
        assert_eq!(with(known(Parameter::Gain, 0.026), own_s), None);
    }

    #[test]
    fn springs_that_are_not_linear_are_refused() {
        let text =
            "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n[law]\nvoltage_v = [0, 500]\nstiffness = [0, 400]\n";
        let file = crate::plant_file::parse("f", text).unwrap();
        let error = RobustBound::new(&file, allowed(None)).unwrap_err().to_string();
        assert!(error.contains("has [law]; expected a linear spring"), "{error}");
    }
}
