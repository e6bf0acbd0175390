//! Lower bound on the time of a step under any controller with a sensor that does not know which of several springs it drives.
//!
//! Until a reading can tell them apart the voltage is the same for all; from then on each spring has its own.

use super::GROWTH;
use super::programme::{self, Member};

/// First and longest interval until the time that is tried, as parts of it.
const BEFORE: (f64, f64) = (1.0 / 1200.0, 1.0 / 80.0);
/// Longest interval, in s, and the time for which the springs are followed after the one that is tried, in s.
const AFTER_S: (f64, f64) = (0.05, 2.0);
/// Resolution of a time, relative and in s.
const RESOLUTION: (f64, f64) = (0.01, 0.001);

/// Response of a linear spring, sampled from the step on, in steps: 0 is the stiffness before the step, 1 the target. Of a spring with a law
/// or hysteresis in front of what is linear, the voltage is what comes out of them.
#[derive(Clone, Debug)]
pub struct Response {
    /// Time between two samples, in s.
    pub every_s: f64,
    /// Stiffness if the voltage stays what it is.
    pub held: Vec<f64>,
    /// What the highest voltage adds to it.
    pub full: Vec<f64>,
    /// Lowest voltage, where 0 is the one before the step and 1 the highest.
    pub lowest: f64,
    /// Largest rate of the voltage, in the same unit, per s.
    pub slew_per_s: Option<f64>,
}

/// Springs that only a reading can tell apart.
#[derive(Clone, Copy, Debug)]
pub struct Apart<'a> {
    /// The springs.
    pub springs: &'a [Response],
    /// Time of the first reading that tells them apart, in s.
    pub common_s: f64,
    /// Largest overshoot, as a part of the step.
    pub overshoot: f64,
}

impl Response {
    /// Duration of the samples after which a time of 97 % can be tried, in s.
    pub fn duration_s(longest_s: f64) -> f64 {
        longest_s + AFTER_S.1 + AFTER_S.0
    }

    /// Value at a time of a sampled function, between the samples on a straight line, and after the last one the last one's.
    fn at(&self, samples: &[f64], time_s: f64) -> f64 {
        let place = (time_s / self.every_s).max(0.0);
        let before = (place as usize).min(samples.len() - 1);
        let after = (before + 1).min(samples.len() - 1);
        samples[before] + (place - before as f64).min(1.0) * (samples[after] - samples[before])
    }

    /// The spring under voltages that are a straight line in each interval.
    fn member(&self, times_s: &[f64], from: usize) -> Member {
        // Response to a voltage that rises by 1 in 1 s.
        let ramp: Vec<f64> = std::iter::once(0.0)
            .chain(self.full.windows(2).scan(0.0, |sum, pair| {
                *sum += 0.5 * self.every_s * (pair[0] + pair[1]);
                Some(*sum)
            }))
            .collect();
        let weights = |&now_s: &f64| {
            let mut weights = vec![0.0; times_s.len()];
            weights[0] = self.at(&self.full, now_s);
            for (at, ends) in times_s.windows(2).enumerate().take_while(|(_, ends)| ends[0] < now_s) {
                let rise = self.at(&ramp, now_s - ends[0]) - self.at(&ramp, now_s - ends[1]);
                weights[at] -= rise / (ends[1] - ends[0]);
                weights[at + 1] += rise / (ends[1] - ends[0]);
            }
            weights
        };
        Member {
            weights: times_s.iter().map(weights).collect(),
            held: times_s.iter().map(|now_s| self.at(&self.held, *now_s)).collect(),
            range: (self.lowest, 1.0),
            slew_per_s: self.slew_per_s,
            from,
        }
    }
}

impl Apart<'_> {
    /// True if a controller can bring each spring to 97 % of the step within a time, in s, and keep it there.
    pub fn is_possible(&self, time_s: f64) -> bool {
        let (mut times_s, mut next_s, mut from) = (vec![0.0], BEFORE.0 * time_s, 0);
        let mut passed_s = 0.0;
        while passed_s < time_s + AFTER_S.1 {
            let left_s = time_s - passed_s;
            // The last one before the time ends there.
            let ends = left_s > 0.0 && left_s < 1.5 * next_s;
            passed_s = if ends { time_s } else { passed_s + next_s };
            times_s.push(passed_s);
            if ends {
                from = times_s.len() - 1;
            }
            let longest_s = if passed_s < time_s { (BEFORE.1 * time_s).min(AFTER_S.0) } else { AFTER_S.0 };
            next_s = (GROWTH * next_s).min(longest_s);
        }
        let intervals_s: Vec<f64> = times_s.windows(2).map(|ends| ends[1] - ends[0]).collect();
        let common = times_s.iter().take_while(|at_s| **at_s < self.common_s).count();
        let members: Vec<Member> = self.springs.iter().map(|spring| spring.member(&times_s, from)).collect();
        programme::is_possible(&intervals_s, common, &members, self.overshoot)
    }

    /// Returns the shortest time in which a controller can bring each spring to 97 % of the step and keep it there, in s; `None` if that is
    /// longer than `longest_s`.
    pub fn shortest_s(&self, longest_s: f64) -> Option<f64> {
        let (mut early, mut late) = (0.0, longest_s);
        if !self.is_possible(late) {
            return None;
        }
        while late - early > f64::max(RESOLUTION.0 * late, RESOLUTION.1) {
            let middle = f64::max((early * late).sqrt(), late / 8.0);
            if self.is_possible(middle) { late = middle } else { early = middle }
        }
        Some(late)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERY_S: f64 = 1e-3;

    /// The paper's spring with another time constant, from rest to 100 V, behind an amplifier of 1000 V.
    fn spring(tau_s: f64) -> Response {
        let full = |at: usize| 10.0 * (1.0 - 10.0 / 11.0 * (-(at as f64) * EVERY_S / tau_s).exp());
        let samples = (Response::duration_s(3.0) / EVERY_S) as usize;
        Response {
            every_s: EVERY_S,
            held: vec![0.0; samples],
            full: (0..samples).map(full).collect(),
            lowest: 0.0,
            slew_per_s: None,
        }
    }

    fn shortest_s(springs: &[Response], common_s: f64) -> f64 {
        Apart { springs, common_s, overshoot: 0.02 }.shortest_s(3.0).unwrap_or(f64::INFINITY)
    }

    /// A known spring takes the time of full drive; the pair takes that of its slower one if a reading tells them apart immediately, as
    /// long as the bound without a sensor if none does, and a time between if one does in between.
    #[test]
    fn the_later_a_reading_tells_springs_apart_the_longer_the_step_takes() {
        let exact = |tau_s: f64| tau_s * (10.0 / 11.0 / 0.903f64).ln();
        let (fast, slow) = (5.5 * 0.95, 5.5 * 1.05);
        for tau_s in [fast, slow] {
            let found = shortest_s(&[spring(tau_s)], 0.0);
            assert!((found - exact(tau_s)).abs() < 0.03 * exact(tau_s) + 0.005, "{tau_s}: {found} {}", exact(tau_s));
        }
        let pair = [spring(fast), spring(slow)];
        let [known, soon, late, never] = [0.0, 0.02, 1.5, f64::INFINITY].map(|common_s| shortest_s(&pair, common_s));
        println!("{known} {soon} {late} {never}");
        assert!((known - shortest_s(&pair[1..], 0.0)).abs() < 0.02 * known, "{known}");
        assert!(known <= soon && soon <= late && late <= never, "{known} {soon} {late} {never}");
        // With most of the step in common, it ends soon after the reading.
        assert!(late > 1.5 * known && late < 1.6, "{known} {late}");
    }
}
