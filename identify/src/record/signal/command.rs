//! Division of the commanded voltage into pieces.
//!
//! The output of a lag over a piece is taken as straight by the next lag. So pieces are short compared with the nominal time
//! constant just after a change of the voltage, and later short compared with the time since that change, when only slow
//! transients are left:
//!
//! ```text
//! longest piece = coarseness max(time constant / 55, (time since the last change) / 20),     coarseness = 1, 2, 4, ...
//! ```
//!
//! The coarseness is the smallest that leads to the allowed number of pieces, which grows with the number of rows and not with
//! the time: where the voltage changes at every row, every row gets one or two pieces, and a pause a few hundred.

use crate::record::scales::REFERENCE_TIME_CONSTANT_S;
use crate::record::signal::piecewise::{Piece, Signal};
use simulation::schedule::{Schedule, Stretch};

/// Maximum length of a piece just after a change, in s, for records whose time is scaled to the paper's time constant: a
/// transient with a fifth of that time constant departs from its chord by at most 1/900 of its amplitude.
const SHORTEST_PIECE_S: f64 = REFERENCE_TIME_CONSTANT_S / 55.0;
/// Maximum length of a later piece relative to the time since the last change: a transient of any time constant departs
/// from its chord by at most 1/6000 of its amplitude.
const GROWTH: f64 = 0.05;
/// A row that is longer than this number of its first piece's lengths is divided into pieces that grow; a shorter one into
/// equal pieces, whose exponentials are computed once.
const MOST_EQUAL_PIECES: f64 = 20.0;
/// Changes below this fraction of the full scale do not count.
const STILL_FRACTION: f64 = 1e-4;
/// Number of pieces for each row that is allowed.
const PIECES_PER_ROW: f64 = 2.0;
/// Number of pieces for each row that is allowed where the voltage changes at most rows: rows of a thirtieth of the time
/// constant are then not divided.
const PIECES_PER_CHANGE: f64 = 1.5;
/// Largest factor by which the error of a chord grows with the coarseness.
const MOST_BLUR: f64 = 16.0;
/// Number of pieces that is allowed however few rows there are.
const FEWEST_PIECES: usize = 3_000;

impl From<&Stretch> for Piece {
    fn from(stretch: &Stretch) -> Self {
        Self { duration_s: stretch.duration_s, from: stretch.from_v, to: stretch.to_v() }
    }
}

impl Signal {
    /// Returns the voltage of a schedule, in V, with a piece starting at each of `times_s`; `before` is the voltage
    /// before the first.
    pub fn new(schedule: &Schedule, times_s: &[f64], before: f64) -> Self {
        let allowed = |per_row: f64| FEWEST_PIECES.max((per_row * times_s.len() as f64) as usize);
        let signal = Self::divided(schedule, times_s, before, 1.0, 0.0);
        let at_rows: Vec<f64> = signal.at_rows().collect();
        let changes = at_rows.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let first = if 2 * changes > times_s.len() { PIECES_PER_CHANGE } else { PIECES_PER_ROW };
        if signal.pieces.len() <= allowed(first) {
            return signal;
        }
        Self::coarser(schedule, times_s, before, allowed(PIECES_PER_ROW), 0.0, 2.0)
    }

    /// Returns the same with at most `pieces` pieces, as far as changes of the voltage and rows leave a choice, and with
    /// neighbouring pieces replaced by a chord where that changes the voltage by `blur_v` or less; up to `MOST_BLUR` times
    /// that where they would be too many.
    pub fn coarse(schedule: &Schedule, times_s: &[f64], before: f64, pieces: usize, blur_v: f64) -> Self {
        Self::coarser(schedule, times_s, before, pieces, blur_v, 1.0)
    }

    /// Returns the same, with at least a given coarseness.
    fn coarser(
        schedule: &Schedule,
        times_s: &[f64],
        before: f64,
        pieces: usize,
        blur_v: f64,
        mut coarseness: f64,
    ) -> Self {
        let duration_s = times_s.last().unwrap_or(&0.0) - times_s.first().unwrap_or(&0.0);
        loop {
            let signal = Self::divided(schedule, times_s, before, coarseness, blur_v * coarseness.min(MOST_BLUR));
            if signal.pieces.len() <= pieces || coarseness * SHORTEST_PIECE_S > duration_s {
                return signal;
            }
            coarseness *= 2.0;
        }
    }

    /// Returns the voltage of a schedule in pieces of a given coarseness.
    fn divided(schedule: &Schedule, times_s: &[f64], before: f64, coarseness: f64, blur_v: f64) -> Self {
        let mut signal = Self { before, ..Self::default() };
        let mut reader = schedule.reader();
        let mut stretches = Vec::new();
        let mut course = LastChange::new(schedule);
        let longest_s = |since_s: f64| coarseness * SHORTEST_PIECE_S.max(GROWTH * since_s);
        for pair in times_s.windows(2) {
            signal.start_row();
            reader.at(pair[0]);
            let changed_s = course.changed_s(pair[0], reader.clone().stretches(pair[0], pair[1]));
            let first_s = longest_s(pair[0] - changed_s);
            let parts = ((pair[1] - pair[0]) / first_s * (1.0 - 1e-9)).ceil().max(1.0);
            let mut start_s = pair[0];
            for part in 1.. {
                // The last part ends exactly at the row, where the voltage may jump.
                let end_s = match parts {
                    _ if part as f64 == parts => pair[1],
                    ..=MOST_EQUAL_PIECES => pair[0] + (pair[1] - pair[0]) * part as f64 / parts,
                    _ => (start_s + longest_s(start_s - changed_s)).min(pair[1]),
                };
                reader.at(start_s);
                stretches.clear();
                stretches.extend(reader.clone().stretches(start_s, end_s));
                signal.push(&stretches, blur_v);
                start_s = end_s;
                if end_s == pair[1] {
                    break;
                }
            }
        }
        if let Some(&last) = times_s.last() {
            signal.start_row();
            let value = reader.at(last);
            signal.pieces.push(Piece { duration_s: 0.0, from: value, to: value });
        }
        signal
    }

    /// Appends stretches that follow each other without a jump as one chord if its error is at most `blur_v`, else one
    /// by one.
    fn push(&mut self, stretches: &[Stretch], blur_v: f64) {
        for stretches in stretches.chunk_by(|a, b| (b.from_v - a.to_v()).abs() <= 2.0 * blur_v) {
            match chord(stretches, blur_v) {
                Some(chord) => self.pieces.push(chord),
                None => self.pieces.extend(stretches.iter().map(Piece::from)),
            }
        }
    }
}

/// The straight line that the voltage has followed since its last change, and the tolerance for leaving it.
struct LastChange {
    since_s: f64,
    from_v: f64,
    slope: f64,
    still_v: f64,
}

impl LastChange {
    fn new(schedule: &Schedule) -> Self {
        let full_scale_v = schedule.pieces().iter().fold(0.0, |most: f64, piece| most.max(piece.from_v.abs()));
        Self { since_s: f64::NEG_INFINITY, from_v: f64::NAN, slope: 0.0, still_v: STILL_FRACTION * full_scale_v }
    }

    /// Advances over stretches that begin at `time_s` and returns the time of the last change, in s.
    fn changed_s(&mut self, mut time_s: f64, stretches: impl Iterator<Item = Stretch>) -> f64 {
        for stretch in stretches {
            let end_s = time_s + stretch.duration_s;
            let off_v = |time_s: f64, v: f64| (v - self.from_v - self.slope * (time_s - self.since_s)).abs();
            let follows = off_v(time_s, stretch.from_v).max(off_v(end_s, stretch.to_v())) <= self.still_v;
            if !follows {
                *self = Self { since_s: time_s, from_v: stretch.from_v, slope: stretch.slope, ..*self };
            }
            time_s = end_s;
        }
        self.since_s
    }
}

/// Returns one straight piece that replaces the stretches with an error of at most `blur_v`, in V; `None` if there is
/// none.
fn chord(stretches: &[Stretch], blur_v: f64) -> Option<Piece> {
    let (first, last) = (stretches.first()?, stretches.last()?);
    let duration_s: f64 = stretches.iter().map(|stretch| stretch.duration_s).sum();
    let chord = Piece { duration_s, from: first.from_v, to: last.to_v() };
    let slope = (chord.to - chord.from) / duration_s;
    let mut at = chord.from;
    let straight = stretches.iter().all(|stretch| {
        let start = (stretch.from_v - at).abs();
        at += slope * stretch.duration_s;
        start.max((stretch.to_v() - at).abs()) <= blur_v
    });
    straight.then_some(chord)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::signal::lag::Lag;
    use random_numbers::Lcg32;
    use simulation::record::Record;
    use simulation::schedule::Between;

    /// Returns a schedule with one row per second, and the times of the rows.
    fn every_second(volts: impl Iterator<Item = f64>) -> (Schedule, Vec<f64>) {
        let rows: Vec<String> = volts.enumerate().map(|(row, volts)| format!("{row},{volts}\n")).collect();
        let text = format!("time_s,voltage_v\n{}", rows.concat());
        let schedule = Schedule::from_record(&Record::parse("r", &text, "stiffness").unwrap(), Between::Hold);
        (schedule, (0..rows.len()).map(|row| row as f64).collect())
    }

    /// Returns the largest difference, in V at rows 1 s apart, between a signal and one with pieces of 1/60 s behind two lags in
    /// series.
    fn apart_v(schedule: &Schedule, times: &[f64], taus_s: [f64; 2]) -> f64 {
        let fine_times: Vec<f64> = (0..60 * times.len() - 59).map(|part| part as f64 / 60.0).collect();
        let mut fine = Signal::coarse(schedule, &fine_times, 0.0, usize::MAX, 0.0);
        let mut signal = Signal::new(schedule, times, 0.0);
        for signal in [&mut signal, &mut fine] {
            for tau_s in taus_s {
                let mut lag = Lag::at(tau_s, 0.0);
                signal.pass(|piece| lag.pass(piece));
            }
        }
        let pairs = signal.at_rows().zip(fine.at_rows().step_by(60));
        pairs.map(|(signal, fine)| (signal - fine).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn growing_pieces_change_two_lags_in_series_by_less_than_25_mv() {
        let (schedule, times) = every_second((0..600).map(|row| 100.0 * f64::from((row / 60) % 3)));
        let pieces = Signal::new(&schedule, &times, 0.0).pieces.len();
        assert!(pieces < 2 * times.len(), "{pieces} pieces");
        for taus_s in [[1.0, 5.5], [20.0, 2.0], [5.5, 60.0]] {
            let apart = apart_v(&schedule, &times, taus_s);
            assert!(apart < 0.025, "{taus_s:?}: {apart} V of 200");
        }
    }

    /// Rows are 0.18 time constants apart, and every one has another voltage.
    #[test]
    fn two_pieces_a_row_change_two_lags_under_random_voltages_by_less_than_2_in_1000() {
        let mut numbers = Lcg32::new(1);
        let (schedule, times) = every_second((0..2500).map(|_| 500.0 * numbers.uniform()));
        let pieces = Signal::new(&schedule, &times, 0.0).pieces.len();
        assert!(pieces <= 2 * times.len(), "{pieces} pieces");
        for (taus_s, most_v) in [([5.5, 5.5], 0.1), ([5.5, 60.0], 0.02), ([1.0, 5.5], 0.9)] {
            let apart = apart_v(&schedule, &times, taus_s);
            assert!(apart < most_v, "{taus_s:?}: {apart} V of 500");
        }
    }

    /// One row is 10 000 s after the one before it.
    #[test]
    fn number_of_pieces_grows_with_the_rows_and_not_with_the_time() {
        let pieces = |pause_s: f64| {
            let row = |row: i32| {
                format!("{},{}\n", f64::from(row) + if row > 200 { pause_s } else { 0.0 }, 100 * (row / 50 % 3))
            };
            let text = format!("time_s,voltage_v\n{}", (0..400).map(row).collect::<String>());
            let record = Record::parse("r", &text, "stiffness").unwrap();
            let times: Vec<f64> = record.rows.iter().map(|row| row.time_s).collect();
            Signal::new(&Schedule::from_record(&record, Between::Hold), &times, 0.0).pieces.len()
        };
        assert!(pieces(1e4) < pieces(0.0) + 300, "{} {}", pieces(0.0), pieces(1e4));
        // Where the voltage never rests, pieces do not grow, but their number is limited.
        for rows in [600, 6000] {
            let (schedule, times) = every_second((0..rows).map(f64::from));
            assert!(Signal::new(&schedule, &times, 0.0).pieces.len() <= FEWEST_PIECES.max(2 * times.len()));
        }
    }

    /// The voltage rises by 1 V every 10 ms, then drops to 0 V; rows are 0.5 s apart.
    #[test]
    fn coarse_signal_joins_small_steps_but_not_jumps() {
        let row = |row: usize| format!("{},{}\n", 0.01 * row as f64, if row < 130 { row } else { 0 });
        let text = format!("time_s,voltage_v\n{}", (0..200).map(row).collect::<String>());
        let schedule = Schedule::from_record(&Record::parse("r", &text, "stiffness").unwrap(), Between::Hold);
        let pieces = |blur_v| Signal::divided(&schedule, &[0.0, 0.5, 1.0, 1.5], 0.0, 5.0, blur_v).pieces;
        let ramp = Piece { duration_s: 0.5, from: 0.0, to: 49.0 };
        let [fine, coarse] = [0.0, 1.1].map(pieces);
        assert!((ramp.duration_s - coarse[0].duration_s).abs() < 1e-9 && coarse[0].to == ramp.to, "{:?}", coarse[0]);
        assert_eq!(coarse[1].from, 50.0);
        let ends: Vec<(f64, f64)> = coarse[2..].iter().map(|piece| (piece.from, piece.to)).collect();
        assert_eq!(ends, [(100.0, 129.0), (0.0, 0.0), (0.0, 0.0)]);
        // Without a tolerance only equal voltages are joined.
        assert_eq!(fine.len(), 130 + 2);
    }
}
