//! The delayed voltage from reading to reading, in steps over which it is linear; sections of any poles pass over the same steps.

use std::collections::HashMap;

use crate::linear::section::{Each, Following, Section, States, TOGETHER, Transition};
use crate::linear::series::{Piece, SAME, Series};

/// A step over which the voltage is linear.
struct Step {
    /// Index of its length.
    length: u32,
    /// True if a reading is taken at its end.
    read: bool,
    /// Voltage at its start.
    voltage: f64,
    /// Change of the voltage per unit of time.
    slope: f64,
}

/// The delayed voltage of a series.
pub(super) struct Path {
    /// Voltage at each reading; just after a step that coincides with it.
    pub(super) voltage: Vec<f64>,
    /// Voltage at the start.
    before: f64,
    /// True if there is no free response.
    at_rest: bool,
    steps: Vec<Step>,
    lengths: Vec<f64>,
}

/// Response of one section at each reading.
pub(super) struct Response {
    /// `w` and `v` under the voltage, from rest at the voltage of the first reading; a lag has no `v`.
    pub(super) forced: [Vec<f64>; 2],
    /// `w` without a voltage, and `-v`, from `w = 1` and `v = 0`: the two span all free responses. Empty if the spring was at rest.
    pub(super) free: [Vec<f64>; 2],
}

/// Builds the steps of a path.
struct Builder {
    path: Path,
    known: HashMap<i64, u32>,
    last: (i64, u32),
    same: f64,
    now: f64,
    /// Voltage at the time `since`, and its slope from then on.
    from: f64,
    since: f64,
    slope: f64,
}

impl Builder {
    fn voltage(&self) -> f64 {
        self.from + self.slope * (self.now - self.since)
    }

    /// Adds the step to a time.
    fn advance(&mut self, time: f64, read: bool) {
        let length = time - self.now;
        let key = (length / self.same).round() as i64;
        // Most steps are as long as the step before.
        if self.last.0 != key || self.path.lengths.is_empty() {
            let next = self.path.lengths.len() as u32;
            let index = *self.known.entry(key).or_insert(next);
            if index == next {
                self.path.lengths.push(length);
            }
            self.last = (key, index);
        }
        let step = Step { length: self.last.1, read, voltage: self.voltage(), slope: self.slope };
        self.path.steps.push(step);
        self.now = time;
    }
}

impl Path {
    /// The voltage of a series, delayed. Before the series the voltage is taken to have been that of its start.
    pub(super) fn new(series: &Series, delay: f64) -> Self {
        let rows = series.rows();
        let path = Self {
            voltage: Vec::with_capacity(rows),
            before: 0.0,
            at_rest: series.at_rest,
            steps: Vec::with_capacity(rows),
            lengths: Vec::new(),
        };
        let (same, now) = (SAME * series.spacing, series.start);
        let from = series.pieces().first().map_or(0.0, |first| first.from);
        let mut builder =
            Builder { path, known: HashMap::new(), last: (0, 0), same, now, from, since: now, slope: 0.0 };
        let mut pieces = series.pieces().iter().map(|piece| Piece { start: piece.start + delay, ..*piece }).peekable();
        let set = |builder: &mut Builder, piece: Piece| {
            (builder.from, builder.since, builder.slope) = (piece.from, piece.start, piece.slope);
        };
        while let Some(piece) = pieces.next_if(|piece| piece.start <= now + same) {
            set(&mut builder, piece);
        }
        builder.path.before = builder.voltage();
        for &time in &series.time {
            while let Some(piece) = pieces.next_if(|piece| piece.start < time - same) {
                builder.advance(piece.start, false);
                set(&mut builder, piece);
            }
            builder.advance(time, true);
            // A reading is taken just after a step that coincides with it.
            while let Some(piece) = pieces.next_if(|piece| piece.start <= time + same) {
                set(&mut builder, piece);
            }
            builder.path.voltage.push(builder.voltage());
        }
        builder.path
    }

    /// The responses of several sections at each reading.
    pub(super) fn responses(&self, sections: &[Section]) -> Vec<Response> {
        // In a last group that is not full its last section is repeated.
        let groups = sections.chunks(TOGETHER).map(|of| std::array::from_fn(|lane| of[lane.min(of.len() - 1)]));
        groups.flat_map(|group| self.of_group(group)).take(sections.len()).collect()
    }

    fn of_group(&self, sections: [Section; TOGETHER]) -> [Response; TOGETHER] {
        let over: Vec<Transition> = self.lengths.iter().map(|&length| Transition::of(&sections, length)).collect();
        let following = Following::of(&sections);
        let forced = self.states(self.before, |states, Step { length, voltage, slope, .. }| {
            following.step(&over[*length as usize], states, *voltage, *slope)
        });
        let free = match self.at_rest {
            true => [Vec::new(), Vec::new()],
            false => self.states(1.0, |states, step| over[step.length as usize].free(states)),
        };
        std::array::from_fn(|place| {
            let has_v = sections[place].order() == 2;
            let of = |[ws, vs]: &[Vec<Each>; 2]| {
                let v = if has_v { vs.iter().map(|v| v[place]).collect() } else { Vec::new() };
                [ws.iter().map(|w| w[place]).collect(), v]
            };
            Response { forced: of(&forced), free: of(&free) }
        })
    }

    /// The states of the sections at each reading, from `w` at the start and by a function of the states before a step.
    fn states(&self, start: f64, next: impl Fn(States, &Step) -> States) -> [Vec<Each>; 2] {
        let rows = self.voltage.len();
        let [mut ws, mut vs] = [Vec::with_capacity(rows), Vec::with_capacity(rows)];
        let mut states = [[start; TOGETHER], [0.0; TOGETHER]];
        for step in &self.steps {
            states = next(states, step);
            if step.read {
                ws.push(states[0]);
                vs.push(states[1]);
            }
        }
        [ws, vs]
    }
}
