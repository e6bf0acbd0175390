//! The commanded voltage over time, piecewise linear with jumps.

use anyhow::Result;

use crate::bad_input;
use crate::bad_input::number;
use crate::record::{Record, Row};

/// A linear piece of a schedule, from `start_s` to before `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Start, in s.
    pub start_s: f64,
    /// End, in s, after `start_s`.
    pub end_s: f64,
    /// Voltage at the start, in V.
    pub from_v: f64,
    /// Voltage at the end, in V.
    pub to_v: f64,
}

/// A voltage over time: adjoining pieces in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    pieces: Vec<Piece>,
    /// Voltage at and after the end of the last piece, in V.
    end_v: f64,
}

/// A change from one plateau to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Start of the change, in s.
    pub start_s: f64,
    /// Start of the next change or end of the schedule, in s.
    pub end_s: f64,
    /// Voltage of the plateau before, in V.
    pub from_v: f64,
    /// Voltage of the plateau after, in V.
    pub to_v: f64,
}

/// Interpolation of the voltage between two rows of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// The earlier row's voltage is held.
    #[default]
    Hold,
    /// Linear interpolation.
    Linear,
}

/// A shorter plateau, in s, counts as part of the change that it interrupts.
const SHORTEST_PLATEAU_S: f64 = 1.0;

/// Voltages that differ by less than this, in V, count as equal when a record is compared with a schedule.
const ROUNDING_V: f64 = 1.0;

/// Steps of the report's stair: 100 V every 10 s, from 20 s on.
const STAIR_STARTS_S: [f64; 5] = [20.0, 30.0, 40.0, 50.0, 60.0];
/// Size of a step of the report's stair, in V.
pub const STAIR_STEP_V: f64 = 100.0;
const STAIR_END_S: f64 = 70.0;

impl Schedule {
    /// The stair of the report's Appendix 8.1.2, whose steps are 0.1 s ramps because it is sampled every 0.1 s and
    /// interpolated.
    pub fn stair() -> Self {
        Self::stair_of(STAIR_STEP_V)
    }

    /// The stair of [`Schedule::stair`] with ideal steps.
    pub fn ideal_stair() -> Self {
        Self::ideal_stair_of(STAIR_STEP_V)
    }

    /// The stair of [`Schedule::stair`] with steps of another size, in V.
    pub fn stair_of(step_v: f64) -> Self {
        Self::stair_with_ramps(0.1, step_v)
    }

    /// The stair of [`Schedule::ideal_stair`] with steps of another size, in V.
    pub fn ideal_stair_of(step_v: f64) -> Self {
        Self::stair_with_ramps(0.0, step_v)
    }

    fn stair_with_ramps(ramp_s: f64, step_v: f64) -> Self {
        let mut points = vec![(0.0, 0.0)];
        for (start, index) in STAIR_STARTS_S.into_iter().zip(0u8..) {
            let level = step_v * f64::from(index);
            points.extend([(start, level), (start + ramp_s, level + step_v)]);
        }
        points.push((STAIR_END_S, step_v * STAIR_STARTS_S.len() as f64));
        Self::new(points, Between::Linear)
    }

    /// The commanded voltage of a record.
    pub fn from_record(record: &Record, between: Between) -> Self {
        Self::new(record.rows.iter().map(|row| (row.time_s, row.voltage_v)).collect(), between)
    }

    /// The voltage through points of time (s) and voltage (V), at least two; two points at the same time are a jump.
    pub fn new(points: Vec<(f64, f64)>, between: Between) -> Self {
        let end_v = points.last().map_or(0.0, |last| last.1);
        Self { pieces: pieces(points, between), end_v }
    }

    /// Start, in s.
    pub fn start_s(&self) -> f64 {
        self.pieces.first().map_or(0.0, |piece| piece.start_s)
    }

    /// End, in s.
    pub fn end_s(&self) -> f64 {
        self.pieces.last().map_or(0.0, |piece| piece.end_s)
    }

    /// Voltages, in V, at `rate_hz` ticks per second, from the start to the last tick within the schedule.
    pub fn at_ticks(&self, rate_hz: f64) -> Vec<f64> {
        let mut reader = self.reader();
        let ticks = 0..=self.last_tick(rate_hz) as usize;
        ticks.map(|tick| reader.at(self.start_s() + tick as f64 / rate_hz)).collect()
    }

    /// Index of the last tick within the schedule, from 0, as a whole number of any size.
    pub fn last_tick(&self, rate_hz: f64) -> f64 {
        ((self.end_s() - self.start_s()) * rate_hz + 1e-6).floor()
    }

    /// The pieces, in order.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Changes between plateaus of at least one second.
    pub fn changes(&self) -> Vec<Change> {
        let plateaus: Vec<Piece> = merged_plateaus(&self.pieces)
            .into_iter()
            .filter(|plateau| plateau.end_s - plateau.start_s >= SHORTEST_PLATEAU_S)
            .collect();
        let mut changes: Vec<Change> = plateaus
            .windows(2)
            .filter(|pair| pair[0].to_v != pair[1].to_v)
            .map(|pair| Change {
                start_s: pair[0].end_s,
                end_s: self.end_s(),
                from_v: pair[0].to_v,
                to_v: pair[1].to_v,
            })
            .collect();
        for index in 1..changes.len() {
            changes[index - 1].end_s = changes[index].start_s;
        }
        changes
    }

    /// Checks that all voltages lie within an amplifier's range; `name` is what messages call the schedule.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with the first voltage outside `lowest_v` to `highest_v`.
    pub fn check_range(&self, name: &str, lowest_v: f64, highest_v: f64) -> Result<()> {
        let ends = self.pieces.iter().flat_map(|piece| [(piece.start_s, piece.from_v), (piece.end_s, piece.to_v)]);
        for (time, volts) in ends.chain([(self.end_s(), self.end_v)]) {
            if !(lowest_v..=highest_v).contains(&volts) {
                bad_input!(
                    "{name} commands {volts} V at {} s; expected {lowest_v} to {highest_v} V, the amplifier's range",
                    number(time)
                );
            }
        }
        Ok(())
    }

    /// Checks that the record's voltages are those of this schedule: each row must lie between the lowest and the highest
    /// scheduled voltage within `near_s` seconds of it, give or take 1 V. `name` is what messages call the schedule.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with file, line and column of the first row that differs.
    pub fn check_commanded(&self, name: &str, record: &Record, near_s: f64) -> Result<()> {
        for &Row { line, time_s, voltage_v, .. } in &record.rows {
            let [before, after] = [-near_s, near_s].map(|near| self.reader().at(time_s + near));
            if !(before.min(after) - ROUNDING_V..=before.max(after) + ROUNDING_V).contains(&voltage_v) {
                bad_input!(
                    "{}, line {line}, column voltage_v: {voltage_v} V at {} s; expected {after} V as in {name}",
                    record.name,
                    number(time_s)
                );
            }
        }
        Ok(())
    }

    /// Reads the voltage at increasing times, each in constant time.
    pub fn reader(&self) -> Reader<'_> {
        Reader { schedule: self, index: 0 }
    }
}

/// Reads a schedule at increasing times.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    schedule: &'a Schedule,
    index: usize,
}

impl Reader<'_> {
    /// Voltage just after `time_s`, in V; times must not decrease from call to call.
    pub fn at(&mut self, time_s: f64) -> f64 {
        let pieces = &self.schedule.pieces;
        while self.index + 1 < pieces.len() && pieces[self.index].end_s <= time_s {
            self.index += 1;
        }
        if time_s >= self.schedule.end_s() { self.schedule.end_v } else { self.piece().at(time_s) }
    }

    /// Splits the time from `from_s` to `until_s` into linear stretches; `from_s` must not be before the last time
    /// read.
    pub fn stretches(mut self, from_s: f64, until_s: f64) -> impl Iterator<Item = Stretch> {
        let mut time = from_s;
        std::iter::from_fn(move || {
            let start = time;
            (start < until_s).then(|| {
                let from_v = self.at(start);
                let piece = self.piece();
                let over = piece.end_s <= start;
                time = if over { until_s } else { piece.end_s.min(until_s) };
                Stretch { from_v, slope: if over { 0.0 } else { piece.slope() }, duration_s: time - start }
            })
        })
    }

    fn piece(&self) -> Piece {
        self.schedule.pieces[self.index]
    }
}

/// A part of a linear piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Voltage at its start, in V.
    pub from_v: f64,
    /// Slope, in V/s.
    pub slope: f64,
    /// Duration, in s.
    pub duration_s: f64,
}

impl Stretch {
    /// Voltage at its end, in V.
    pub fn to_v(&self) -> f64 {
        self.from_v + self.slope * self.duration_s
    }
}

impl Piece {
    /// Voltage at a time within the piece, in V.
    pub fn at(&self, time_s: f64) -> f64 {
        let part = ((time_s - self.start_s) / (self.end_s - self.start_s)).clamp(0.0, 1.0);
        self.from_v + part * (self.to_v - self.from_v)
    }

    /// Slope, in V/s.
    pub fn slope(&self) -> f64 {
        (self.to_v - self.from_v) / (self.end_s - self.start_s)
    }
}

/// The pieces between points.
fn pieces(points: impl IntoIterator<Item = (f64, f64)>, between: Between) -> Vec<Piece> {
    let mut points = points.into_iter();
    let Some(mut last) = points.next() else { return Vec::new() };
    let mut pieces = Vec::new();
    for (time, volts) in points {
        if time > last.0 {
            let to_v = if between == Between::Linear { volts } else { last.1 };
            pieces.push(Piece { start_s: last.0, end_s: time, from_v: last.1, to_v });
        }
        last = (time, volts);
    }
    pieces
}

/// Constant pieces, adjoining ones of equal voltage merged.
fn merged_plateaus(pieces: &[Piece]) -> Vec<Piece> {
    let mut plateaus: Vec<Piece> = Vec::new();
    for piece in pieces.iter().filter(|piece| piece.from_v == piece.to_v) {
        match plateaus.last_mut() {
            Some(last) if last.end_s == piece.start_s && last.to_v == piece.from_v => last.end_s = piece.end_s,
            _ => plateaus.push(*piece),
        }
    }
    plateaus
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::MEASURED;

    #[test]
    fn the_stair_is_the_reports() {
        let stair = Schedule::stair();
        let mut reader = stair.reader();
        for (time, volts) in [(0.0, 0.0), (20.0, 0.0), (20.05, 50.0), (20.1, 100.0), (45.0, 300.0), (70.0, 500.0)] {
            assert!((reader.at(time) - volts).abs() < 1e-9, "{time}");
        }
        let changes = stair.changes();
        assert_eq!(changes.len(), 5);
        assert_eq!(changes[4], Change { start_s: 60.0, end_s: 70.0, from_v: 400.0, to_v: 500.0 });
        assert_eq!(Schedule::ideal_stair().changes(), changes);
        assert_eq!(Schedule::ideal_stair().reader().at(20.0), 100.0);
    }

    #[test]
    fn a_file_is_held_or_interpolated_between_its_rows() {
        let text = "time_s,voltage_v\n0,0\n2,100\n4,100\n6,50\n9,50\n";
        let record = Record::parse("f", text, MEASURED).unwrap();
        let held = Schedule::from_record(&record, Between::Hold);
        assert_eq!([1.9, 2.0, 5.9, 6.0].map(|time| held.reader().at(time)), [0.0, 100.0, 100.0, 50.0]);
        let high_end = Record::parse("f", "time_s,voltage_v\n0,0\n2,900\n", MEASURED).unwrap();
        let high_end = Schedule::from_record(&high_end, Between::Hold);
        assert!(high_end.check_range("f", 0.0, 700.0).is_err(), "the last row counts too");
        assert_eq!([1.9, 2.0].map(|time| high_end.reader().at(time)), [0.0, 900.0]);
        assert_eq!(held.changes().len(), 2);
        let straight = Schedule::from_record(&record, Between::Linear);
        assert_eq!([1.0, 3.0, 5.0].map(|time| straight.reader().at(time)), [50.0, 100.0, 75.0]);
        let change = Change { start_s: 4.0, end_s: 9.0, from_v: 100.0, to_v: 50.0 };
        assert_eq!(straight.changes(), [change], "the first ramp does not start on a plateau");
    }

    #[test]
    fn a_record_of_another_schedule_is_rejected_at_its_first_different_row() {
        let check = |text: &str| {
            let record = Record::parse("r", text, MEASURED).unwrap();
            Schedule::stair().check_commanded("the stair", &record, 0.1).map_err(|error| error.to_string())
        };
        // On the ramp and at its ends, either voltage is accepted.
        assert_eq!(check("time_s,voltage_v\n0,0\n20,0\n20.05,100\n20.1,100\n90,500\n"), Ok(()));
        let expected = "r, line 3, column voltage_v: 0 V at 25 s; expected 100 V as in the stair";
        assert_eq!(check("time_s,voltage_v\n0,0\n25,0\n"), Err(expected.to_owned()));
    }

    #[test]
    fn a_schedule_beyond_the_amplifier_is_rejected_with_time_and_range() {
        let error = Schedule::stair().check_range("the stair", 0.0, 400.0).unwrap_err().to_string();
        assert_eq!(error, "the stair commands 500 V at 60.1 s; expected 0 to 400 V, the amplifier's range");
    }
}
