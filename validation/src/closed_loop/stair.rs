//! The stair up to 500 V in steps of 100 V and down again in steps of 200 V, and how long each step takes.

use crate::hidden::Schedule;

/// Where each step leads to, in V; it starts from rest.
pub const LEVELS_V: [f64; 7] = [100.0, 200.0, 300.0, 400.0, 500.0, 300.0, 100.0];
/// How long each level is held, in s.
pub const HOLD_S: f64 = 30.0;
/// The steady error is that of the last of these seconds.
const STEADY_S: f64 = 1.0;

/// The target at `t`, in V.
pub fn target_v(t: f64) -> f64 {
    LEVELS_V[((t / HOLD_S + 1e-9) as usize).min(LEVELS_V.len() - 1)]
}

/// From the first step to the end, in s.
pub const fn duration_s() -> f64 {
    HOLD_S * LEVELS_V.len() as f64
}

/// The stair as a record of 20 rows a second would have it: what the sizes of hidden effects go by.
pub fn schedule() -> Schedule {
    let time_s: Vec<f64> = (0..(duration_s() * 20.0) as u32).map(|k| f64::from(k) / 20.0).collect();
    let voltage_v = time_s.iter().map(|&t| target_v(t)).collect();
    Schedule { time_s, voltage_v }
}

/// What became of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// It leads upward.
    pub up: bool,
    /// When 97 % are first reached, in s; none if never before the next step.
    pub t97_s: Option<f64>,
    /// Mean of the stiffness less the target over the last second, in V.
    pub steady_v: f64,
    /// How far beyond the target it gets, in percent of the step.
    pub overshoot_percent: f64,
}

/// The steps of a run of true stiffnesses, one a tick.
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
