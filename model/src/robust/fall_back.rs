//! The fall back of the robust pre-compensator: all springs lose a part of the step for a while, and the slow ones are in the band earlier.
//!
//! Without a sensor nothing but time brings the springs together that a time constant may be: their stiffness differs by
//! `c (exp(-t / tau) - exp(-t / (share tau)))` of a step of the quick spring after `t`. A step back, and the same step forward later,
//! takes this away from what the first step has left, until the second one has had time to add it again. The voltage of the shortest
//! time, of `vsj bound`, does this as well. [`FallBack::design`] computes when; the tick compares the lead with two thresholds.

use super::margin::{MISSING, Margin};
use crate::amplifier::Amplifier;
use crate::coefficient::{Weight, saturated};
use crate::estimator::StepGain;
use crate::units::{SampleTime, Signal, lag_fraction, signal};

/// Duration of the fall back, in time constants with which the voltage settles for a constant stiffness.
const DURATION: f64 = 1.5;
/// Distance that the design keeps from the lower end of the band, as a part of a step, for the rounding to the DAC's codes and the time
/// of the first approach.
const RESERVE: f64 = 0.0005;
/// Latest end of a fall back that is tried, in time constants of the spring.
const LATEST: f64 = 4.0;
/// Number of bisections of the end's time.
const BISECTIONS: usize = 16;
/// Times after the end at which the band is checked: their number, and their distance in the time constants of [`DURATION`].
const CHECKED: (usize, f64) = (16, 0.4);
/// Largest part of the lead by which the target is moved.
const LARGEST_PART: f64 = 1.5;
/// Longest time in which the amplifier's slew has to make the return, in the time constants of [`DURATION`].
const SLEWED: f64 = 0.3;
/// Longest fall back, in planned ones: its end is a lead, which a step from an unsettled spring may never come down to.
const LONGEST: f64 = 4.0;
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
    /// Part of the lead by which the target is moved from the fall back on.
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

    /// Returns the number of ticks after which a fall back ends, whatever the lead. `settling_ticks` as in [`FallBack::largest_jump_v`].
    pub fn longest_ticks(settling_ticks: f64) -> u32 {
        (LONGEST * DURATION * settling_ticks) as u32
    }
}

/// The thresholds, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Thresholds {
    depth: Weight,
    start: Weight,
    end: Weight,
    part: Weight,
    jump: Weight,
    largest_jump: Signal,
    longest_ticks: u32,
    range: (Signal, Signal),
}

/// What a step has of its fall back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Phase {
    /// It has none.
    #[default]
    Never,
    /// The lead has not come down to the start yet; its largest magnitude since the quick spring was at the target.
    Before(Signal),
    /// All springs are held back, for at most this number of ticks more.
    Back(u32),
    /// It has been through it.
    Over,
}

impl Thresholds {
    /// Quantizes the thresholds for the quick spring's response behind an amplifier.
    pub(super) fn new(design: &FallBack, quick: &StepGain, amplifier: &Amplifier, sample_time: SampleTime) -> Self {
        let FallBack { depth, start, end, part, jump } = *design;
        let settling_ticks = quick.feedthrough / quick.in_one_tick.max(1e-9);
        let jump_v = |step_v| FallBack::largest_jump_v(step_v, settling_ticks);
        Self {
            depth: Weight::new(depth),
            start: Weight::new(start),
            end: Weight::new(end),
            part: Weight::new(part),
            jump: Weight::new(jump),
            longest_ticks: FallBack::longest_ticks(settling_ticks),
            largest_jump: amplifier.slew_per_tick_v(sample_time).map_or(Signal::MAX, |step_v| signal(jump_v(step_v))),
            range: (signal(amplifier.min_v), signal(amplifier.max_v)),
        }
    }

    /// Returns by how much the target of a `step` is lowered in this tick, with the sign of the step. `before` is half the quick spring's lead
    /// over the model when the target changed, `lead` what it has gained over that, `missing` the quick spring's distance to the target, and
    /// `driven` the last voltage.
    #[inline(always)]
    pub(super) fn fall(
        &self,
        phase: &mut Phase,
        step: Signal,
        (before, lead): (Signal, Signal),
        missing: Signal,
        driven: Signal,
    ) -> Signal {
        let downward = step < Signal::ZERO;
        let along = |signal: Signal| if downward { Signal::ZERO.saturating_sub(signal) } else { signal };
        let (size, lead) = (along(step), along(lead));
        let down_to = |part: Weight| lead <= saturated(part.times(size));
        match *phase {
            Phase::Never | Phase::Over => return Signal::ZERO,
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
                    // Where the springs still go the other way, the gained lead ends at what is taken off here, and not at the end.
                    let ends =
                        Signal::ZERO.saturating_sub(along(before)) <= saturated(self.end.times(size)).max(Signal::ZERO);
                    *phase = if possible && ends { Phase::Back(self.longest_ticks) } else { Phase::Never };
                }
            }
            Phase::Back(ticks) => *phase = Phase::Back(ticks.saturating_sub(1)),
        }
        if matches!(*phase, Phase::Back(ticks) if ticks == 0 || down_to(self.end)) {
            *phase = Phase::Over;
        }
        if matches!(*phase, Phase::Back(_)) { saturated(self.depth.times(step)) } else { Signal::ZERO }
    }

    /// Returns the part of the lead by which the target is moved, which is `usual` before a fall back.
    #[inline(always)]
    pub(super) fn part(&self, phase: Phase, usual: Weight) -> Weight {
        if matches!(phase, Phase::Back(_) | Phase::Over) { self.part } else { usual }
    }
}

#[cfg(test)]
mod tests {
    use std::vec;
    use std::vec::Vec;

    use super::*;

    fn volts(volts: f64) -> Signal {
        signal(volts)
    }

    const LONGEST_TICKS: u32 = 5;

    /// A quarter of the step is given up between leads of a half and a fifth of it.
    fn thresholds() -> Thresholds {
        let [depth, start, end, part, jump] = [0.25, 0.5, 0.2, 0.9, 2.0].map(Weight::new);
        let range = (volts(0.0), volts(700.0));
        Thresholds { depth, start, end, part, jump, largest_jump: volts(300.0), longest_ticks: LONGEST_TICKS, range }
    }

    /// What the target of a step is lowered by, and the phase after it, for some gained leads at the target under a voltage.
    fn falls(step: f64, before: f64, leads: &[f64], driven: f64) -> (Vec<f64>, Phase) {
        let mut phase = Phase::Before(Signal::ZERO);
        let mut fall = |lead: &f64| {
            let leads = (volts(before), volts(*lead));
            thresholds().fall(&mut phase, volts(step), leads, Signal::ZERO, volts(driven)).to_num::<f64>()
        };
        let each = leads.iter().map(&mut fall).map(|volts| (volts * 100.0).round() / 100.0).collect();
        (each, phase)
    }

    #[test]
    fn springs_fall_back_between_the_two_leads_in_both_directions() {
        let leads = [60.0, 80.0, 79.0, 51.0, 50.0, 21.0, 20.0, 10.0];
        let expected = vec![0.0, 0.0, 0.0, 0.0, 25.0, 25.0, 0.0, 0.0];
        assert_eq!(falls(100.0, 0.0, &leads, 400.0), (expected.clone(), Phase::Over));
        let (down, up) = (leads.map(|lead| -lead), expected.iter().map(|fall| 0.0 - fall).collect::<Vec<_>>());
        assert_eq!(falls(-100.0, 0.0, &down, 400.0), (up, Phase::Over));
    }

    /// The lead has to have been larger, and the quick spring at its target to a 32nd of the step.
    #[test]
    fn nothing_falls_back_before_the_lead_has_passed_its_largest_at_the_target() {
        assert_eq!(falls(100.0, 0.0, &[30.0, 40.0, 45.0, 45.0], 400.0).0, [0.0; 4]);
        // More than a 64th below the largest.
        assert_eq!(falls(100.0, 0.0, &[48.0, 47.3, 47.25, 47.2], 400.0).0, [0.0, 0.0, 0.0, 25.0]);
        let mut phase = Phase::Before(volts(80.0));
        let mut fall = |missing: f64| {
            thresholds().fall(&mut phase, volts(100.0), (Signal::ZERO, volts(40.0)), volts(missing), volts(400.0))
        };
        assert_eq!((fall(3.2), fall(3.125)), (Signal::ZERO, volts(25.0)));
    }

    #[test]
    fn a_fall_back_ends_in_time_whatever_the_lead() {
        let leads = [[80.0].as_slice(), &[40.0; 8]].concat();
        let expected = vec![0.0, 25.0, 25.0, 25.0, 25.0, 25.0, 0.0, 0.0, 0.0];
        assert_eq!(falls(100.0, 0.0, &leads, 400.0), (expected, Phase::Over));
    }

    /// A return of 200 V has to be within 0 to 700 V and 300 V of slew; the springs may go the other way by a fifth of the step.
    #[test]
    fn nothing_falls_back_that_could_not_return_or_end() {
        let leads = [80.0, 40.0];
        for (step, before, driven, is_possible) in [
            (100.0, 0.0, 500.0, true),
            (100.0, 0.0, 501.0, false),
            (-100.0, 0.0, 200.0, true),
            (-100.0, 0.0, 199.0, false),
            (150.0, 0.0, 300.0, true),
            (151.0, 0.0, 300.0, false),
            (100.0, -20.0, 400.0, true),
            (100.0, -21.0, 400.0, false),
            (-100.0, 20.0, 400.0, true),
            (-100.0, 21.0, 400.0, false),
        ] {
            let along = leads.map(|lead| lead * step / 100.0);
            let (each, phase) = falls(step, before, &along, driven);
            let expected = if is_possible { Phase::Back(LONGEST_TICKS) } else { Phase::Never };
            assert_eq!((each[1] != 0.0, phase), (is_possible, expected), "{step} {before} {driven}");
        }
    }

    #[test]
    fn the_target_is_moved_by_another_part_of_the_lead_from_the_fall_back_on() {
        let (of_design, usual) = (Weight::new(0.9), Weight::new(0.8));
        for (phase, expected) in [
            (Phase::Never, usual),
            (Phase::Before(Signal::ZERO), usual),
            (Phase::Back(1), of_design),
            (Phase::Over, of_design),
        ] {
            assert_eq!(thresholds().part(phase, usual), expected, "{phase:?}");
        }
    }

    /// A voltage that settles with 500 ticks falls back for 750 ticks as planned, and returns within 150.
    #[test]
    fn a_fall_back_takes_up_to_four_planned_ones_and_its_return_a_part_of_one() {
        assert_eq!(FallBack::longest_ticks(500.0), 3000);
        assert!((FallBack::largest_jump_v(2.0, 500.0) - 300.0).abs() < 1e-9);
        let quick = StepGain { feedthrough: 0.1, in_one_tick: 0.0002, relaxation: 0.0 };
        let design = FallBack { depth: 0.25, start: 0.5, end: 0.2, part: 0.9, jump: 2.5 };
        let amplifier = Amplifier { slew_v_per_s: Some(2000.0), ..Amplifier::up_to(1000.0) };
        let thresholds = Thresholds::new(&design, &quick, &amplifier, SampleTime::from_rate(1000.0).unwrap());
        assert_eq!((thresholds.longest_ticks, thresholds.largest_jump), (3000, volts(300.0)));
        assert_eq!(thresholds.range, (volts(0.0), volts(1000.0)));
    }

    #[test]
    fn just_after_a_step_a_spring_is_behind_by_what_its_share_lacks() {
        let spring = Kernel::new((0.1, 0.95), (0.08, 1.05));
        assert_eq!(spring.behind(-1e-9), 0.0);
        assert!((spring.behind(0.0) - 0.2).abs() < 1e-12, "{}", spring.behind(0.0));
    }

    /// In the last hundredth of the times that are tried it could as well be one that no time brings into the band.
    #[test]
    fn the_design_has_no_late_fall_back_and_no_return_that_no_weight_can_hold() {
        let designed = |[time_constant, share, gain, fall_back]: [f64; 4], quick_share| {
            let margin = Margin { time_constant, share, gain, overshoot: 0.02, fall_back };
            FallBack::design(&margin, quick_share).is_some()
        };
        // The ends are 3.94 and 3.98 time constants.
        assert_eq!([0.0172, 0.01747].map(|gain| designed([0.25, 0.1, gain, 0.05], 0.1)), [true, false]);
        // The returns are 9.99 V per V of the step, 10 and 20.
        assert_eq!([0.05005, 0.05, 0.025].map(|quick| designed([0.07, 0.02, 0.0, 0.5], quick)), [true, false, false]);
    }

    /// Shares of 1/11; the numbers are those of the equations in the module's text, computed by another program.
    #[test]
    fn the_design_ends_where_the_slow_springs_are_in_the_band() {
        let designed = |[time_constant, share, gain, fall_back]: [f64; 4]| {
            let margin = Margin { time_constant, share, gain, overshoot: 0.02, fall_back };
            FallBack::design(&margin, (1.0 + share) / 11.0)
        };
        for margin in [[0.05, 0.05, 0.0, 0.25], [0.03, 0.0, 0.0, 0.25], [0.0, 0.0, 0.0, 0.25], [0.05, 0.0, 0.0, 0.0]] {
            assert_eq!(designed(margin), None, "{margin:?}");
        }
        for (margin, start, end) in [
            ([0.05, 0.0, 0.0, 0.25], 0.033460, 0.021559),
            ([0.05, 0.03, 0.0, 0.25], 0.031023, 0.017446),
            ([0.07, 0.02, 0.0, 0.1], 0.031319, 0.022519),
            ([0.07, 0.01, 0.005, 0.25], 0.026200, 0.011076),
        ] {
            let design = designed(margin).unwrap();
            let near = |value: f64, expected: f64| (value - expected).abs() < 1e-4 * expected;
            let [_, share, gain, fall_back] = margin;
            let part = (1.02 / (1.0 + gain) - 1.0) / end;
            assert!(near(design.start, start) && near(design.end, end), "{design:?}");
            assert!(near(design.part, part) && near(design.jump, 11.0 * fall_back / (1.0 + share)), "{design:?}");
        }
    }
}
