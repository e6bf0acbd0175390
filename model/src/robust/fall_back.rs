//! The fall back of the robust pre-compensator: all springs lose a part of the step for a while, and the slow ones are in the band earlier.
//!
//! Without a sensor nothing but time brings the springs together that a time constant may be: their stiffness differs by
//! `c (exp(-t / tau) - exp(-t / (share tau)))` of a step of the quick spring after `t`. A step back, and the same step forward later,
//! takes this away from what the first step has left, until the second one has had time to add it again. The voltage of the shortest
//! time, of `vsj bound`, does this as well. [`FallBack::design`] computes when; the tick compares the lead with two thresholds.

use super::Margin;
use super::enabled::MISSING;
use crate::amplifier::Amplifier;
use crate::coefficient::{Weight, saturated};
use crate::estimator::StepGain;
use crate::units::{SampleTime, Signal, lag_fraction, signal};

/// Duration of the fall back, in time constants with which the voltage settles for a constant stiffness.
const DURATION: f64 = 1.5;
/// Part of a step by which the design stays within the band: what the time of the first approach and the DAC's codes change.
const RESERVE: f64 = 0.0005;
/// Latest end that is tried, in time constants of the spring, and the number of bisections.
const LATEST: f64 = 4.0;
const BISECTIONS: usize = 16;
/// Times after the end at which the band is checked: their number, and their distance in the time constants of [`DURATION`].
const CHECKED: (usize, f64) = (16, 0.4);
/// Largest part of the lead by which the target is moved.
const LARGEST_PART: f64 = 1.5;
/// Longest time of the amplifier's slew for the return, in the time constants of [`DURATION`].
const SLEWED: f64 = 0.3;
/// Part of the largest lead by which it has to have fallen before the fall back, as a shift to the right.
const FALLEN_SHIFT: u32 = 6;

/// When to fall back, in the lead that the quick spring has gained over the model since the target changed, as a part of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallBack {
    /// Part of the step that is given up.
    pub depth: f64,
    /// The fall back begins when the lead, having been larger, is down to this.
    pub start: f64,
    /// It ends when the lead is down to this.
    pub end: f64,
    /// Part of the lead by which the target is moved.
    pub part: f64,
    /// Change of the voltage at the return, in V per V of the step. Where range or slew do not allow it there is no fall back.
    pub jump: f64,
}

/// Relaxation of one spring relative to the quick one, in time constants of the model.
struct Kernel {
    slow: (f64, f64),
    fast: (f64, f64),
}

impl Kernel {
    /// The spring of this share and time constant, while the stiffness of the quick one is constant but for steps.
    fn new(quick: (f64, f64), (share, tau): (f64, f64)) -> Self {
        let settles = quick.0 * quick.1;
        let slow = (1.0 - share) * (1.0 - quick.1 / tau) / (1.0 - settles / tau);
        Self { slow: (slow, tau), fast: (1.0 - share / quick.0 - slow, settles) }
    }

    /// How far the spring is behind the quick one at a time after a step, as a part of the step.
    // Called, not copied to each place: the image that holds everything has a few hundred bytes left.
    #[inline(never)]
    fn behind(&self, time: f64) -> f64 {
        let kept = |(weight, tau): (f64, f64)| weight * (1.0 - lag_fraction(time, tau));
        if time < 0.0 { 0.0 } else { kept(self.slow) + kept(self.fast) }
    }
}

/// A step of the quick spring, whose springs fall back for [`DURATION`].
struct Step {
    /// Stiffness of the quick spring, as a part of the step.
    highest: f64,
    /// Time constant with which the voltage settles, in time constants of the model.
    settles: f64,
}

impl Step {
    /// How far a spring is behind the quick one at a time, if all lose `depth` until the fall back's `end`.
    #[inline(never)]
    fn behind(&self, spring: &Kernel, depth: f64, time: f64, end: f64) -> f64 {
        let start = (end - DURATION * self.settles).max(0.0);
        self.highest * spring.behind(time) + depth * (spring.behind(time - end) - spring.behind(time - start))
    }

    /// Returns the earliest end of a fall back by `depth` after which a spring is at most `allowed` behind the quick one.
    #[inline(never)]
    fn earliest_end(&self, spring: &Kernel, depth: f64, allowed: f64) -> f64 {
        let (mut early, mut late) = (0.0, LATEST);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (early + late);
            let time = |at: usize| middle + at as f64 * CHECKED.1 * self.settles;
            let holds = (0..CHECKED.0).all(|at| self.behind(spring, depth, time(at), middle) <= allowed);
            if holds { late = middle } else { early = middle }
        }
        late
    }
}

impl FallBack {
    /// Computes when to fall back for a spring with one time constant, which the step reaches without delay. `quick_share` is the share of
    /// the quick spring. `None` where a fall back does not bring the slow springs into the band any earlier.
    pub fn design(margin: &Margin, quick_share: f64) -> Option<Self> {
        let Margin { time_constant, share, gain, overshoot, fall_back: depth } = *margin;
        let quick_share = quick_share.clamp(1e-3, 0.9);
        let nominal = quick_share / (1.0 + share);
        let quick = (quick_share, 1.0 - time_constant);
        let slow = Kernel::new(quick, (nominal * (1.0 - share), 1.0 + time_constant));
        let (highest, lowest) = ((1.0 + overshoot) / (1.0 + gain), (1.0 - MISSING) / (1.0 - gain));
        let allowed = highest - lowest - RESERVE;
        let step = Step { highest, settles: quick.0 * quick.1 };
        let earliest_end = |depth| step.earliest_end(&slow, depth, allowed);
        let end = earliest_end(depth);
        let start = end - DURATION * step.settles;
        if depth == 0.0 || allowed <= 0.0 || start <= 0.0 || end >= earliest_end(0.0).min(0.99 * LATEST) {
            return None;
        }
        let model = Kernel::new(quick, (nominal, 1.0));
        // Just before the steps.
        let lead = |time: f64| step.behind(&model, depth, time - 1e-6, end);
        let (start, end) = (lead(start), lead(end));
        // The quick spring is at the allowed overshoot when the lead is down to the end.
        let part = ((highest - 1.0).max(0.0) / end.max(1e-3)).min(LARGEST_PART);
        let jump = depth / quick_share;
        (start > end && jump < Weight::MAX).then_some(Self { depth, start, end, part, jump })
    }

    /// Returns the largest change of the voltage that a slew, in V per tick, makes quickly enough, in V. `settling_ticks` is the time
    /// constant with which the voltage settles for a constant stiffness, in ticks.
    pub fn largest_jump_v(slew_per_tick_v: f64, settling_ticks: f64) -> f64 {
        slew_per_tick_v * SLEWED * settling_ticks
    }
}

/// The thresholds, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Thresholds {
    depth: Weight,
    start: Weight,
    end: Weight,
    jump: Weight,
    largest_jump: Signal,
    range: (Signal, Signal),
}

/// What a step has of its fall back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Phase {
    /// It has none, or has been through it.
    #[default]
    Over,
    /// The lead has not come down to the start yet; its largest magnitude since the quick spring was at the target.
    Before(Signal),
    /// All springs are held back.
    Back,
}

impl Thresholds {
    /// Quantizes the thresholds for the quick spring's response behind an amplifier.
    pub(super) fn new(design: &FallBack, quick: &StepGain, amplifier: &Amplifier, sample_time: SampleTime) -> Self {
        let FallBack { depth, start, end, jump, .. } = *design;
        let settling_ticks = quick.feedthrough / quick.in_one_tick.max(1e-9);
        let jump_v = |step_v| FallBack::largest_jump_v(step_v, settling_ticks);
        Self {
            depth: Weight::new(depth),
            start: Weight::new(start),
            end: Weight::new(end),
            jump: Weight::new(jump),
            largest_jump: amplifier.slew_per_tick_v(sample_time).map_or(Signal::MAX, |step_v| signal(jump_v(step_v))),
            range: (signal(amplifier.min_v), signal(amplifier.max_v)),
        }
    }

    /// Returns by how much the target of a `step` is lowered in this tick, with the sign of the step. `lead` is what the quick spring's lead over
    /// the model has gained since the target changed, `missing` the quick spring's distance to the target, and `driven` the last voltage.
    #[inline(always)]
    pub(super) fn fall(
        &self,
        phase: &mut Phase,
        step: Signal,
        lead: Signal,
        missing: Signal,
        driven: Signal,
    ) -> Signal {
        let downward = step < Signal::ZERO;
        let along = |signal: Signal| if downward { Signal::ZERO.saturating_sub(signal) } else { signal };
        let (size, lead) = (along(step), along(lead));
        let down_to = |part: Weight| lead <= saturated(part.times(size));
        match *phase {
            Phase::Over => return Signal::ZERO,
            Phase::Before(largest) => {
                if along(missing) > size >> 5 {
                    return Signal::ZERO;
                }
                let largest = largest.max(lead);
                *phase = Phase::Before(largest);
                if lead < largest.saturating_sub(largest >> FALLEN_SHIFT) && down_to(self.start) {
                    let jump = saturated(self.jump.times(step));
                    let after = driven.saturating_add(jump);
                    let possible = along(jump) <= self.largest_jump && after >= self.range.0 && after <= self.range.1;
                    *phase = if possible { Phase::Back } else { Phase::Over };
                }
            }
            Phase::Back => (),
        }
        if *phase == Phase::Back && down_to(self.end) {
            *phase = Phase::Over;
        }
        if *phase == Phase::Back { saturated(self.depth.times(step)) } else { Signal::ZERO }
    }
}
