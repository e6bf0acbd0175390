//! One record as linear models take it: readings at their times, and the voltage as straight pieces.

use simulation::record::Record;
use simulation::schedule::Schedule;

use crate::record::clock::Clock;
use crate::record::decay::starts_at_rest;
use crate::record::folds::folds;
use crate::record::input::Input;
use crate::stats::median::median;

/// Times closer than this, in spacings of the rows, count as equal.
pub(super) const SAME: f64 = 1e-9;

/// Part of a length that is to the rest as that is to the length: multiples of it fall evenly on all parts of a unit.
const GOLDEN_SECTION: f64 = 0.618_033_988_749_894_8;

/// Number of straight pieces that stand for the square of a ramp between two rows.
const CHORDS: usize = 8;

/// The voltage from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Time at which the piece starts, after the first row.
    pub(super) start: f64,
    /// Voltage at the start.
    pub(super) from: f64,
    /// Change of the voltage per unit of time.
    pub(super) slope: f64,
}

/// A record: readings with their times, and the voltage.
#[derive(Clone, Debug)]
pub struct Series {
    /// Time at which the free responses start, after the record's first row.
    pub start: f64,
    /// Time of each reading after the record's first row, in the record's unit, increasing.
    pub time: Vec<f64>,
    /// The readings, in their unit.
    pub reading: Vec<f64>,
    /// The fold in which each reading is held out if the record is the only one.
    pub fold: Vec<u8>,
    /// Interval of the times if they are multiples of one, else the median time between rows.
    pub spacing: f64,
    /// True if the voltage is held between rows.
    pub held: bool,
    /// True if all times are multiples of the spacing.
    pub even: bool,
    pub(super) at_rest: bool,
    /// Times, after the record's first row, from which on all readings are shifted by a constant that is to be fitted.
    pub(super) shifts: Vec<f64>,
    pieces: Vec<Piece>,
}

impl Series {
    /// Prepares a record. Rows without a reading only tell the voltage. Times that are multiples of one interval but for their
    /// rounding are taken as such.
    pub fn new(record: &Record, input: Input) -> Self {
        let first = record.rows.first().map_or(0.0, |row| row.time_s);
        let mut times: Vec<f64> = record.rows.iter().map(|row| row.time_s - first).collect();
        let typical = |times: &[f64]| {
            let mut gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
            median(&mut gaps).unwrap_or(1.0)
        };
        let clock = Clock::of(&times);
        let spacing = clock.as_ref().map_or_else(|| typical(&times), |clock| clock.interval);
        if let Some(clock) = &clock {
            times.iter_mut().zip(&clock.ticks).for_each(|(time, tick)| *time = tick * clock.interval);
        }
        let voltage: Vec<f64> = record.rows.iter().map(|row| row.voltage_v).collect();
        let pieces = match input {
            Input::Hold => held(&times, &voltage),
            Input::Linear => straight(&times, &voltage),
            Input::Stair => of_schedule(&Schedule::stair(), first),
        };
        let rows = || record.rows.iter().zip(&times).filter_map(|(row, time)| Some((row, *time, row.measured?)));
        let commanded: Vec<f64> = rows().map(|(row, ..)| row.voltage_v).collect();
        let time: Vec<f64> = rows().map(|(_, time, _)| time).collect();
        let reading: Vec<f64> = rows().map(|(.., reading)| reading).collect();
        Self {
            at_rest: starts_at_rest(&time, &commanded, &reading),
            start: time.first().copied().unwrap_or(0.0),
            time,
            reading,
            fold: folds(&commanded),
            spacing,
            held: input == Input::Hold,
            even: clock.is_some(),
            shifts: Vec::new(),
            pieces,
        }
    }

    /// The series of a sensor whose zero is shifted from these times on, after the record's first row.
    pub fn shifted(self, shifts: Vec<f64>) -> Self {
        Self { shifts, ..self }
    }

    /// The series with a free response.
    pub fn started(self) -> Self {
        Self { at_rest: false, ..self }
    }

    /// The series with the first of its readings and one of each further `every`, and the voltage of all rows. The places in which these
    /// stand change from one to the next by the golden section: at equal distances, readings would have the same place after every turn
    /// of a voltage that turns at a multiple of them, and tell no delay from a shorter one.
    pub fn thinned(&self, every: usize) -> Self {
        let place = |block: usize| (every as f64 * (block as f64 * GOLDEN_SECTION).fract()) as usize;
        self.only(|row| row % every == place(row / every))
    }

    /// The series with the readings of some rows and the voltage of all; its first reading stays the start.
    pub(super) fn only(&self, mut keeps: impl FnMut(usize) -> bool) -> Self {
        let mut part = self.clone();
        let kept: Vec<bool> = (0..self.rows()).map(&mut keeps).collect();
        let mut of = kept.iter();
        part.time.retain(|_| *of.next().expect("a row"));
        let mut of = kept.iter();
        part.reading.retain(|_| *of.next().expect("a row"));
        let mut of = kept.iter();
        part.fold.retain(|_| *of.next().expect("a row"));
        part
    }

    /// The part of the series in which `pieces` successive pieces of the voltage change it most; the whole series if it has no more.
    pub fn liveliest(&self, pieces: usize) -> Self {
        if self.pieces.len() <= pieces {
            return self.clone();
        }
        let changes = self.pieces.windows(2).map(|pair| (pair[1].from - pair[0].from).powi(2));
        let total: Vec<f64> = std::iter::once(0.0)
            .chain(changes.scan(0.0, |sum, change| {
                *sum += change;
                Some(*sum)
            }))
            .collect();
        let change = |first: &usize| total[first + pieces - 1] - total[*first];
        let most = (0..=total.len() - pieces).max_by(|a, b| change(a).total_cmp(&change(b))).unwrap_or(0);
        let (from, to) = (self.pieces[most].start, self.pieces[most + pieces - 1].start);
        let mut part = self.only(|row| (from..=to).contains(&self.time[row]));
        part.start = from.max(self.start);
        part.at_rest &= part.start == self.start;
        part.pieces = self.pieces[most..most + pieces].to_vec();
        part
    }

    /// True if the spring is at rest when the series starts: it has no free response.
    pub fn is_at_rest(&self) -> bool {
        self.at_rest
    }

    /// The series under the magnitude of its voltage.
    pub fn rectified(&self) -> Self {
        let mut rectified = self.clone();
        rectified.pieces = Vec::with_capacity(self.pieces.len());
        for (index, piece) in self.pieces.iter().enumerate() {
            let end = self.pieces.get(index + 1).map_or(f64::INFINITY, |next| next.start);
            let sign = match piece.from {
                0.0 => piece.slope.signum(),
                from => from.signum(),
            };
            let of = Piece { start: piece.start, from: piece.from.abs(), slope: sign * piece.slope };
            // A step to the same voltage of the other sign changes nothing.
            if rectified
                .pieces
                .last()
                .is_none_or(|last| (last.from, last.slope) != (of.from, of.slope) || of.slope != 0.0)
            {
                rectified.pieces.push(of);
            }
            let zero = piece.start - piece.from / piece.slope;
            if piece.slope != 0.0 && piece.start < zero && zero < end {
                rectified.pieces.push(Piece { start: zero, from: 0.0, slope: piece.slope.abs() });
            }
        }
        rectified
    }

    /// The series under the square of its voltage, divided by `full_scale` so that it is a voltage again. The square of a ramp is
    /// cut into straight pieces.
    pub fn squared(&self, full_scale: f64) -> Self {
        let square = |voltage: f64| voltage * voltage / full_scale;
        let of_piece = |(index, &Piece { start, from, slope }): (usize, &Piece)| {
            let length = self.pieces.get(index + 1).map_or(0.0, |next| next.start - start);
            let parts = if slope == 0.0 || length == 0.0 { 1 } else { CHORDS };
            let step = length / parts as f64;
            let chord = move |part: usize| {
                let [before, after] = [part, part + 1].map(|part| square(from + slope * step * part as f64));
                let slope = if step > 0.0 { (after - before) / step } else { 2.0 * from * slope / full_scale };
                Piece { start: start + step * part as f64, from: before, slope }
            };
            (0..parts).map(chord).collect::<Vec<Piece>>()
        };
        Self { pieces: self.pieces.iter().enumerate().flat_map(of_piece).collect(), ..self.clone() }
    }

    /// True if the voltage has both signs.
    pub fn has_both_signs(&self) -> bool {
        self.pieces.iter().any(|piece| piece.from < 0.0) && self.pieces.iter().any(|piece| piece.from > 0.0)
    }

    /// Largest magnitude of the voltage.
    pub fn full_scale(&self) -> f64 {
        self.pieces.iter().fold(0.0, |most: f64, piece| most.max(piece.from.abs()))
    }

    /// Time from the first to the last reading.
    pub fn duration(&self) -> f64 {
        self.time.last().unwrap_or(&0.0) - self.time.first().unwrap_or(&0.0)
    }

    /// Number of readings.
    pub fn rows(&self) -> usize {
        self.reading.len()
    }

    /// The delays with which every reading keeps its place between the starts of the pieces: those above the first, up to the second.
    pub(super) fn place_of_delay(&self, delay: f64) -> (f64, f64) {
        let (mut above, mut up_to, mut next) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for start in self.pieces.iter().skip(1).map(|piece| piece.start) {
            // A reading is taken just after a step that coincides with it.
            while self.time.get(next).is_some_and(|time| *time < start + delay - SAME * self.spacing) {
                next += 1;
            }
            if next > 0 {
                above = above.max(self.time[next - 1] - start);
            }
            if let Some(time) = self.time.get(next) {
                up_to = up_to.min(time - start);
            }
        }
        (above, up_to)
    }

    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }
}

/// A voltage that is held between rows.
fn held(times: &[f64], voltage: &[f64]) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for (&start, &from) in times.iter().zip(voltage) {
        if pieces.last().is_none_or(|last| last.from != from) {
            pieces.push(Piece { start, from, slope: 0.0 });
        }
    }
    pieces
}

/// A voltage that is linear between rows, and constant after the last.
fn straight(times: &[f64], voltage: &[f64]) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for row in 0..times.len() {
        let (start, from) = (times[row], voltage[row]);
        let slope = match (times.get(row + 1), voltage.get(row + 1)) {
            (Some(end), Some(to)) => (to - from) / (end - start),
            _ => 0.0,
        };
        let goes_on = |last: &Piece| last.slope == 0.0 && slope == 0.0 && last.from == from;
        if !pieces.last().is_some_and(goes_on) {
            pieces.push(Piece { start, from, slope });
        }
    }
    pieces
}

/// The voltage of a schedule after the time `first`.
fn of_schedule(schedule: &Schedule, first: f64) -> Vec<Piece> {
    let slope = |piece: &simulation::schedule::Piece| {
        let length = piece.end_s - piece.start_s;
        if length > 0.0 && length.is_finite() { (piece.to_v - piece.from_v) / length } else { 0.0 }
    };
    let of = |piece: &simulation::schedule::Piece| Piece {
        start: piece.start_s - first,
        from: piece.from_v,
        slope: slope(piece),
    };
    schedule.pieces().iter().map(of).collect()
}
