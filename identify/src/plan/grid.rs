//! The rows in which a candidate is predicted: all readings, or a few after each change of the voltage, each for many readings.

use simulation::record::{Record, Row};

use crate::hypotheses::Coordinates;
use crate::plan::candidate::{Commands, Frame};
use crate::record::data::Data;
use crate::record::input::Input;
use crate::record::normalisation::{Normalisation, Start};
use crate::record::scales::Scales;

/// Ratio of the distances of two neighbouring rows from the change before them.
const GROWTH: f64 = 1.25;
/// Largest part of a segment, and of the time constant, between two rows.
const LARGEST_PART: f64 = 0.1;

/// Rows of a prediction.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Number of readings that each row stands for.
    pub(super) weights: Vec<f64>,
    /// Index of each row's reading.
    pub(super) rows: Vec<usize>,
    /// True if there is a row for every reading.
    pub(super) complete: bool,
}

impl Grid {
    /// Returns a row for every reading.
    pub(super) fn complete(frame: &Frame) -> Self {
        Self { weights: vec![1.0; frame.rows], rows: (0..frame.rows).collect(), complete: true }
    }

    /// Returns rows that grow apart after each change of level.
    pub(super) fn thinned(commands: &Commands, frame: &Frame) -> Self {
        let mut rows = Vec::new();
        for &(from, to, _) in &commands.parts {
            let longest = (LARGEST_PART * ((to - from) as f64).max(frame.tau_rows)).max(1.0) as usize;
            let mut off = 0;
            while from + off < to {
                rows.push(from + off);
                off += (((GROWTH - 1.0) * off as f64) as usize).clamp(1, longest.max(1));
            }
        }
        let ends = rows.iter().skip(1).copied().chain([frame.rows]);
        let weights = rows.iter().zip(ends).map(|(&from, to)| (to - from) as f64).collect();
        Self { weights, rows, complete: false }
    }

    /// Returns the record of a candidate on these rows, with readings of 0, in the coordinates of the first record.
    pub(super) fn data(&self, commands: &Commands, frame: &Frame, coordinates: &Coordinates) -> Data {
        let mut rows = Vec::with_capacity(self.rows.len() + commands.held.len());
        let (mut held, mut voltage_v) = (commands.held.iter().peekable(), 0.0);
        let row = |row: usize, voltage_v: f64, measured: Option<f64>| Row {
            line: 0,
            time_s: row as f64 * frame.sample_s,
            voltage_v,
            measured,
        };
        for &read in &self.rows {
            while let Some(&&(from, volts)) = held.peek().filter(|next| next.0 <= read) {
                voltage_v = volts;
                held.next();
                if from < read {
                    rows.push(row(from, volts, None));
                }
            }
            rows.push(row(read, voltage_v, Some(0.0)));
        }
        let record = Record { name: String::new(), rows };
        let Coordinates { full_scale_v, largest_v, origin_v, sample_s, uniform, .. } = *coordinates;
        let largest_v = largest_v.max(full_scale_v);
        let data = Data::thinned(&record, Input::Hold, 1, &normalisation(coordinates));
        // The points of the models are relative to the first record, and the spring is at rest at the start.
        let initial_state_unknown = false;
        Data { full_scale_v, largest_v, origin_v, record_sample_s: sample_s, uniform, initial_state_unknown, ..data }
    }
}

/// Returns the normalisation of a record that begins at 0 s.
pub(super) fn normalisation(coordinates: &Coordinates) -> Normalisation {
    let Coordinates { second_s, volt_v, zero, reading, output, share, even, start, .. } = *coordinates;
    let scales = Scales { start_s: 0.0, second_s, volt_v, zero, reading, output, ..Scales::default() };
    let start = start.map(|it| Start { gain: it.gain, tau_s: it.tau_s, share: it.share, offset: it.offset });
    Normalisation { scales, share, even, start, ..Normalisation::default() }
}
