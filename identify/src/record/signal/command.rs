//! Division of the commanded voltage into pieces.
//!
//! The output of a lag over a piece is taken as straight by the next lag. So pieces are short compared with the fastest
//! time constants just after a change of the voltage, and later short compared with the time since that change, when
//! only slow transients are left.

use crate::record::signal::piecewise::{Piece, Signal};
use simulation::schedule::{Schedule, Stretch};

/// Maximum length of a piece just after a change, in s: a transient with a time constant of 1 s departs from its chord
/// by at most 1/800 of its amplitude.
const SHORTEST_PIECE_S: f64 = 0.1;
/// Maximum length of a later piece relative to the time since the last change: a transient of any time constant departs
/// from its chord by at most 1/6000 of its amplitude.
const GROWTH: f64 = 0.05;
/// Changes below this fraction of the full scale do not count.
const STILL_FRACTION: f64 = 1e-4;
/// Upper limit for the number of pieces that the shortest length may lead to; records with coarse rows keep coarse
/// pieces.
const MOST_PIECES: usize = 20_000;

impl From<&Stretch> for Piece {
    fn from(stretch: &Stretch) -> Self {
        Self { duration_s: stretch.duration_s, from: stretch.from_v, to: stretch.to_v() }
    }
}

impl Signal {
    /// Returns the voltage of a schedule, in V, with a piece starting at each of `times_s`; `before` is the voltage
    /// before the first.
    pub fn new(schedule: &Schedule, times_s: &[f64], before: f64) -> Self {
        Self::coarse(schedule, times_s, before, MOST_PIECES, 0.0)
    }

    /// Returns the same with pieces no shorter than the duration divided by `pieces`, and with neighbouring pieces
    /// replaced by a chord where that changes the voltage by `blur_v` or less.
    pub fn coarse(schedule: &Schedule, times_s: &[f64], before: f64, pieces: usize, blur_v: f64) -> Self {
        let duration = times_s.last().unwrap_or(&0.0) - times_s.first().unwrap_or(&0.0);
        let shortest = SHORTEST_PIECE_S.max(duration / pieces as f64);
        let mut signal = Self { before, ..Self::default() };
        let mut reader = schedule.reader();
        let mut stretches = Vec::new();
        let mut course = LastChange::new(schedule);
        for pair in times_s.windows(2) {
            signal.start_row();
            reader.at(pair[0]);
            let changed_s = course.changed_s(pair[0], reader.clone().stretches(pair[0], pair[1]));
            let longest = shortest.max(GROWTH * (pair[0] - changed_s));
            let parts = ((pair[1] - pair[0]) / longest * (1.0 - 1e-9)).ceil().max(1.0);
            // The last part ends exactly at the row, where the voltage may jump.
            let start = |part: usize| match part as f64 / parts {
                1.0 => pair[1],
                of => pair[0] + (pair[1] - pair[0]) * of,
            };
            for part in 0..parts as usize {
                reader.at(start(part));
                stretches.clear();
                stretches.extend(reader.clone().stretches(start(part), start(part + 1)));
                signal.push(&stretches, blur_v);
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
    use simulation::record::Record;
    use simulation::schedule::Between;

    /// Returns a schedule with one row per second, and the times of the rows.
    fn every_second(volts: impl Iterator<Item = f64>) -> (Schedule, Vec<f64>) {
        let rows: Vec<String> = volts.enumerate().map(|(row, volts)| format!("{row},{volts}\n")).collect();
        let text = format!("time_s,voltage_v\n{}", rows.concat());
        let schedule = Schedule::from_record(&Record::parse("r", &text, "stiffness").unwrap(), Between::Hold);
        (schedule, (0..rows.len()).map(|row| row as f64).collect())
    }

    /// The reference is the same chain with pieces of 1/60 s everywhere.
    #[test]
    fn growing_pieces_change_two_lags_in_series_by_less_than_25_mv() {
        let (schedule, times) = every_second((0..600).map(|row| 100.0 * f64::from((row / 60) % 3)));
        let fine_times: Vec<f64> = (0..60 * times.len() - 59).map(|part| part as f64 / 60.0).collect();
        let [mut grown, mut fine] = [&times, &fine_times].map(|times| Signal::new(&schedule, times, 0.0));
        assert!(grown.pieces.len() < 2 * times.len(), "{} pieces", grown.pieces.len());
        for taus_s in [[1.0, 5.5], [20.0, 2.0], [5.5, 60.0]] {
            for signal in [&mut grown, &mut fine] {
                for tau_s in taus_s {
                    let mut lag = Lag::at(tau_s, 0.0);
                    signal.pass(|piece| lag.pass(piece));
                }
            }
            let pairs = grown.at_rows().zip(fine.at_rows().step_by(60));
            let apart = pairs.map(|(grown, fine)| (grown - fine).abs()).fold(0.0, f64::max);
            assert!(apart < 0.025, "{taus_s:?}: {apart} V of 200");
        }
        // If the voltage never rests, pieces do not grow.
        let (schedule, times) = every_second((0..600).map(f64::from));
        assert_eq!(Signal::new(&schedule, &times, 0.0).pieces.len(), 10 * 599 + 1);
    }

    /// The voltage rises by 1 V every 10 ms, then drops to 0 V; rows are 0.5 s apart.
    #[test]
    fn coarse_signal_joins_small_steps_but_not_jumps() {
        let row = |row: usize| format!("{},{}\n", 0.01 * row as f64, if row < 130 { row } else { 0 });
        let text = format!("time_s,voltage_v\n{}", (0..200).map(row).collect::<String>());
        let schedule = Schedule::from_record(&Record::parse("r", &text, "stiffness").unwrap(), Between::Hold);
        let pieces = |blur_v| Signal::coarse(&schedule, &[0.0, 0.5, 1.0, 1.5], 0.0, 3, blur_v).pieces;
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
