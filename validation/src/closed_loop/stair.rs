//! The target: a stair up to 500 V in steps of 100 V and down in steps of 200 V, and the figures of each step response.

use crate::ground_truth::Schedule;

/// Target of each step, in V; the first starts from rest at 0 V.
pub const LEVELS_V: [f64; 7] = [100.0, 200.0, 300.0, 400.0, 500.0, 300.0, 100.0];
/// Duration of each level, in s.
pub const HOLD_S: f64 = 30.0;
/// Length of the window at the end of a step over which the steady error is averaged, in s.
const STEADY_S: f64 = 1.0;

/// Target at the time `t` in s, in V.
pub fn target_v(t: f64) -> f64 {
    LEVELS_V[((t / HOLD_S + 1e-9) as usize).min(LEVELS_V.len() - 1)]
}

/// Duration of the stair, in s.
pub const fn duration_s() -> f64 {
    HOLD_S * LEVELS_V.len() as f64
}

/// The stair as a schedule of 20 rows per second, from which the sizes of the effects are drawn.
pub fn schedule() -> Schedule {
    let time_s: Vec<f64> = (0..(duration_s() * 20.0) as u32).map(|k| f64::from(k) / 20.0).collect();
    let voltage_v = time_s.iter().map(|&t| target_v(t)).collect();
    Schedule { time_s, voltage_v }
}

/// Figures of one step response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// True for a step upward.
    pub up: bool,
    /// Time from the step until 97 % are first reached, in s; `None` if they are not reached before the next step.
    pub t97_s: Option<f64>,
    /// Steady error: mean of stiffness less target over the last second, in V.
    pub steady_v: f64,
    /// Overshoot, in percent of the step.
    pub overshoot_percent: f64,
}

/// Figures of all steps of a run, from the true stiffness of every tick, in V.
pub fn steps(stiffness: &[f64], rate_hz: f64) -> Vec<Step> {
    let ticks = (HOLD_S * rate_hz).round() as usize;
    let froms = std::iter::once(0.0).chain(LEVELS_V);
    let parts = stiffness.chunks(ticks).zip(LEVELS_V).zip(froms);
    parts.map(|((part, to), from)| step(part, from, to, rate_hz)).collect()
}

fn step(part: &[f64], from: f64, to: f64, rate_hz: f64) -> Step {
    let height = to - from;
    let reached = part.iter().position(|y| (y - from) / height >= 0.97);
    let last = &part[part.len() - (STEADY_S * rate_hz) as usize..];
    let beyond = part.iter().map(|y| (y - to) / height).fold(0.0, f64::max);
    Step {
        up: height > 0.0,
        t97_s: reached.map(|tick| tick as f64 / rate_hz),
        steady_v: last.iter().sum::<f64>() / last.len() as f64 - to,
        overshoot_percent: 100.0 * beyond,
    }
}
