//! The scales of a record from which every start and bound of the search is derived.

use crate::record::data::Data;

/// Scales of one record, in its normalised coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Largest magnitude of the voltage, in V.
    pub full_v: f64,
    /// Median time between rows, in s.
    pub sample_s: f64,
    /// Time from the first to the last row, in s.
    pub duration_s: f64,
}

impl Scale {
    /// Returns the scales of a record.
    pub fn of(data: &Data) -> Self {
        Self { full_v: data.full_scale_v, sample_s: data.sample_s, duration_s: data.duration_s() }
    }

    /// Returns time constants from the spacing of the rows to the length of the record, at most a `ratio` apart.
    pub(super) fn creep_taus(&self, ratio: f64) -> Vec<f64> {
        self.times(self.sample_s, self.duration_s, (self.duration_s / self.sample_s).max(1.0).ln() / ratio.ln())
    }

    /// Returns `steps + 1` times from `first_s` to `last_s` in geometric order.
    pub(super) fn times(&self, first_s: f64, last_s: f64, steps: f64) -> Vec<f64> {
        let steps = steps.ceil().max(1.0) as i32;
        let ratio = (last_s / first_s).powf(1.0 / f64::from(steps));
        (0..=steps).map(|step| first_s * ratio.powi(step)).collect()
    }
}
