//! The controlled spring in continuous time and double precision, solved exactly.
//!
//! Independent of the `model` crate: no ticks, no converter, no fixed point. With the relaxed part `w` and the
//! integrator `z` the loop is
//!
//! ```text
//! y = w + share (u - w)          dw/dt = (u - w) / tau
//! c = Kp (target - y) + z        dz/dt = (u - z) Ki / Kp
//! u = c within range and slew    (then dz/dt is Ki times the error)
//! ```
//!
//! While `u = c` the system is linear with a piecewise linear target, and one matrix exponential, computed once, is the
//! exact step (first-order hold). At a limit, `u` is itself linear in time, and `w`, `z` follow it in closed form; the
//! times at which limits start and stop acting are found by bisection.

mod kernel;
mod mode;

use nalgebra::Matrix4;

use kernel::{Kernel, Pair};

/// The loop to be solved, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// Instantaneous share of a change, 0 to 1.
    pub share: f64,
    /// Time constant of the relaxation, in s.
    pub time_constant_s: f64,
    /// Proportional (dimensionless) and integral gain (1/s) of the controller; with `None` the target is the voltage.
    pub gains: Option<(f64, f64)>,
    /// Lowest and highest voltage, in V.
    pub range_v: (f64, f64),
    /// Slew limit, in V/s; infinite without one.
    pub slew_v_per_s: f64,
}

/// A solution in progress, advanced in samples.
#[derive(Clone, Debug)]
pub struct Solution {
    system: Loop,
    /// Coefficients of the commanded voltage for `w`, `z` and the target.
    law: [f64; 3],
    /// Ki / Kp, in 1/s.
    reset_per_s: f64,
    sample_s: f64,
    /// Exact transition over one sample with `u = c`: rows for `w` and `z`, columns for `w`, `z`, target and slope.
    whole: [[f64; 4]; 2],
    /// Exact transition over two samples, for the SIMD kernel.
    kernel: Kernel,
    w: f64,
    z: f64,
    u: f64,
    /// Target at the end of the last sample, in V.
    target: f64,
    /// True while no limit acts.
    free: bool,
}

/// Shortest duration of a mode, in s, which guarantees progress.
const SHORTEST_S: f64 = 1e-9;

impl Loop {
    /// A spring at rest at 0 V, to be solved in samples of `sample_s` seconds.
    pub fn at_rest(self, sample_s: f64) -> Solution {
        let (law, reset_per_s) = match self.gains {
            None => ([0.0, 0.0, 1.0], 0.0),
            Some((proportional, integral)) => {
                let denominator = 1.0 + proportional * self.share;
                let law = [-proportional * (1.0 - self.share), 1.0, proportional].map(|term| term / denominator);
                (law, integral / proportional)
            }
        };
        let mut solution = Solution {
            system: self,
            law,
            reset_per_s,
            sample_s,
            whole: [[0.0; 4]; 2],
            kernel: Kernel::new([[0.0; 2]; 2], [0.0; 2], [0.0; 2]),
            w: 0.0,
            z: 0.0,
            u: 0.0,
            target: 0.0,
            free: self.range_v.0 <= 0.0 && self.slew_v_per_s.is_infinite(),
        };
        solution.whole = solution.transition(sample_s);
        let columns = |a: usize, b: usize| solution.whole.map(|row| [row[a], row[b]]);
        let later = solution.whole.map(|row| row[3] / sample_s);
        let now = [0, 1].map(|state| solution.whole[state][2] - later[state]);
        solution.kernel = Kernel::new(columns(0, 1), now, later);
        solution
    }
}

/// The loop at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Stiffness as the equivalent static voltage, in V.
    pub stiffness: f64,
    /// Voltage across the spring, in V.
    pub voltage: f64,
}

impl Solution {
    /// Advances by whole samples with targets (V) that are linear in between; `moments` receives the loop at all
    /// targets but the first.
    ///
    /// The first target may differ from the current one, which is a jump.
    pub fn run(&mut self, targets: &[f64], moments: &mut [Moment]) {
        if let Some(&first) = targets.first() {
            self.jump(first);
        }
        let mut done = 0;
        while done + 1 < targets.len() {
            done += self.run_free(&targets[done..], &mut moments[done..]);
            // A limit acts here, or too few samples are left for a pair: advance one sample.
            if let [from_v, to_v, ..] = targets[done..] {
                self.advance(from_v, (to_v - from_v) / self.sample_s, self.sample_s);
                moments[done] = self.moment();
                done += 1;
            }
        }
    }

    /// Advances by pairs of samples until a limit acts; returns the number of samples.
    fn run_free(&mut self, targets: &[f64], moments: &mut [Moment]) -> usize {
        let ([first, second, ..], true) = (targets, self.free) else { return 0 };
        let (lowest, highest) = (Pair::splat(self.system.range_v.0), Pair::splat(self.system.range_v.1));
        let (kernel, share, [by_w, by_z, by_target]) = (self.kernel, self.system.share, self.law);
        let voltage = kernel.output([by_w, by_z], by_target);
        let stiffness = kernel.output([1.0 - share + share * by_w, share * by_z], share * by_target);

        let mut pair = kernel.start([self.w, self.z], [*first, *second]);
        let mut samples = 0;
        for (targets, moments) in targets[1..].windows(3).step_by(2).zip(moments.chunks_exact_mut(2)) {
            let (now, next) = (Pair::new([targets[0], targets[1]]), Pair::new([targets[1], targets[2]]));
            let (stiffness, voltage) = (stiffness.at(pair, now), voltage.at(pair, now));
            if (voltage.simd_lt(lowest) | voltage.simd_gt(highest)).any() {
                break;
            }
            let ([stiffness, later_stiffness], [voltage, later_voltage]) = (stiffness.to_array(), voltage.to_array());
            moments[0] = Moment { stiffness, voltage };
            moments[1] = Moment { stiffness: later_stiffness, voltage: later_voltage };
            samples += 2;
            pair = kernel.next(pair, now, next);
        }
        if samples > 0 {
            self.rejoin(moments[samples - 1], targets[samples]);
        }
        samples
    }

    /// Restores the states from the output of the loop at one time.
    fn rejoin(&mut self, moment: Moment, target: f64) {
        let Moment { stiffness, voltage } = moment;
        let [by_w, by_z, by_target] = self.law;
        self.w = (stiffness - self.system.share * voltage) / (1.0 - self.system.share);
        // Without a controller there is no integrator.
        if by_z != 0.0 {
            self.z = (voltage - by_w * self.w - by_target * target) / by_z;
        }
        (self.u, self.target) = (voltage, target);
    }

    /// Advances by `duration_s` seconds, with a target that starts at `from_v` (V) and changes by `slope` (V/s).
    ///
    /// Limits are checked at the end of each sample; one that is reached and left within a sample is not seen.
    pub fn advance(&mut self, from_v: f64, slope: f64, duration_s: f64) {
        let mut passed = 0.0;
        while passed < duration_s {
            let target = from_v + slope * passed;
            let mode = self.mode(target, slope);
            let rest = (duration_s - passed).min(self.sample_s);
            let mut lasts = rest;
            if self.after(mode, target, slope, rest).broken(mode, target + slope * rest, slope) {
                // The mode ends within this sample: bisect, with a minimum duration.
                let (mut good, mut bad) = (0.0, rest);
                for _ in 0..60 {
                    let middle = 0.5 * (good + bad);
                    if self.after(mode, target, slope, middle).broken(mode, target + slope * middle, slope) {
                        bad = middle;
                    } else {
                        good = middle;
                    }
                }
                lasts = bad.max(SHORTEST_S).min(rest);
            }
            *self = self.after(mode, target, slope, lasts);
            passed += lasts;
        }
        self.jump(from_v + slope * duration_s);
    }

    /// Sets the target to `target_v` (V). Without a slew limit the voltage and the instantaneous part of the stiffness
    /// follow.
    ///
    /// A voltage outside the range is clamped to its end regardless of the slew.
    pub fn jump(&mut self, target_v: f64) {
        let (lowest, highest) = self.system.range_v;
        let wanted = self.law_at(self.w, self.z, target_v);
        // The range takes precedence over the slew.
        self.u = self.u.clamp(lowest, highest);
        if self.system.slew_v_per_s.is_infinite() || (wanted - self.u).abs() <= self.system.slew_v_per_s * SHORTEST_S {
            self.u = wanted.clamp(lowest, highest);
        }
        self.target = target_v;
        self.free = self.system.slew_v_per_s.is_infinite() && (lowest..=highest).contains(&wanted);
    }

    /// The loop at the current time.
    pub fn moment(&self) -> Moment {
        Moment { stiffness: self.w + self.system.share * (self.u - self.w), voltage: self.u }
    }

    #[inline]
    fn law_at(&self, w: f64, z: f64, target: f64) -> f64 {
        self.law[0] * w + self.law[1] * z + self.law[2] * target
    }

    #[inline]
    fn moved(&self, transition: &[[f64; 4]; 2], target: f64, slope: f64) -> [f64; 2] {
        // The states come last, since the next sample depends on their sum.
        transition.map(|[by_w, by_z, by_target, by_slope]| {
            by_target * target + by_slope * slope + by_w * self.w + by_z * self.z
        })
    }

    /// The exact transition over `duration_s` seconds while no limit acts.
    fn transition(&self, duration_s: f64) -> [[f64; 4]; 2] {
        let (relaxation, reset) = (1.0 / self.system.time_constant_s, self.reset_per_s);
        let [by_w, by_z, by_target] = self.law;
        #[rustfmt::skip]
        let rates = Matrix4::new(
            (by_w - 1.0) * relaxation, by_z * relaxation, by_target * relaxation, 0.0,
            by_w * reset, (by_z - 1.0) * reset, by_target * reset, 0.0,
            0.0, 0.0, 0.0, 1.0,
            0.0, 0.0, 0.0, 0.0,
        );
        let moved = (rates * duration_s).exp();
        [0, 1].map(|row| [0, 1, 2, 3].map(|column| moved[(row, column)]))
    }
}

#[cfg(test)]
mod tests;
