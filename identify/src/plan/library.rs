//! The schedules from which the search starts, and random changes of a schedule.

use crate::plan::candidate::{Candidate, Frame, LEVELS, MOST_SEGMENTS, Segment};

/// Pseudo-random numbers (splitmix64): the same seed gives the same plan.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// Returns a number between 0 and 1.
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a nearly normal number of unit variance.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform() - 0.5).sum()
    }

    /// Returns an index below `count`.
    pub(super) fn index(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    fn level(&mut self) -> f64 {
        (self.uniform() * LEVELS).round() / LEVELS
    }
}

fn step(weight: f64, level: f64) -> Segment {
    Segment { weight, level, ramp: false }
}

fn ramp(weight: f64, level: f64) -> Segment {
    Segment { weight, level, ramp: true }
}

/// Returns the level on the grid that is nearest to a fraction of the range.
fn near(level: f64) -> f64 {
    (level.clamp(0.0, 1.0) * LEVELS).round() / LEVELS
}

/// Returns the schedules from which the search starts: stairs, a step, reversals, loops, square waves, random levels.
pub(super) fn library(frame: &Frame, random: &mut Random) -> Vec<Candidate> {
    let zero = frame.zero();
    // The end of the range that is further from 0 V.
    let (top, other) = if zero <= 0.5 { (1.0, 0.0) } else { (0.0, 1.0) };
    let at = |part: f64| near(zero + part * (top - zero));
    let mut all = Vec::new();
    let mut add = |segments: Vec<Segment>, tail: f64| all.push(Candidate { segments, tail });
    for steps in [4u32, 9] {
        let part = |index: u32| f64::from(index) / f64::from(steps);
        let up = (1..=steps).map(|index| step(1.0, at(part(index))));
        let down = (1..steps).rev().map(|index| step(1.0, at(part(index))));
        add(up.chain(down).collect(), 1.0);
    }
    add(vec![step(6.0, top)], 4.0);
    add(vec![step(5.0, top), step(2.0, at(0.4)), step(2.0, at(0.8)), step(2.0, at(0.2))], 3.0);
    add([1.0, 0.0, 0.8, 0.2, 0.6, 0.4].map(|part| ramp(1.0, at(part))).to_vec(), 1.0);
    add([1.0, 0.0, 0.5, 0.0].map(|part| ramp(1.0, at(part))).to_vec(), 0.5);
    let square =
        (0u32..16).map(|index| step(0.8f64.powf(f64::from(index)), if index % 2 == 0 { top } else { at(0.0) }));
    add(square.collect(), 0.8);
    let after_hold = (0u32..12).map(|index| step(0.25, at(if index % 2 == 0 { 0.3 } else { 0.9 })));
    add(std::iter::once(step(4.0, top)).chain(after_hold).collect(), 2.0);
    if other != zero {
        add(vec![step(2.0, top), step(2.0, other), ramp(2.0, top), ramp(2.0, other)], 1.0);
    }
    for holds in [8, 16, 32] {
        for _ in 0..2 {
            let mut levels: Vec<Segment> =
                (0..holds).map(|_| step((0.8 * random.normal()).exp(), random.level())).collect();
            levels[holds / 4].level = top;
            all.push(Candidate { segments: levels, tail: 1.0 });
        }
    }
    all
}

/// Returns a candidate with one or two random changes.
pub(super) fn changed(candidate: &Candidate, random: &mut Random) -> Candidate {
    let mut next = candidate.clone();
    for _ in 0..=random.index(2) {
        let count = next.segments.len();
        let index = random.index(count);
        match random.index(9) {
            0 | 1 => next.segments[index].level = random.level(),
            2 => next.segments[index].level = near(next.segments[index].level + 0.1 * random.normal()),
            3 => next.segments[index].weight *= (0.7 * random.normal()).exp(),
            4 => next.segments[index].ramp ^= true,
            5 if count < MOST_SEGMENTS => {
                let part = 0.1 + 0.8 * random.uniform();
                let whole = next.segments[index].weight;
                next.segments[index].weight = part * whole;
                let split = Segment { weight: (1.0 - part) * whole, level: random.level(), ramp: false };
                next.segments.insert(index + 1, split);
            }
            6 if count > 1 => drop(next.segments.remove(index)),
            7 => next.segments.swap(index, random.index(count)),
            _ => next.tail *= (0.7 * random.normal()).exp(),
        }
    }
    next
}
