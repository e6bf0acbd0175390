//! A schedule as few numbers, and its commands on the grid of the readings.
//!
//! A candidate is at rest at first, goes through its segments and ends at 0 V. Levels are fractions of the allowed range on a grid of
//! [`LEVELS`] steps; durations are relative. Every candidate lies within range and slew rate, whatever its numbers.

/// Number of steps of the grid of levels.
pub(super) const LEVELS: f64 = 50.0;
/// Largest number of segments.
pub(super) const MOST_SEGMENTS: usize = 40;
/// Part of the time at rest before the first segment.
const REST: f64 = 1.0 / 50.0;
/// Fewest rows at rest.
const FEWEST_ROWS_AT_REST: usize = 4;
/// Largest number of steps by which a ramp is commanded.
const MOST_STEPS_OF_A_RAMP: usize = 200;

/// What all candidates have in common: the allowed range, slew rate and time, normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    /// Number of readings.
    pub(super) rows: usize,
    /// Time between two readings, in normalised s.
    pub(super) sample_s: f64,
    /// First time constant of the nominal spring, in rows, at least 1.
    pub(super) tau_rows: f64,
    /// Lowest voltage, at most 0, in normalised V.
    pub(super) low_v: f64,
    /// Highest voltage, at least 0, in normalised V.
    pub(super) high_v: f64,
    /// Largest change of the voltage from one row to the next, in normalised V.
    pub(super) slew_v_per_row: f64,
}

impl Frame {
    /// Returns the fraction of the range at which the voltage is 0.
    pub(super) fn zero(&self) -> f64 {
        -self.low_v / (self.high_v - self.low_v)
    }

    /// Returns the number of rows after which the voltage is 0, from anywhere in the range.
    pub(super) fn rows_to_zero(&self) -> usize {
        (self.low_v.abs().max(self.high_v) / self.slew_v_per_row).ceil() as usize + 1
    }
}

/// A part of a candidate: the way to a level, and a hold there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    /// Duration, relative to those of the other segments; positive.
    pub(super) weight: f64,
    /// Level at the end, as a fraction of the range.
    pub(super) level: f64,
    /// True if the voltage goes there on a ramp that takes the whole segment, false if it steps there and stays.
    pub(super) ramp: bool,
}

/// A schedule that the search varies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Segments of the schedule, without the rest before and the return to 0 V after them.
    pub(super) segments: Vec<Segment>,
    /// Duration of the hold at 0 V at the end, as a weight like those of the segments.
    pub(super) tail: f64,
}

/// The commands of a candidate.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Commands {
    /// Row from which each voltage is held, in normalised V; the first is 0 V in row 0.
    pub(super) held: Vec<(usize, f64)>,
    /// First row, row after the last, and level at the end in normalised V, of the rest, of each segment and of the return to 0 V.
    pub(super) parts: Vec<(usize, usize, f64)>,
}

impl Candidate {
    /// Returns the commands within a frame.
    pub(super) fn commands(&self, frame: &Frame) -> Commands {
        let rest = FEWEST_ROWS_AT_REST.max((REST * frame.rows as f64).ceil() as usize);
        let last = frame.rows - frame.rows_to_zero().max(FEWEST_ROWS_AT_REST);
        let sum: f64 = self.segments.iter().map(|segment| segment.weight).sum::<f64>() + self.tail;
        let mut commands = Commands { held: vec![(0, 0.0)], parts: vec![(0, rest, 0.0)] };
        let (mut done, mut from) = (0.0, rest);
        for segment in &self.segments {
            done += segment.weight;
            let to = (rest + (done / sum * (frame.rows - rest) as f64).round() as usize).min(last);
            if to > from {
                let level = frame.low_v + segment.level * (frame.high_v - frame.low_v);
                commands.go(from, to, level, segment.ramp, frame.slew_v_per_row);
                from = to;
            }
        }
        commands.go(from, frame.rows, 0.0, false, frame.slew_v_per_row);
        commands
    }
}

impl Commands {
    /// Goes to a level from row `from` on, and stays there until row `to`; at most `slew` volts from row to row.
    fn go(&mut self, from: usize, to: usize, level: f64, ramp: bool, slew: f64) {
        let before = self.held.last().map_or(0.0, |last| last.1);
        let rows = if ramp { to - from } else { 1 };
        let rows = rows.max(((level - before).abs() / slew).ceil() as usize);
        let every = if slew.is_finite() { 1 } else { rows.div_ceil(MOST_STEPS_OF_A_RAMP) };
        for step in (every..=rows).step_by(every).chain((rows % every > 0).then_some(rows)) {
            let row = from + step - every.min(step);
            if row >= to {
                break;
            }
            let voltage = if step == rows { level } else { before + (level - before) * step as f64 / rows as f64 };
            if self.held.last().is_some_and(|last| last.1 != voltage) {
                self.held.push((row, voltage));
            }
        }
        self.parts.push((from, to, self.held.last().map_or(0.0, |last| last.1)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame {
        rows: 1000,
        sample_s: 0.1,
        tau_rows: 55.0,
        low_v: -100.0,
        high_v: 400.0,
        slew_v_per_row: f64::INFINITY,
    };

    fn candidate() -> Candidate {
        let to = |level: f64, ramp| Segment { weight: 1.0, level, ramp };
        Candidate { segments: vec![to(1.0, false), to(0.0, true), to(0.5, false)], tail: 1.0 }
    }

    #[test]
    fn commands_start_and_end_at_0_v_within_the_range() {
        let commands = candidate().commands(&FRAME);
        assert_eq!((commands.held[0], commands.held.last().unwrap().1), ((0, 0.0), 0.0));
        assert!(commands.held.iter().all(|&(row, volts)| row < 1000 && (-100.0..=400.0).contains(&volts)));
        assert!(commands.held.windows(2).all(|pair| pair[0].0 < pair[1].0), "{:?}", commands.held);
        let levels: Vec<f64> = commands.parts.iter().map(|part| part.2).collect();
        assert_eq!(levels, [0.0, 400.0, -100.0, 150.0, 0.0]);
    }

    #[test]
    fn no_row_changes_by_more_than_the_slew_rate_allows() {
        let frame = Frame { slew_v_per_row: 3.0, ..FRAME };
        let commands = candidate().commands(&frame);
        for pair in commands.held.windows(2) {
            assert!((pair[1].1 - pair[0].1).abs() <= 3.0 + 1e-9 && pair[1].0 > pair[0].0, "{pair:?}");
        }
        assert_eq!(commands.held.last().unwrap().1, 0.0);
    }
}
